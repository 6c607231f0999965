"""A UR's controller with ur-rtde's control script, on a simulated arm: commands in, variables out."""

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from rtde_dictionary import CODES, OUTPUTS
from tool_axis_arm import REST, START, Joints, ToolAxisArm, turns

from palpate.signals.rotations import quaternion_from_vector

_RUNNING, _STOPPED = 2, 1
_MODE_RUNNING, _JOINT_RUNNING = 7, 253
_TOUCH = 1.0
"""Force from which the tool touches [N]."""
READY, DONE = 1, 2
# Numbers of ur-rtde's commands.
NOTHING, ZERO, SPEEDL, SPEED_STOP, SERVO_STOP, SERVOL, WATCHDOG, STOP = 0, 8, 10, 15, 16, 24, 35, 255
_DONE = {ZERO, SPEED_STOP, SERVO_STOP, WATCHDOG}
TOOL_CONTACT, STEP_TIME, TORQUES, OFFSET, FORWARD, STEADY, FLANGE = 25, 26, 38, 40, 43, 47, 58
_AT_ONCE = {TOOL_CONTACT, STEP_TIME, TORQUES, FLANGE}
"""Questions after which ur-rtde reads the register at once, whether it is answered or not."""
_NAMES = {
    1: "moveJ", 2: "moveJ_IK", 3: "moveL", 4: "moveL_FK", 6: "forceMode", 7: "forceModeStop", 9: "speedJ", 10: "speedL",
    11: "servoJ", 12: "servoC", 17: "setPayload", 18: "teachMode", 19: "endTeachMode", 20: "forceModeSetDamping",
    21: "forceModeSetGainScaling", 24: "servoL", 29: "setTcp", 31: "triggerProtectiveStop", 33: "stopL", 34: "stopJ",
    36: "isPoseWithinSafetyLimits", 37: "isJointsWithinSafetyLimits", 41: "jogStart", 45: "movePath",
    46: "getInverseKinematics", 51: "moveUntilContact", 52: "freedriveMode", 62: "startContactDetection",
    66: "directTorque",
}  # fmt: skip
"""Of ur-rtde's commands, by number."""
_ROTATION = (math.pi, 0.0, 0.0)
"""Of the tool, which points down, as a rotation vector [rad]."""
_TURNED = 1e-4
"""Of a rotation, one less the cosine of half its angle, up to which it is none: 1.6 degrees."""


class Controller:
    """The arm, and what a control script would do with it.

    Args:
        arm: the simulated arm.
    """

    def __init__(self, arm: ToolAxisArm):
        self.arm = arm
        self.running, self.state = False, READY
        self.velocity: Any = REST
        self.place: Any = None
        self.zero = np.zeros(3)
        self.least, self.heard, self.touching = 0.0, 0.0, 0
        self.commands: list[int] = []
        self.answer: list[float] = []
        self.master: Any = None  # the connection that sets its registers
        self._joints: Joints | None = None

    def start_script(self) -> None:
        """A control script has come, and runs."""
        self.rest()
        self.running, self.state = True, READY
        self.least, self.heard = 0.0, self.arm.time

    def rest(self) -> None:
        """Bring the arm to rest."""
        self.velocity, self.place = REST, None

    def end(self, why: str = "") -> None:
        """End the script, as a controller does with a command that it cannot execute."""
        if why:
            sys.stderr.write(f"rtde_arm: {why}: the script has ended\n")
        self.rest()
        self.running = False

    def obey(self, numbers: dict[str, Any]) -> None:
        """A packet of registers."""
        command = int(numbers.get("input_int_register_0", 0))
        self.heard = self.arm.time
        if command == NOTHING:
            self.state = READY
            return
        if not self.running:
            return
        self.commands.append(command)
        value = [float(numbers.get(f"input_double_register_{i}", 0.0)) for i in range(8)]
        if command in {SPEEDL, SERVOL}:
            self._move(command, value)
            return
        if command in {SPEED_STOP, SERVO_STOP}:
            self.rest()
        if command == ZERO:
            self.zero = np.array(self.arm.reading()[:3])
        if command == WATCHDOG:
            self.least = value[0]
        answer = self._answer(command, value)
        if command == STOP:
            self.end()
        elif answer is None and command not in _DONE:
            self.end(f"command {command} of ur-rtde ({_NAMES.get(command, 'another')}) is not simulated")
            return
        self.answer = answer or self.answer
        self.state = self.state if command in _AT_ONCE else DONE

    def _move(self, command: int, value: list[float]) -> None:
        """speedL, or servoL: neither may turn the tool."""
        turned = turns(value[:6])
        if command == SERVOL:
            turned = 1.0 - abs(np.dot(quaternion_from_vector(value[3:6]), (1.0, 0.0, 0.0, 0.0))) > _TURNED
        if turned:
            self.end(f"{_NAMES[command]} that turns the tool is not simulated")
        elif command == SERVOL:
            self.place = value[:3]
        else:
            self.velocity, self.place = value[:3], None

    def _answer(self, command: int, value: list[float]) -> list[float] | None:
        """The numbers by which a question is answered; None of a command that is none."""
        if command == TOOL_CONTACT:
            direction, force = np.array(value[:3]), self.force()
            against = not direction.any() or direction @ force < 0.0
            return [float(self.touching if against else 0)]
        if command == STEP_TIME:
            return [self.arm.world.tick]
        if command == TORQUES:
            return list(self.joints().arm.jacobian(self.joints().q).T @ [*-self.force(), 0.0, 0.0, 0.0])
        if command in {FORWARD, FLANGE}:
            return [*self.arm.reading()[6:9], *_ROTATION]
        if command == STEADY:
            return [float(not any(self.velocity) and self.place is None)]
        return [0.0] * 6 if command == OFFSET else None

    def joints(self) -> Joints:
        """Those of a UR5e with its tool here; solved for where they are asked for."""
        place = np.array(self.arm.reading()[6:9])
        if self._joints is None:
            self._joints = Joints("ur5e", place)
        self._joints.follow(place)
        return self._joints

    def force(self) -> Any:
        """As the controller shows it: what the surface exerts on the tool, in the base, shape (3,) [N]."""
        return self.zero - self.arm.reading()[:3]

    def tick(self) -> None:
        """Go on by one tick."""
        if self.least and self.arm.time - self.heard > 1.0 / self.least:
            self.end()
        if self.place is not None:
            self.velocity = self.arm.velocity_to(self.place)
        self.arm.tick(self.velocity)
        self.touching = self.touching + 1 if self.arm.body.reading > _TOUCH else 0

    def value(self, name: str) -> Any:
        """Value of a variable, by its name; NaN or 0 of one that is not simulated."""
        if name in _CONSTANT:
            return _CONSTANT[name]
        simulated = _CHANGING.get(name)
        if simulated is not None:
            return simulated(self)
        if "_register_" in name:
            number = int(name.rpartition("_")[2])
            if name.startswith("output_double") and number < len(self.answer):
                return self.answer[number]
            return int(self.answer[0]) if name == "output_int_register_1" and self.answer else 0
        code = CODES[OUTPUTS[name]]
        zero = math.nan if code[-1] == "d" else 0
        return zero if len(code) == 1 else (zero,) * int(code[0])

    def pose(self) -> Any:
        """Of the tool: position [m] and rotation vector [rad], shape (6,)."""
        return (*self.arm.reading()[6:9], *_ROTATION)

    def raw_wrench(self) -> Any:
        """Of the sensor, which nobody zeroes, in the flange's axes [N], [N m], shape (6,)."""
        fx, fy, fz = self.arm.reading()[:3]
        return (-fx, fy, fz, 0.0, 0.0, 0.0)  # the reaction, in the axes of a tool that points down

    def twist(self) -> Any:
        """Of the tool, linear above turning [m/s], [rad/s], shape (6,)."""
        return (*self.velocity[:2], -self.arm.body.v, 0.0, 0.0, 0.0)


_CONSTANT: dict[str, Any] = {
    "robot_mode": _MODE_RUNNING,
    "joint_mode": (_JOINT_RUNNING,) * 6,
    "safety_mode": 1,
    "safety_status": 1,
    "safety_status_bits": 1,
    "speed_scaling": 1.0,
    "target_speed_fraction": 1.0,
    "payload": 0.0,
    "payload_cog": (0.0,) * 3,
    "payload_inertia": (0.0,) * 6,
    "tcp_offset": (0.0,) * 6,
}
"""Values that do not change here: the arm runs, nothing stops it, no tool is set up."""
_CHANGING: dict[str, Callable[[Controller], Any]] = {
    "timestamp": lambda self: self.arm.time,
    "actual_TCP_pose": Controller.pose,
    "actual_TCP_speed": Controller.twist,
    "actual_TCP_force": lambda self: (*self.force(), 0.0, 0.0, 0.0),
    "ft_raw_wrench": Controller.raw_wrench,
    "tcp_force_scalar": lambda self: float(np.linalg.norm(self.force())),
    "target_TCP_pose": lambda self: (*self.arm.at, START - self.arm.command, *_ROTATION),
    "target_TCP_speed": lambda self: (*self.velocity, 0.0, 0.0, 0.0),
    "actual_q": lambda self: tuple(self.joints().q),
    "actual_qd": lambda self: tuple(self.joints().rates(self.twist())),
    "robot_status_bits": lambda self: 1 | (2 if self.running else 0),
    "runtime_state": lambda self: _RUNNING if self.running else _STOPPED,
    "output_int_register_0": lambda self: self.state,
}
"""Values of the simulated arm."""
SIMULATED = frozenset({*_CONSTANT, *_CHANGING})
"""Variables that have a value of their own; others are NaN, or 0 where they are integers."""
