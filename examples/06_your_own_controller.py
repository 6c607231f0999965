"""Your own controller on the bench, stepped in plain Python first, then compiled.

A controller is a NamedTuple of gains with `start()`, its state before the first tick, and
`step(state, sense, task, model)`, which returns the joint torques and the next state.
"""

import time
from typing import NamedTuple

from palpate.bench import Vec3, build, load, part, with_values


@part
class Damped(NamedTuple):
    """Presses with the desired force plus an integral of its error, damped in x; holds y and phi."""

    ki: float  # [1/s]
    damping: float  # [N s/m]
    kp: Vec3  # stiffness of what is held [N/m, N/m, N m/rad]
    tick: float  # [s]

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        integral = state + self.ki * self.tick * (task.f.x - sense.f.x)
        push = task.f.x + integral - self.damping * sense.xd.x
        hold = self.kp * (task.x - sense.x - 0.04 * sense.xd)
        wrench = Vec3(push, hold.y, hold.z)
        return model.J.T @ wrench + model.h, integral


# Near the wall and without the wait, so that plain Python reaches it soon.
experiment = with_values(
    load("foam-hybrid"),
    {
        "robot.start": (0.4635, 0.0, 0.0),
        "approach.hold": 0.05,
        "approach.first": 0.470,
        "approach.period": 0.1,
        "run.press": 0.15,
    },
)
bench = build(experiment).with_controller(Damped(3.0, 40.0, Vec3(0.0, 2000.0, 1.0), 1e-3))

begun = time.perf_counter()
stepped = bench.run(1.0, seed=1, press=experiment.run.press, compiled=False)
print(
    f"plain: {len(stepped)} ticks in {time.perf_counter() - begun:.2f} s, a breakpoint in step() would stop here"
)

compiled = bench.run(1.0, seed=1, press=experiment.run.press)
same = all((stepped[name] == compiled[name]).all() for name in stepped.columns)
print(f"compiled: the same numbers to the last bit: {same}")

record = bench.run(10.0, seed=1, press=5.0)
print(f"after 5 s: {record['force'][-1000:].mean():.2f} N of {record['force_desired'][-1]:.0f} N")
