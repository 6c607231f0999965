"""Simulated slides: that of a tip without joints, a run from approach to retreat, and how it is judged."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import BoundKernel
from palpate._vector import ZERO3
from palpate.arrays import Array
from palpate.bench.summary import PHASES, RETREAT
from palpate.force.gains import Gains
from palpate.force.simulated_press import world_of
from palpate.force.sliding.slide_state import SIZE, Sliding
from palpate.force.sliding.sliding_loop import CHI2_95, DOWN, Z_95, sliding
from palpate.force.sliding.tangent_filter import STATES
from palpate.press.sequence import MovableArm, TipSample
from palpate.press.unload import SimulatedRetreat, Unloading, simulated_retreat, unload
from palpate.signals.types import triple
from palpate.slide.ground import Ground
from palpate.slide.tip_laws import (
    ContactState,
    Course,
    OwnLaw,
    TipState,
    compiled_row,
    compiled_run,
    compiled_tip_tick,
)

COLUMNS = (
    "normal_force", "x", "y", "z", "nx", "ny", "nz", "normal_error", "cone", "mu", "mu_std", "stiffness",
    "stiffness_std", "sliding", "trouble", "speed", "fx", "fy", "fz", "mu_true", "desired", "tool", "ax", "ay", "az",
)  # fmt: skip
"""Columns of a run: N [N], tip [m], estimated normal, its error and one standard deviation [rad], mu, K [N/m], phase,
trouble, speed commanded along the surface [m/s], reading [N], friction as it acts, desired force [N], and of an arm
with joints the angle between the tool's axis and the true normal [rad], and that axis; NaN of a point."""
GAP = 3e-3
"""Distance between tip and surface at the start [m]."""
LONGEST = 30.0
"""Time in which the surface is to be found and the force held [s]."""
SPARE = 6
"""Numbers reserved behind the law's state, for other laws that are compared with it."""
TICKS_AT_A_TIME = 500
"""Ticks between two looks at the progress: a fraction of a second, however the arm is simulated."""
_COLUMN = {name: i for i, name in enumerate(COLUMNS)}
SETTLED = 0.5
"""Time after which a slide is judged [s]."""


class PointSlide:
    """A slide of a point with an arm's lags in each axis, tick by tick, in the surface's axes.

    Args:
        gains: with a table `slide`.
        ground: the surface; the tip comes down on its origin.
        ways: directions of the slide, tick by tick, shape (m, 3).
        into: direction in which the law looks for the surface, shape (3,).
        seed: of the noise.
        control: makes what moves the tip out of the law's numbers.
        dither: share of the desired force by which it changes in a slide, and the frequency [Hz].
    """

    def __init__(
        self,
        gains: Gains,
        ground: Ground,
        ways: Array,
        *,
        into: ArrayLike = DOWN,
        seed: int = 0,
        control: Callable[[Sliding], Any] = OwnLaw,
        dither: tuple[float, float] = (0.0, 0.0),
    ):
        law = sliding(gains, into)
        arm = gains.arm
        self.gains, self.into, self._ground = gains, np.array(law.into), ground
        self._world, self._control = world_of(arm, noise=arm.sensor.noise), control(law)
        self._law_state = np.zeros(SIZE + SPARE)
        law.start(self._law_state)
        self.longest = len(ways) + round(LONGEST * arm.rate)
        self._generator = np.random.default_rng(seed)
        noise = self._generator.standard_normal((self.longest, 3))
        self._course = Course(ways, float(gains.force), dither, noise, np.zeros(STATES))
        start = (GAP if law.into.z > 0.0 else -GAP) * law.into  # outside, however wrong it is
        self.start = np.array(start)
        tip = ContactState(start, ZERO3, ZERO3, 0.0, 0.0, ZERO3, 0.0, 0.0)
        self._state = TipState(
            tip, ZERO3, ZERO3, ZERO3, self._world.noise * triple(noise[0]), 0.0, start, 0.0
        )
        torque = self._world.torque * (1.0 - self._world.yields)
        self._line = np.tile((1.0 - torque) * self.start, (self._world.delay + 1, 1))
        self._k, self._tick = 0, BoundKernel(compiled_tip_tick)

    def run(self, at_a_time: int) -> Iterator[Array]:
        """Rows of `COLUMNS` from free motion on, so many at a time and fewer at the end, shape (n, 25)."""
        ticks = 0
        while self._k < self.longest:
            out = np.full((min(at_a_time, self.longest - self._k), len(COLUMNS)), np.nan)
            self._state, ticks, count = compiled_run(
                self._world, self._ground, self._control, self._law_state, self._course, self._state, ticks,
                self._line, self._k, out,
            )  # fmt: skip
            self._k += count
            yield out[:count]
            if count < len(out):
                return

    def read(self) -> TipSample:
        """The readings at this tick."""
        step = self._world.step
        at = step * np.round(np.array(self._state.tip.x) / step)
        return TipSample(self._k * self.gains.arm.tick, np.array(self._state.reading), at)

    def move(self, velocity: Array, turning: Array | None = None) -> None:
        """Move the tip for a tick with a velocity [m/s], shape (3,); a point does not turn."""
        noise = triple(self._generator.standard_normal(3))
        self._state = self._tick(
            self._world, self._ground, self._state, triple(velocity), self._line, self._k, noise
        )
        self._k += 1

    def row(self, velocity: Array) -> Array:
        """Row of `COLUMNS` of a tick that the law did not move, shape (25,)."""
        row = np.full(len(COLUMNS), np.nan)
        state = self._state
        compiled_row(
            self._ground, self._law_state, state.tip, triple(velocity), state.reading, state.mean, row
        )
        return row


def simulate(gains: Gains, ground: Ground, ways: Array, **others: Any) -> Array:
    """A slide from free motion on: rows of `COLUMNS`, shape (n, 25); arguments are those of `PointSlide`."""
    slide = PointSlide(gains, ground, ways, **others)
    return next(slide.run(slide.longest))


class SimulatedSlide(MovableArm, Protocol):
    """A simulated tip that slides, in the surface's axes."""

    gains: Gains
    into: Array  # direction in which the law looks for the surface, shape (3,)
    start: Array  # place of the tip before the slide [m], shape (3,)

    def run(self, at_a_time: int) -> Iterator[Array]:
        """Rows of `world.COLUMNS` from free motion on, so many at a time, shape (n, 25)."""
        ...

    def row(self, velocity: Array) -> Array:
        """Row of `world.COLUMNS` after a tick with a velocity [m/s] that the law did not ask for, shape (25,)."""
        ...


class SlideRun(NamedTuple):
    """Rows of a slide and of its retreat, each as of `world.COLUMNS`."""

    rows: Array  # of the slide, shape (n, 25)
    retreat: Array  # shape (m, 25)
    unloading: Unloading
    interrupted: bool  # by the user

    @property
    def phases(self) -> Array:
        """Phase of each row, as of `bench.summary`, shape (n + m,)."""
        return np.append(self.rows[:, _COLUMN["sliding"]], np.full(len(self.retreat), RETREAT))


def run_slide(slide: SimulatedSlide, progress: Callable[[float, str], None] | None = None) -> SlideRun:
    """Slide along the path, and retreat from the surface, whatever ended the slide.

    Args:
        slide: at its start.
        progress: called now and then with the time [s] and the phase; may raise KeyboardInterrupt to end the slide.

    Raises:
        InputError: a joint reached the end of its range.
        KeyboardInterrupt: of `progress`, before there is a row.
    """
    parts: list[Array] = []
    interrupted = False
    try:
        for part in slide.run(TICKS_AT_A_TIME):
            parts.append(part)
            if progress is not None and len(part):
                time = sum(map(len, parts)) * slide.gains.arm.tick
                progress(time, PHASES[float(part[-1, _COLUMN["sliding"]])])
    except KeyboardInterrupt:
        if not parts:
            raise
        interrupted = True
    rows = np.concatenate(parts)
    return SlideRun(rows, *_unload(slide, rows), interrupted)


def _unload(slide: SimulatedSlide, rows: Array) -> tuple[Array, Unloading]:
    """Retreat along the estimated normal: rows, and how it went."""
    retreat_rows: list[Array] = []
    if not np.isfinite(rows[-1, : _COLUMN["normal_error"]]).all():
        diverged = Unloading("could not unload: the simulated arm has diverged", completed=False)
        return np.empty((0, len(COLUMNS))), diverged

    def keep_row(_: TipSample, velocity: Array) -> bool:
        row = slide.row(velocity)
        row[[_COLUMN[name] for name in ("sliding", "desired", "trouble")]] = 0.0
        retreat_rows.append(row)
        return bool(np.isfinite(row[: _COLUMN["normal_error"]]).all())

    normal = rows[-1, _COLUMN["nx"] : _COLUMN["nz"] + 1]
    displacements = rows[:, _COLUMN["x"] : _COLUMN["z"] + 1] - slide.start
    plan = simulated_retreat(
        slide.gains, normal, float((displacements @ slide.into).max()), slide.gains.force
    )
    unloading = unload(SimulatedRetreat(slide, plan, slide.start, keep_row), plan)
    return np.array(retreat_rows).reshape(-1, len(COLUMNS)), unloading


@dataclass(frozen=True)
class SlideFigures:
    """Errors and coverage of a slide, judged after `SETTLED`."""

    touched: bool  # the force was held, and the tip slid
    rms: float  # of the force error, fraction of F_d
    most: float  # largest error, share of F_d
    worst: float  # largest normal force of the whole run in F_d
    lost: bool  # the true force was 0
    normal: float  # median error [rad]
    cone: float  # share of the time in which the 95 % cone holds the normal
    friction: float  # the same of mu
    stiffness: float  # the same of K
    said: bool  # a trouble was shown

    @property
    def obeys(self) -> bool:
        """Within 3 % rms and 10 %, contact kept."""
        return self.touched and self.rms <= 0.03 and self.most <= 0.1 and not self.lost


def figures_of(out: Array, gains: Gains, ground: Ground) -> SlideFigures:
    """Errors and coverage of a slide, from its rows (n, 25)."""
    on = np.flatnonzero(out[:, COLUMNS.index("sliding")])
    judged = on[round(SETTLED * gains.arm.rate) :]
    c = dict(zip(COLUMNS, out[judged].T, strict=True))
    if not len(judged):
        nan = float("nan")
        return SlideFigures(False, nan, nan, nan, True, nan, 0.0, 0.0, 0.0, False)
    error = (c["normal_force"] - c["desired"]) / gains.force
    dither = c["desired"] / gains.force - 1.0
    if dither.any():  # it is followed late: what it is of the error itself, and its rate, is none
        both = np.column_stack([dither, np.gradient(dither)])
        error = error - both @ np.linalg.lstsq(both, error, rcond=None)[0]
    true = gains.arm.seen(ground.stiffness) if gains.arm.kind == "position" else ground.stiffness
    return SlideFigures(
        True, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()),
        float(out[:, 0].max() / gains.force), bool((out[on, 0] <= 0.0).any()),
        float(np.median(c["normal_error"])),
        float(np.mean(c["normal_error"] < CHI2_95 * c["cone"])),
        float(np.mean(np.abs(c["mu"] - ground.friction) < Z_95 * c["mu_std"])),
        float(np.mean(np.abs(c["stiffness"] - true) < Z_95 * c["stiffness_std"])),
        bool(c["trouble"].any()),
    )  # fmt: skip
