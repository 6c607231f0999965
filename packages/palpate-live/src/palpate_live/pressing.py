"""An arm of `palpate.robots` that presses in space, a few ticks at a time, with numbers that change while it runs."""

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec.structs import replace

from palpate.arrays import Array
from palpate.bench.summary import CONTACT, DIVERGED, LOST
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.force.gains import Gains
from palpate.identifiers import ContactIdentifier
from palpate.press.engines import series_of
from palpate.press.prepare import Question, prepare_press
from palpate.press.pressing import JOINT_LIMIT
from palpate.press.sequence import CautiousDriver, PressSequence
from palpate.press.setting import Place, cell_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.robots.serial.serial_arm import SerialArm as Serial
from palpate.signals.types import NORMAL
from palpate.text import printable
from palpate_live.stability import OfArm
from palpate_live.view import (
    AT,
    COLUMNS,
    JOINTS,
    LONGEST,
    OVER,
    STRIDE,
    Happened,
    Slider,
    SourceState,
    View,
    ViewScene,
    check_ahead,
)

FORCE, STIFFNESS, DAMPING = 20.0, 5000.0, 50.0
"""Where the sliders stand at first [N, N/m, N s/m]."""
_PATCH = 0.12
"""Half the side of the surface that is drawn [m]."""
_LOOKS = 20.0
"""Of the estimator, a second of simulated time."""


class WatchedArm:
    """A serial arm that somebody watches: its view, its sliders and its time.

    Args:
        arm: what moves.
        place: where it starts.
        gains: of its force loop.
        sliders: of the page.
        about: the law, in words.
        seed: of the noise.
        more: of the view.

    Raises:
        InputError: an arm of more joints than are drawn.
    """

    # More than seven arguments: of an arm, and of its page.
    def __init__(
        self,
        arm: Serial,
        place: Place,
        gains: Gains,
        sliders: tuple[Slider, ...],
        about: str,
        seed: int,
        **more: Any,
    ):
        if arm.joints > JOINTS:
            raise InputError(f"{arm.title} has {arm.joints} joints; at most {JOINTS} are drawn")
        self._arm, self._place, self._gains = arm, place, gains
        self._stride, self._k = max(1, round(STRIDE * gains.arm.rate)), 0
        self.state = SourceState(values={slider.key: slider.value for slider in sliders}, seed=seed)
        self.view = View(
            title=printable(arm.title), about=printable(f"{gains.arm.title}; {about}"), kind="simulation",
            rate=float(gains.arm.rate), stride=self._stride * gains.arm.tick, sliders=sliders,
            rest=tuple(float(v) for v in place.q), scene=scene_of(arm, place), **more,
        )  # fmt: skip

    def bones(self, row: Array) -> Array:
        """Places of the arm's joints and its tip at a row [m], shape (n + 2, 3)."""
        return self._arm.joint_places(row[AT["q1"] : AT["q1"] + self._arm.joints])

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come: one a stride."""
        raise NotImplementedError

    def seek(self, time: float) -> None:
        """Runs on to a moment, as fast as it goes.

        Raises:
            InputError: it lies behind, or beyond a run's longest.
        """
        tick = self._gains.arm.tick
        check_ahead(self._k * tick, time)
        while self._k * tick < time - self.view.stride and not self.state.ended:
            self.advance(min(1.0, time - self._k * tick))


class PressingArm(WatchedArm):
    """A serial arm that presses with the cautious law as long as somebody watches.

    Args:
        name: of the arm, or the path of its file, as `palpate press --arm` takes it.
        seed: of the noise.
        waiting: called before what has to be compiled first.

    Raises:
        InputError: no such arm, or one of more joints than are drawn.
    """

    def __init__(self, name: str, seed: int = 0, waiting: Callable[[], None] | None = None):
        if seed < 0:
            raise InputError(f"the seed must be 0 or above, got {seed}")
        asked = prepare_press(
            Question(arm=name, force=FORCE, surface=KelvinVoigt(STIFFNESS, DAMPING, 0.0), probe=0.0)
        ).asked
        sliders, notes = _sliders(asked.gains), tuple(printable(note) for note in asked.notes)
        about = "the cautious law of palpate tune, own physics"
        super().__init__(asked.arm, asked.place, asked.gains, sliders, about, seed, notes=notes)
        if waiting is not None:
            waiting()
        self._series = series_of(asked.gains.arm)
        self.reset()

    @property
    def loop_asked(self) -> OfArm:
        """The loop as it now is, for `palpate_live.stability`."""
        values = self.state.values
        return OfArm(self._gains, values["surface.stiffness"], values["surface.damping"])

    def reset(self, seed: int | None = None) -> None:
        """To the beginning, the sliders where they stand."""
        self.state.begin(seed)
        loop, cell = self._gains.arm, cell_of(self._arm, self._place, self._surface, self._gains.arm)
        self._simulated = SimulatedArm(self._arm, loop, self._place, cell, "own", self.state.seed or 0)
        self._k, self._phase, self._high = 0, 0.0, True
        self._take_gains()
        self._forget()

    def _take_gains(self) -> None:
        """A new loop with the gains as they now are, and a new sequence with it."""
        self._loop = ForceLoop(self._gains)
        driver = CautiousDriver(self._simulated, self._loop, self._place.normal)
        desired, tick = (lambda _: self.state.values["force"]), self._gains.arm.tick
        self._sequence = PressSequence(self._simulated, driver, desired, tick)

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come: one a stride."""
        until = (self._k * self._gains.arm.tick + seconds) * self._gains.arm.rate + 1e-6
        rows: list[Array] = []
        while not self.state.ended and self._k + self._stride <= until:
            readings = [self._tick() for _ in range(self._stride)]
            row = self._row(max(readings) if self._high else min(readings))
            self._high = not self._high
            self._judge(row)
            if np.isfinite(row[: AT["depth"] + 1]).all():
                rows.append(row)
        return np.array(rows).reshape(-1, len(COLUMNS))

    def set(self, key: str, value: float) -> None:
        """Moves a slider; a surface that is pressed gets the rest length that leaves the force as it is.

        Raises:
            InputError: none of that key, or a value out of range.
        """
        self.view.check(key, value)
        if value == self.state.values[key]:
            return
        self.state.values[key] = value
        if key == "force":
            self._loop.desired = value
        elif key == "gain":
            self._gains = replace(self._gains, alpha=value)
            before = self._loop.state
            self._take_gains()
            self._loop.state = before
            self._loop.desired = self.state.values["force"]
        else:
            cell = cell_of(self._arm, self._place, self._surface, self._gains.arm)
            self._simulated.change_surface(cell)
            self._forget()

    @property
    def _surface(self) -> KelvinVoigt:
        values = self.state.values
        return KelvinVoigt(values["surface.stiffness"], values["surface.damping"], 0.0)

    def _forget(self) -> None:
        """The estimate begins again."""
        loop = self._gains.arm
        low_pass = loop.low_pass
        self._identifier = ContactIdentifier(
            low_pass,
            loop.rate,
            low_pass.lag,
            lag_std=loop.tick / np.sqrt(12.0),
            sampling=min(loop.sensor.sampling, loop.rate),
        )
        self._known = np.full(4, np.nan)

    def _tick(self) -> float:
        """One tick; the force reading before it [N]."""
        tick, normal = self._sequence.tick(), self._place.normal
        reading = float(tick.sample.force @ normal)
        self._identifier.update(float(normal @ tick.sample.position), reading)
        self._note(tick.action.phase)
        self._k += 1
        if self._k % round(self._gains.arm.rate / _LOOKS) == 0:
            self._known = self._estimate()
        return reading

    def _estimate(self) -> Array:
        """K, its half-width, B and its own, of the surface; NaN where they are wider than they are large."""
        found = self._identifier.estimate()
        if found.rejected:
            return np.full(4, np.nan)
        half = NORMAL * np.sqrt(np.diag(found.covariance))
        K, B = float(found.theta[2]), float(found.theta[1])
        # Encoders before a spring see the surface through it: k = K/(1 + K/s), and b = B (k/K)^2 while B w << s.
        own = 1.0 if self._series is None else 1.0 / (1.0 - K / self._series)
        told = np.array([K * own, half[2] * own**2, B * own**2, half[1] * own**2])
        for at in (0, 2):
            if not told[at + 1] < abs(told[at]):
                told[at : at + 2] = np.nan
        return told

    def _row(self, measured: float) -> Array:
        truth, values = self._simulated.truth, self.state.values
        row = np.full(len(COLUMNS), np.nan)
        pressing = self._phase == CONTACT
        known: dict[str, float] = {
            "t": (self._k - 1) * self._gains.arm.tick,  # as a record has it: of the tick, and what came of it
            "measured": measured,
            "force": truth.force,
            "desired": values["force"] if pressing else 0.0,
            "depth": 1e3 * truth.depth,
            "K_true": values["surface.stiffness"],
            "B_true": values["surface.damping"],
            "wall": self._simulated.cell.place,
            "phase": self._phase,
        }
        row[[AT[name] for name in known]] = list(known.values())
        row[AT["q1"] : AT["q1"] + self._arm.joints] = truth.q
        row[[AT["K"], AT["K_half"], AT["B"], AT["B_half"]]] = self._known
        self.state.warning = self._warning(truth.saturated)
        return row

    def _warning(self, saturated: Array) -> str:
        if saturated.any():
            joints = " and ".join(self._arm.names[i] for i in np.flatnonzero(saturated))
            return f"{printable(joints)} is at its torque limit; the desired force is out of reach."
        return self._loop.trouble

    def _note(self, phase: float) -> None:
        now = self._k * self._gains.arm.tick
        if phase != self._phase and phase == CONTACT:
            self.state.note(Happened(now, "touch"))
        elif phase != self._phase and phase == LOST:
            self.state.note(Happened(now, "contact lost", "fail"))
        self._phase = phase

    def _judge(self, row: Array) -> None:
        """Why it goes no further, if it does not."""
        q, now = row[AT["q1"] : AT["q1"] + self._arm.joints], row[AT["t"]]
        if not np.isfinite(row[[AT["force"], AT["depth"]]]).all() or not np.isfinite(q).all():
            self.state.ended = f"{DIVERGED}: the arm's motion is not finite"
            return
        beyond = np.flatnonzero((q < self._arm.lower) | (q > self._arm.upper))
        if len(beyond):
            self.state.ended = (
                f"{JOINT_LIMIT}: {printable(self._arm.names[beyond[0]])} reached the end of its range"
            )
        elif now >= LONGEST:
            self.state.ended = OVER


def _sliders(gains: Gains) -> tuple[Slider, ...]:
    """Sliders of a press."""
    least = max(1.0, 10.0 * gains.arm.sensor.noise)
    return (
        Slider("force", "desired force", "N", least, min(40.0, 0.8 * gains.force_limit), FORCE),
        Slider("gain", "force gain", "", 0.1 * gains.alpha, 1.0, gains.alpha, True),
        Slider("surface.stiffness", "surface K", "N/m", STIFFNESS / 20, 20 * STIFFNESS, STIFFNESS, True, "K"),
        Slider("surface.damping", "surface B", "N s/m", DAMPING / 20, 20 * DAMPING, DAMPING, True, "B"),
    )


def scene_of(arm: Serial, place: Place) -> ViewScene:
    """The arm's joints and the surface around the tip, as the page draws them."""
    chain = arm.chain
    centre = place.pose[:3, 3] + (place.place - place.normal @ place.pose[:3, 3]) * place.normal
    u, v = _PATCH * place.axes[1], _PATCH * place.axes[2]
    return ViewScene(
        at=_tuples(chain.at),
        turn=tuple(_tuples(one) for one in chain.turn),
        slide=tuple(bool(one) for one in chain.slide),
        tip=tuple(map(float, chain.tip)),
        normal=tuple(map(float, place.normal)),
        patch=_tuples(np.array([centre + u + v, centre + u - v, centre - u - v, centre - u + v])),
    )


def _tuples(rows: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in rows)
