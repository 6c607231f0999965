"""A simulated arm of `tests/rehearsal` that lies from SIGUSR1 on, and keeps a trace of what it is commanded.

`python faulty_arm.py FAULT TRACE MODULE WORDS...` runs `tests/rehearsal/MODULE.py`. Each tick of the trace is four
numbers: the time of this computer, the commanded position [m], the tip's position [m] and the force on the surface [N].
"""

import importlib
import math
import signal
import struct
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "rehearsal"))

import tool_axis_arm

HUGE = 1e30
"""A number that libfranka's floats hold, and no force or position is."""
ROW = struct.Struct("<4d")


class Fault:
    """What is wrong, from a moment on.

    Args:
        name: of `LIES` or of `CLOCKS`; another one is no fault.
    """

    def __init__(self, name: str):
        self.lie, self.clock = LIES.get(name), CLOCKS.get(name)
        self.since: float | None = None
        self.first: list[float] = []
        self.rng = np.random.default_rng(1)

    def reading(self, values: list[float], now: float) -> list[float]:
        """Force, torque, position, quaternion, as they are shown."""
        if self.since is None or self.lie is None:
            return values
        self.first = self.first or list(values)
        return self.lie(list(values), now - self.since, self)

    def stamp(self, now: float) -> float:
        """The arm's clock, as it is shown [s]."""
        if self.since is None or self.clock is None:
            return now
        return self.clock(now, now - self.since)


def changed(index: int, value):
    """One of the thirteen numbers in the place of what it was: of the value before, the time and the fault."""

    def lie(values, t, fault):
        values[index] = value(values[index], t, fault)
        return values

    return lie


def quaternion(*numbers: float):
    """Another orientation."""
    return lambda values, *_: [*values[:9], *numbers]


# The force along z is the second number, its direction upwards: -20 N press with 20.
FZ, Z = 2, 8
LIES = {
    "force frozen": changed(FZ, lambda _f, _t, fault: fault.first[FZ]),
    "force frozen with a ripple": changed(
        FZ, lambda _f, _t, fault: fault.first[FZ] + 0.1 * fault.rng.normal()
    ),
    "force x 0": changed(FZ, lambda _f, _t, _fault: 1.0),
    "force x 0.1": changed(FZ, lambda f, _t, _fault: 1.0 + 0.1 * (f - 1.0)),
    "force x -1": changed(FZ, lambda f, _t, _fault: 2.0 - f),
    "force steps by 1 N": changed(FZ, lambda f, _t, _fault: f + 1.0),
    "force steps by -1 N": changed(FZ, lambda f, _t, _fault: f - 1.0),
    "force drifts by 0.3 N/s": changed(FZ, lambda f, t, _fault: f + 0.3 * t),
    "force drifts by -0.3 N/s": changed(FZ, lambda f, t, _fault: f - 0.3 * t),
    "force hums with 0.3 N at 15 Hz": changed(FZ, lambda f, t, _fault: f + 0.3 * math.sin(94.2 * t)),
    "noise of 0.5 N": changed(FZ, lambda f, _t, fault: f + 0.5 * fault.rng.normal()),
    "force in steps of 2 N": changed(FZ, lambda f, _t, _fault: 2.0 * round(f / 2.0)),
    "force saturates": changed(FZ, lambda _f, _t, _fault: -100.0),
    "force is huge, once in ten": changed(FZ, lambda f, _t, fault: -HUGE if fault.rng.random() < 0.1 else f),
    "force is NaN": changed(FZ, lambda _f, _t, _fault: math.nan),
    "force is infinite": changed(FZ, lambda _f, _t, _fault: -math.inf),
    "position frozen": changed(Z, lambda _z, _t, fault: fault.first[Z]),
    "position jumps by 0.1 m": changed(Z, lambda z, _t, _fault: z + 0.1),
    "position is huge": changed(Z, lambda _z, _t, _fault: HUGE),
    "position is NaN": changed(Z, lambda _z, _t, _fault: math.nan),
    "quaternion of no length": quaternion(0.0, 0.0, 0.0, 0.0),
    "quaternion is huge": quaternion(HUGE, 0.0, 0.0, HUGE),
    "quaternion is NaN": quaternion(math.nan, 0.0, 0.0, 1.0),
}
CLOCKS = {
    "clock five times too fast": lambda now, t: now + 4.0 * t,
    "clock 1.5 times too fast": lambda now, t: now + 0.5 * t,
    "clock five times too slow": lambda now, t: now - 0.8 * t,
    "clock goes back by 1 s": lambda now, _t: now - 1.0,
    "clock jumps ahead by 1000 s": lambda now, _t: now + 1000.0,
    "clock stands": lambda now, t: now - t,
    "clock runs back": lambda now, t: now - 2.0 * t,
}


def install(fault: Fault, trace) -> None:
    """Put the fault between the arm and its protocol, and keep what the arm is commanded."""
    arm = tool_axis_arm.ToolAxisArm
    tick, reading = arm.tick, arm.reading

    def traced(self, velocity):
        tick(self, velocity)
        trace.write(ROW.pack(time.monotonic(), self.command, self.body.x, self.body.force))
        fault.asked = self
        if fault.on and fault.since is None:
            fault.since = self.time

    fault.on = False
    arm.tick = traced
    arm.reading = lambda self: tuple(fault.reading(list(reading(self)), self.time))
    signal.signal(signal.SIGUSR1, lambda *_: setattr(fault, "on", True))


def stamped(module: str, fault: Fault) -> None:
    """Put the fault between the arm's clock and its protocol."""
    if module == "sim_arm":
        from palpate.wires import sim

        state = sim.state
        sim.state = lambda number, now, values: state(number, fault.stamp(now), values)
    if module == "rtde_arm":
        from rtde_controller import Controller

        value = Controller.value

        def shown(self, name):
            if name == "timestamp":
                return fault.stamp(self.arm.time)
            if name == "actual_TCP_pose" and fault.lie is not None and fault.since is not None:
                *place, x, y, z, w = self.arm.reading()[6:]
                # A rotation vector of half a turn about x, and what a controller would show of no such thing.
                return (
                    (*place, 3.14159 * x, y, z) if (x, y, z, w) != (1.0, 0.0, 0.0, 0.0) else value(self, name)
                )
            return value(self, name)

        Controller.value = shown
    if module == "ros2_arm":
        import ros2_arm

        from palpate.wires import ros2_messages

        header, publish = ros2_messages.header, ros2_arm.Node.publish

        def published(self, arm):
            begun = self._begun
            ros2_messages.header = lambda ns, frame: header(
                max(begun + round(1e9 * fault.stamp(1e-9 * (ns - begun))), 0), frame
            )
            pose = ros2_messages.pose
            ros2_messages.pose = lambda head, place, _: pose(head, place, arm.reading()[9:13])
            try:
                publish(self, arm)
            finally:
                ros2_messages.pose = pose

        ros2_arm.Node.publish = published
    if module == "franka_arm":
        from franky_sim import FrankaRobotServer

        send = FrankaRobotServer.send_state

        def sent(self):
            name = next(n for n in vars(self) if n.endswith("__message_id"))
            own = getattr(self, name)
            setattr(self, name, max(round(1e3 * fault.stamp(1e-3 * own)), 0))
            send(self)
            setattr(self, name, own + 1)

        FrankaRobotServer.send_state = sent


def main() -> None:
    name, trace, module = sys.argv[1:4]
    fault = Fault(name)
    sys.argv = [module, *sys.argv[4:]]
    with Path(trace).open("ab", buffering=0) as file:
        install(fault, file)
        stamped(module, fault)
        importlib.import_module(module).main()


if __name__ == "__main__":
    main()
