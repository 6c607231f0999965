"""A simulated arm, read and moved as a real one."""

from collections import deque
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import ZERO3
from palpate.arrays import Array
from palpate.environments.surface import UNTOUCHED, rest_for
from palpate.errors import InputError
from palpate.force.arm import Arm, TorqueLoop
from palpate.press.at_rest import TARE
from palpate.press.cell import Body, Reading, TouchState, Workcell
from palpate.press.engines import ByMuJoCo, Engine, Own
from palpate.press.sequence import TipSample
from palpate.press.setting import Place
from palpate.press.tip_controller import TipController
from palpate.robots.serial.chain import room_for
from palpate.robots.serial.inverse import pose_error
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.rotations import matrix_from_vector
from palpate.signals.types import Task


class PoseForce(NamedTuple):
    """Force along the normal that the sensor shows in free motion, by the place of the tip.

    Args:
        cable: that pulls the tip back, for each metre towards the surface [N/m].
        ripple: amplitude of a force that changes with the pose, zero at the start [N].
        wave: length over which it repeats [m].
    """

    cable: float = 0.0
    ripple: float = 0.0
    wave: float = 0.06

    def at(self, depth: float) -> float:
        """Force at a place along the normal, from the start [N]."""
        return self.cable * depth + self.ripple * float(np.sin(2.0 * np.pi * depth / self.wave))


NO_FREE_FORCE = PoseForce()
ENCODER = 1e-7
"""Resolution of a joint's position [rad, m]: a motor's encoder of 19 bits before a gear of 100."""


def body_at(q: Array, motor: Array) -> Body:
    """State of the body at rest."""
    n = len(q)
    zeros = [np.zeros(n) for _ in range(7)]
    return Body(q.copy(), zeros[0], motor.copy(), zeros[1], room_for(n), np.zeros((n, n)), *zeros[2:])


@dataclass(frozen=True)
class Truth:
    """True values of the last tick, known to the simulation only.

    Args:
        q: joint positions [rad, m], shape (n,).
        qd: their rates.
        force: on the surface, mean of the tick [N].
        depth: of the tip [m].
        touching: whether it touches.
        torque: on the links, shape (n,).
        saturated: 1 where a motor's limit held the torque back, shape (n,).
    """

    q: Array
    qd: Array
    force: float
    depth: float
    touching: bool
    torque: Array
    saturated: Array


class SimulatedArm:
    """A simulated arm: each command is a tick of the simulation.

    Args:
        arm: what moves.
        loop: its inner loop and its sensor.
        place: where it starts.
        cell: of the same.
        physics: own or mujoco, or an engine of its own.
        seed: of the noise.
        resolution: of a joint's position [rad, m]; 0 for exact encoders.
    """

    def __init__(
        self,
        arm: SerialArm,
        loop: Arm,
        place: Place,
        cell: Workcell,
        physics: str | Engine = "own",
        seed: int = 0,
        resolution: float = ENCODER,
    ):
        self.arm, self.loop, self.cell, self._resolution = arm, loop, cell, resolution
        self._generator = np.random.default_rng(seed)
        sag = np.zeros(arm.joints)
        if cell.elastic:  # springs stretched by the arm's weight, which its own control knows of
            sag = arm.gravity_torque(place.q) / cell.spring
        self._sag = sag
        self._body = body_at(place.q, place.q + sag)
        first = Reading(ZERO3, 0.0, 0.0, 0.0)
        self._touch = TouchState(
            UNTOUCHED, first, 0.0, 0.0, float(place.normal @ place.pose[:3, 3]) - place.place
        )
        by_name = ByMuJoCo(arm, cell, place.q) if physics == "mujoco" else Own()
        self._engine: Engine = by_name if isinstance(physics, str) else physics
        self._k, self.zero, self.slope = 0, 0.0, 0.0
        self._start = float(place.normal @ place.pose[:3, 3])
        self.free = NO_FREE_FORCE
        """Force that the sensor shows in free motion."""
        self._goal, self._setpoint = place.pose.copy(), place.q.copy()
        self._saturated, self._acted = np.zeros(arm.joints), False
        self._seen = self._before = self._encoders()
        self._tip = TipController(arm, loop, place) if isinstance(loop.inner, TorqueLoop) else None
        rest = place.q + sag if self._tip is None else arm.gravity_torque(place.q)
        self._line = deque([rest] * loop.delay_ticks)

    def read(self) -> TipSample:
        """The readings at this tick, without the sensor's zero and the slope of a free stroke."""
        position, normal = self.pose[:3, 3], np.array(self.cell.normal)
        depth = float(normal @ position) - self._start
        force = self._touch.reading.value - self.zero + self.free.at(depth) - self.slope * depth
        return TipSample(self._k * self.loop.tick, force * normal, position)

    @property
    def pose(self) -> Array:
        """Pose of the tip by the encoders, homogeneous, shape (4, 4)."""
        return self.arm.forward_kinematics(self._seen)

    def at_rest(self) -> Array:
        """Readings of the sensor in the second half of a rest in free motion, tick by tick [N], shape (n,).

        In the first half its low-pass settles.
        """
        readings = []
        for _ in range(round(TARE / self.loop.tick)):
            self.move(np.zeros(3))
            readings.append(self._touch.reading.value)
        return np.array(readings[len(readings) // 2 :], dtype=np.float64)

    def tare(self) -> None:
        """Rest in free motion, and take the mean reading of the second half as the sensor's zero."""
        self.zero = float(self.at_rest().mean())

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Moves the tip for a tick with a velocity [m/s], and a turning if there is one [rad/s], each of shape (3,)."""
        self._goal[:3, 3] += self.loop.tick * np.asarray(velocity)
        if turning is not None:
            self._goal[:3, :3] = matrix_from_vector(self.loop.tick * turning) @ self._goal[:3, :3]
        self._follow_goal()

    def hold_place(self) -> None:
        """Take the present pose as the goal of the next moves, after a controller of torques moved the arm."""
        if self._tip is not None and self._acted:
            self._goal = self.pose

    def _follow_goal(self) -> None:
        if self._tip is None:
            self._advance(self._follow() + self._sag)
        else:
            self._act(self._tip.spring, self._tip.towards(self._goal))

    def act(self, controller: Any, task: Task) -> None:
        """Moves for a tick under a controller of torques, in the task's axes.

        Raises:
            InputError: the arm takes positions.
        """
        if self._tip is None:
            raise InputError("a controller of torques needs --mode torque")
        self._acted = True
        self._act(controller, task)

    def change_surface(self, cell: Workcell) -> None:
        """Replace the surface by that of another cell, at a depth at which it carries the present force.

        For palpate's own physics; MuJoCo keeps the step of the cell that it began with.
        """
        touching, old = self._touch.surface, self.cell.surface
        if touching.contact == 1.0:
            force = float(old.force(touching, touching.deflection, touching.rate))
            depth = rest_for(cell.surface, force, touching.rate)
            cell = cell._replace(place=self.cell.place + touching.deflection - depth)
            self._touch = self._touch._replace(surface=touching._replace(deflection=depth))
        self.cell = cell

    @property
    def truth(self) -> Truth:
        """True values, known to the simulation only."""
        body, touch = self._body, self._touch
        return Truth(
            body.q.copy(),
            body.qd.copy(),
            touch.mean,
            touch.depth,
            touch.surface.contact == 1.0,
            body.drive.copy(),
            self._saturated.copy(),
        )

    def _follow(self) -> Array:
        """Set-points of the motors that follow the goal, by the smallest joint rates."""
        q, tick = self._setpoint, self.loop.tick
        J = self.arm.jacobian(q)
        error = pose_error(self.arm.forward_kinematics(q), self._goal)
        step = J.T @ np.linalg.solve(J @ J.T, error)
        self._setpoint = q + np.clip(step, -tick * self.arm.speed, tick * self.arm.speed)
        return self._setpoint

    def _act(self, controller: Any, task: Task) -> None:
        assert self._tip is not None
        qd = (self._seen - self._before) / self.loop.tick
        torque = self._tip.torque(controller, task, self._seen, qd, self._touch.reading.value - self.zero)
        limited = np.clip(torque, -self.arm.torque, self.arm.torque)
        self._saturated = (np.abs(torque) > self.arm.torque).astype(float)
        self._advance(limited)

    def _advance(self, setpoint: Array) -> None:
        self._line.append(setpoint)
        noise = self._generator.standard_normal(8)
        now = np.ascontiguousarray(self._line.popleft())
        self._touch = self._engine.tick(self.cell, self._body, self._touch, now, self._k, noise)
        self._k += 1
        self._before, self._seen = self._seen, self._encoders()

    def _encoders(self) -> Array:
        before = self.cell.elastic > self.cell.yields  # the springs
        turned = self._body.motor - self._sag if before else self._body.q
        if self._resolution == 0.0:
            return turned.copy()
        return np.asarray(self._resolution * np.round(turned / self._resolution))
