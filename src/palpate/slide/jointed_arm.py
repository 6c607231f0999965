"""A slide of a serial arm in simulation.

Beside the simulation of a point with the same lags in each axis, this one has the joints' inertia, their drive trains,
a tip that tilts, resolved rates, and a tool that may turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array
from palpate.environments.models import KelvinVoigt
from palpate.errors import InputError
from palpate.force.arm import Arm
from palpate.force.gains import Gains
from palpate.force.sliding.slide_state import VELOCITY, vector_at
from palpate.force.sliding.sliding_loop import DOWN, SlidingLoop
from palpate.force.sliding.turning_tool import TurningTool
from palpate.press.engines import check_mode, loop_of, usual_mode
from palpate.press.sequence import PressSequence, SlidingDriver, TipSample
from palpate.press.setting import Place, cell_of, place_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.robots.serial.from_toml import names
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import triple
from palpate.slide.ground import Ground, outside
from palpate.slide.sliding_engine import Frame, SlidingEngine
from palpate.slide.tip_laws import compiled_row
from palpate.slide.world import COLUMNS, LONGEST


class HeldTip(NamedTuple):
    """A tool that is kept perpendicular, with a spherical tip and the weight of a payload.

    The surface is that of the sphere's centre, parallel to the touched one.

    Args:
        back: from the tool's point back to that centre, along the tool's axis [m].
        weight: reading of the payload alone, in the base's axes [N].
    """

    back: float = 0.0
    weight: Vec3 = ZERO3


@dataclass(frozen=True)
class JointedArm:
    """A serial arm before the first point of a surface.

    Args:
        arm: what moves.
        place: where it starts.
        inner: its inner loop and sensor.
    """

    arm: SerialArm
    place: Place
    inner: Arm

    # More than seven arguments: as of `world.PointSlide`.
    def prepare(
        self, gains: Gains, ground: Ground, ways: Array, *, into: ArrayLike = DOWN, seed: int = 0,
        physics: str = "mujoco", tool: HeldTip | None = None,
    ) -> JointedSlide:  # fmt: skip
        """A slide along a path.

        Args:
            gains: with a table `slide`.
            ground: the surface.
            ways: directions of the slide, tick by tick, shape (m, 3).
            into: direction in which the law looks for the surface, shape (3,).
            seed: of the noise.
            physics: own or mujoco.
            tool: with a spherical tip; None for a point.

        Raises:
            InputError: gains of another kind of arm.
        """
        rate = gains.arm.rate
        slide = JointedSlide(
            self, gains, ground, lambda since: ways[round(since * rate)], into, seed, physics, tool
        )
        slide.path_ticks = len(ways)
        return slide

    def slide(self, gains: Gains, ground: Ground, ways: Array, **others: Any) -> Array:
        """A slide from free motion on: rows of `world.COLUMNS`, shape (n, 25); arguments are those of `prepare`.

        Raises:
            InputError: a joint reached the end of its range; gains of another kind of arm.
        """
        slide = self.prepare(gains, ground, ways, **others)
        return next(slide.run(slide.longest))


class JointedSlide:
    """A slide that goes on tick by tick, and the arm of its sequence, in the surface's axes.

    Args:
        at: the arm before the surface.
        direction: in the surface's axes, at a time since the slide began [s].
        gains, ground, into, seed, physics, tool: as of `JointedArm.prepare`.

    Raises:
        InputError: gains of another kind of arm.
    """

    # More than seven arguments: those of a slide, and the path.
    def __init__(
        self, at: JointedArm, gains: Gains, ground: Ground, direction: Callable[[float], ArrayLike],
        into: ArrayLike = DOWN, seed: int = 0, physics: str = "mujoco", tool: HeldTip | None = None,
    ):  # fmt: skip
        if gains.arm.kind != "servo":  # which takes the place of any arm's own loop
            check_mode(gains, at.inner.kind)
        tip = tool or HeldTip()
        place = at.place
        n = at.place.normal
        self.gains, self.path_ticks = gains, 0
        self.loop, self._axes = SlidingLoop(gains, into), np.array([place.axes[2], place.axes[1], -n])
        self._origin = place.point - tip.back * n
        frame = Frame(Mat3(*map(triple, self._axes)), triple(self._origin))
        cell = cell_of(at.arm, place, KelvinVoigt(ground.stiffness, ground.damping, 0.0), gains.arm)
        self.engine = SlidingEngine(at.arm, cell, place.q, ground, gains.arm, frame, seed, physics, tip.back)
        self.tip = SimulatedArm(at.arm, gains.arm, place, cell, self.engine)
        tared = self._axes @ place.pose[:3, :3]
        weight = self._axes @ np.array(tip.weight)
        turning = TurningTool(self.loop, centre=(0.0, 0.0, -tip.back), weight=weight, tared=tared)
        driver = SlidingDriver(self, self.loop, direction, tool=turning if tool else None)
        self._weight, self._unturned = weight, tared.T @ weight
        self.sequence = PressSequence(self, driver, lambda _: self.loop.desired, gains.arm.tick)
        self.into, self.start = np.array(self.loop.law.into), self.read().position

    @property
    def longest(self) -> int:
        """Largest number of ticks of a slide along a path: those of the path, and until the force is held."""
        return self.path_ticks + round(LONGEST * self.gains.arm.rate)

    def run(self, at_a_time: int) -> Iterator[Array]:
        """Rows of `world.COLUMNS` to the end of the path, so many at a time and fewer at the end, shape (n, 25).

        Raises:
            InputError: a joint reached the end of its range.
        """
        remaining, on = self.longest, True
        while remaining and on:
            rows = np.zeros((min(at_a_time, remaining), len(COLUMNS)))
            count = 0
            while count < len(rows) and (on := self._is_on_path()):
                self.tick(rows[count])
                count += 1
            remaining -= count
            yield rows[:count]

    def _is_on_path(self) -> bool:
        return round(self.sequence.next_since * self.gains.arm.rate) < self.path_ticks

    def read(self) -> TipSample:
        """The readings at this tick."""
        pose = self._axes @ self.tip.pose[:3]
        R = pose[:, :3]
        at = pose[:, 3] - self._axes @ self._origin
        reading = self.engine.reading + self._weight - R @ self._unturned
        return TipSample(self.tip.read().time, reading, at, rotation=R)

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Moves the tool's point for a tick with a velocity [m/s] and a turning [rad/s], each of shape (3,)."""
        self.tip.move(velocity @ self._axes, None if turning is None else turning @ self._axes)

    def tick(self, row: Array) -> None:
        """A tick; fills a row of `world.COLUMNS`.

        Raises:
            InputError: a joint reached the end of its range.
        """
        sample, desired, _ = self.sequence.tick()
        loop = self.loop
        arm = self.tip.arm
        q = self.tip.truth.q
        beyond = np.flatnonzero(~((q >= arm.lower) & (q <= arm.upper)))
        if len(beyond):
            at = f"reached the end of its range at {sample.time:.3f} s"
            raise InputError(f"{arm.names[beyond[0]]} {at}; make --length smaller")
        self._fill(row, sample.force, vector_at(loop.state, VELOCITY))
        row[20] = desired
        row[13] = (1.0 if loop.sliding else 2.0) * (self.sequence.touch is not None)

    def row(self, velocity: Array) -> Array:
        """Row of `world.COLUMNS` after a tick with a velocity [m/s] that the law did not ask for, shape (25,)."""
        row = np.zeros(len(COLUMNS))
        self._fill(row, self.read().force, triple(velocity))
        return row

    def _fill(self, row: Array, reading: Array, velocity: Vec3) -> None:
        """Fill the columns of surface, tip and tool."""
        ground = self.engine.ground
        after = self.engine.slid
        compiled_row(ground, self.loop.state, after.tip, velocity, triple(reading), float(after.mean), row)
        axis = self._axes @ self.tip.arm.forward_kinematics(self.tip.truth.q)[:3, 2]
        up = np.array(outside(ground, after.tip.x)[1])
        row[21], row[22:] = np.arccos(np.clip(-axis @ up, -1.0, 1.0)), axis


def jointed_arm(name: str) -> JointedArm:
    """An arm by its name, at home above a surface that its tool's axis meets squarely.

    Raises:
        InputError: an arm whose joints are not known, or no MuJoCo.
    """
    if name not in names():
        raise InputError(
            f"--turn and --physics mujoco need an arm whose joints are known ({', '.join(names())}), got {name}"
        )
    arm = SerialArm.named(name)
    place = place_of(arm, None, None)
    return JointedArm(arm, place, loop_of(name, arm.title, usual_mode(name), place.mass))
