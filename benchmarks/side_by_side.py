"""The same arm pressing the same foam in four engines, in one run: what a tick of 1 ms costs in each.

All take 20 steps of 50 us between ticks and answer with the hybrid law and its force filter. MuJoCo has the arm as a
model and the foam as a plate on a sliding joint; it and NumPy are asked from Python once a tick. Only the bench has
friction, encoders, the sensor's chain, three estimators and a record as well.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.bench import build, load, march, start_at
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import Loop, compiled_march
from palpate.controllers.hybrid import Hybrid
from palpate.environments import KelvinVoigt
from palpate.environments.surface import contact_force
from palpate.robots import Planar3R
from palpate.robots.arm3 import Arm3, ArmModel
from palpate.signals.filters import butterworth2
from palpate.signals.types import Sense, Task

Array = NDArray[np.float64]
TICK, STEPS, FORCE = 1e-3, 20, 20.0
FOAM, WALL, START = KelvinVoigt(5200.0, 200.0, 0.10), 0.465, (0.4689, 0.0, 0.0)
SELECTED = np.array([1.0, 0.0, 0.0])
LONG, SHORT = 2000, 100
"""Ticks of the fast engines, and of those in plain Python."""
APPROACH = 18.0
"""Seconds after which the bench presses."""


@dataclass
class Controller:
    """The hybrid law on arrays, as a loop of one's own would call it."""

    law: Hybrid = field(
        default_factory=lambda: Hybrid(*(np.full(3, gain) for gain in (400.0, 80.0, 1.0, 0.003)))
    )
    smooth: object = field(default_factory=lambda: butterworth2(120.0, 1.0 / TICK))

    def __post_init__(self) -> None:
        self.integral, self.filter = self.law.start(), self.smooth.start_at(FORCE)
        self.task = Task(np.array(START), np.zeros(3), np.zeros(3), FORCE * SELECTED, SELECTED)

    def torque(self, model: ArmModel, pose: Array, q: Array, qd: Array, force: float) -> Array:
        f, self.filter = self.smooth.step(self.filter, force)
        sense = Sense(q, qd, pose, model.J @ qd, f * SELECTED)
        torque, self.integral = self.law.step(self.integral, sense, self.task, model)
        return torque


class InNumPy:
    """The bench's plant on NumPy arrays, step by step; without friction."""

    def __init__(self) -> None:
        self.arm, self.control = Planar3R().with_rotors(), Controller()
        self.q, self.qd, self.force = self.arm.inverse_kinematics(START), np.zeros(3), FORCE

    def __call__(self) -> float:
        arm, q, qd = self.arm, self.q, self.qd
        pose, J = arm.forward_kinematics(q), arm.jacobian(q)
        model = ArmModel(J, arm.jacobian_dot(q, qd) @ qd, arm.mass_matrix(q), arm.bias_torque(q, qd))
        torque = self.control.torque(model, pose, q, qd, self.force)
        for _ in range(STEPS):
            self.step(torque, TICK / STEPS)
        return self.force

    def step(self, torque: Array, dt: float) -> None:
        arm, q, qd = self.arm, self.q, self.qd
        M, normal = arm.mass_matrix(q), arm.jacobian(q)[0]
        depth, rate = arm.forward_kinematics(q)[0] - WALL, normal @ qd
        drive, per_normal = torque - arm.bias_torque(q, qd), np.linalg.solve(M, normal)
        free = normal @ np.linalg.solve(M, drive) + (arm.jacobian_dot(q, qd) @ qd)[0]
        elastic = FOAM.force(None, depth, rate)
        self.force = max(contact_force(elastic, FOAM.mass, 1.0 / (normal @ per_normal), free), 0.0)
        self.qd = qd + dt * (np.linalg.solve(M, drive) - per_normal * self.force)
        self.q = q + dt * self.qd


class InMuJoCo:
    """The arm and a plate before it on a spring, a damper and a slide, stepped by MuJoCo."""

    def __init__(self) -> None:
        import mujoco

        self.mujoco, arm = mujoco, Arm3().with_rotors()
        self.model = mujoco.MjModel.from_xml_string(scene(arm))
        self.data, self.control = mujoco.MjData(self.model), Controller()
        self.tip = self.model.site("tip").id
        self.data.qpos[:3] = Planar3R().inverse_kinematics(START)
        self.data.qpos[3] = START[0] - WALL
        self.linear, self.angular, self.full = np.zeros((3, 4)), np.zeros((3, 4)), np.zeros((4, 4))
        mujoco.mj_forward(self.model, self.data)

    def __call__(self) -> float:
        mujoco, data = self.mujoco, self.data
        q, qd = data.qpos[:3], data.qvel[:3]
        mujoco.mj_jacSite(self.model, data, self.linear, self.angular, self.tip)
        J = np.vstack([self.linear[:2, :3], self.angular[2:, :3]])
        mujoco.mj_fullM(self.model, data, self.full)
        pose = np.array([*data.site_xpos[self.tip][:2], q.sum()])
        model = ArmModel(J, np.zeros(3), self.full[:3, :3], data.qfrc_bias[:3])
        force = FOAM.stiffness * data.qpos[3] + FOAM.damping * data.qvel[3]
        data.qfrc_applied[:3] = self.control.torque(model, pose, q, qd, force)
        mujoco.mj_step(self.model, data, nstep=STEPS)
        return float(force)


def scene(arm: Arm3) -> str:
    """The arm, its tip a small ball, and the plate, which the ball touches at x = WALL."""
    origins = (0.0, arm.length.x, arm.length.y)
    numbers = zip(origins, arm.length, arm.com, arm.mass, arm.moment, strict=True)
    links = "".join(
        f'<body pos="{o} 0 0"><joint axis="0 0 1"/><inertial pos="{a + s} 0 0" mass="{m}" diaginertia="{i} {i} {i}"/>'
        for o, a, s, m, i in numbers
    )
    tip = f'<site name="tip" pos="{arm.length.z} 0 0"/><geom size="0.01" pos="{arm.length.z} 0 0" mass="0"/>'
    slide = f'<joint type="slide" axis="1 0 0" stiffness="{FOAM.stiffness}" damping="{FOAM.damping}"/>'
    plate = f'<geom type="box" size="0.01 0.1 0.1" mass="{FOAM.mass}"/>'
    return f"""<mujoco><option gravity="0 0 0" timestep="{TICK / STEPS}" integrator="implicitfast"/>
      <default><geom solref="0.0002 1" condim="1"/></default><worldbody>{links}{tip}{"</body>" * 3}
      <body pos="{WALL + 0.02} 0 0">{slide}{plate}</body></worldbody></mujoco>"""


def marching(loop: Loop, q, march: Callable) -> Callable[[int], float]:
    """So many ticks of the bench in contact, compiled or plain; the force at the end."""
    done = round(APPROACH / TICK)
    state = compiled_march(loop, start_at(loop, q), 0, np.zeros(done), np.empty((done, len(COLUMNS))))

    def run(ticks: int) -> float:
        out = np.empty((ticks, len(COLUMNS)))
        march(loop, state, done, np.zeros(ticks), out)
        return float(out[-1, list(COLUMNS).index("force")])

    return run


def ticking(engine: Callable[[], float]) -> Callable[[int], float]:
    """So many ticks of an engine that is asked for each."""

    def run(ticks: int) -> float:
        return [engine() for _ in range(ticks)][-1]

    return run


def cost(run: Callable[[int], float], ticks: int, repeats: int) -> float:
    """Seconds a tick, the best of a few; the first run warms up."""
    times = []
    for _ in range(repeats + 1):
        begun = time.thread_time()
        run(ticks)
        times.append((time.thread_time() - begun) / ticks)
    return min(times[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    bench = build(load("foam-hybrid"))
    numpy_bench, mujoco_bench = InNumPy(), InMuJoCo()
    engines = {
        "palpate, compiled": (marching(bench.loop, bench.q, compiled_march), LONG),
        "MuJoCo under a control loop in Python": (ticking(mujoco_bench), LONG),
        "the bench in NumPy, step by step": (ticking(numpy_bench), SHORT),
        "palpate in plain Python, for a debugger": (marching(bench.loop, bench.q, march), SHORT),
    }
    costs = {name: cost(run, ticks, repeats) for name, (run, ticks) in engines.items()}
    ours = costs["palpate, compiled"]
    print("| engine | us a tick | times palpate's | times real time |\n|---|---|---|---|")
    for name, tick in costs.items():
        print(f"| {name} | {1e6 * tick:.1f} | {tick / ours:.1f} | {TICK / tick:.2f} |")
    print(
        f"| force after it, {FORCE:g} N asked | {mujoco_bench():.2f} N in MuJoCo | {numpy_bench():.2f} N in NumPy | |"
    )


if __name__ == "__main__":
    main()
