"""A serial arm that presses with the cautious law in the browser; its surface, force and gain may be changed."""

from collections.abc import Callable

import numpy as np
from msgspec.structs import replace

from palpate.arrays import Array
from palpate.bench.summary import CONTACT, DIVERGED, LOST
from palpate.environments.models import KelvinVoigt
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.force.gains import Gains
from palpate.identifiers import ContactIdentifier
from palpate.live.view import (
    AT,
    COLUMNS,
    LONGEST,
    MAX_JOINTS,
    OVER,
    STRIDE,
    Event,
    LiveSource,
    Scene,
    Slider,
    View,
)
from palpate.press.engines import series_of
from palpate.press.prepare import PressSpec, prepare_press
from palpate.press.pressing import JOINT_LIMIT
from palpate.press.sequence import CautiousDriver, PressSequence
from palpate.press.setting import Place, cell_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import NORMAL
from palpate.text import printable

FORCE, STIFFNESS, DAMPING = 20.0, 5000.0, 50.0
"""Initial values of the sliders [N, N/m, N s/m]."""
_PATCH = 0.12
"""Half the side of the drawn surface [m]."""
_ESTIMATES_PER_SECOND = 20.0
"""Rate at which the identifier's estimate is read, in simulated time [Hz]."""


class PressingArm(LiveSource):
    """A serial arm that presses as long as somebody watches.

    Args:
        name: of the arm, or the path of its file, as for `palpate press --arm`.
        seed: of the noise.
        before_compiling: called before kernels are compiled.

    Raises:
        InputError: an unknown arm, an arm of more joints than are drawn, or a seed below 0.
    """

    def __init__(self, name: str, seed: int = 0, before_compiling: Callable[[], None] | None = None):
        surface = KelvinVoigt(STIFFNESS, DAMPING, 0.0)
        prepared = prepare_press(PressSpec(arm=name, force=FORCE, surface=surface, probe=0.0)).request
        gains = prepared.gains
        notes = tuple(printable(note) for note in prepared.notes)
        arm, place = prepared.arm, prepared.place
        if arm.joints > MAX_JOINTS:
            raise InputError(f"{arm.title} has {arm.joints} joints; at most {MAX_JOINTS} are drawn")
        self._arm, self._place, self._gains = arm, place, gains
        self._ticks_per_row = max(1, round(STRIDE * gains.arm.rate))
        about = printable(f"{gains.arm.title}; the cautious law of palpate tune, own physics")
        view = View(
            title=printable(arm.title), about=about, rate=float(gains.arm.rate),
            stride=self._ticks_per_row * gains.arm.tick, sliders=_sliders(gains), rest=tuple(map(float, place.q)),
            scene=scene_of(arm, place), notes=notes,
        )  # fmt: skip
        super().__init__(view, seed)
        if before_compiling is not None:
            before_compiling()
        self._series = series_of(gains.arm)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Return to the beginning; the sliders stay."""
        self.state.restart(seed)
        self._count, self._due, self._show_highest = 0, 0.0, True
        loop, cell = self._gains.arm, cell_of(self._arm, self._place, self._surface, self._gains.arm)
        self._simulated = SimulatedArm(self._arm, loop, self._place, cell, "own", self.state.seed)
        self._phase = 0.0
        self._make_loop()
        self._restart_estimate()

    def _make_loop(self) -> None:
        """Make a loop with the present gains, and its press."""
        self._loop = ForceLoop(self._gains)
        driver = CautiousDriver(self._simulated, self._loop, self._place.normal)
        self._sequence = PressSequence(
            self._simulated, driver, lambda _: self.state.values["force"], self._gains.arm.tick
        )

    def _apply(self, key: str) -> None:
        """Use a slider's new value; a surface in contact gets the rest length that keeps the force."""
        values = self.state.values
        if key == "force":
            self._loop.desired = values["force"]
        elif key == "gain":
            self._gains = replace(self._gains, alpha=values["gain"])
            before = self._loop.state
            self._make_loop()
            self._loop.state = before
            self._loop.desired = values["force"]
        else:
            cell = cell_of(self._arm, self._place, self._surface, self._gains.arm)
            self._simulated.change_surface(cell)
            self._restart_estimate()

    @property
    def _surface(self) -> KelvinVoigt:
        values = self.state.values
        return KelvinVoigt(values["surface.stiffness"], values["surface.damping"], 0.0)

    def _restart_estimate(self) -> None:
        loop = self._gains.arm
        self._identifier = ContactIdentifier(
            loop.low_pass,
            loop.rate,
            loop.low_pass.lag,
            lag_std=loop.tick / np.sqrt(12.0),
            sampling=min(loop.sensor.sampling, loop.rate),
        )
        self._estimate: dict[str, float] = {}

    @property
    def _now(self) -> float:
        """Time of the simulation since its start [s]."""
        return self._count * self._gains.arm.tick

    def advance(self, seconds: float) -> Array:
        """Rows of the next seconds; the measured force is by turns the highest and the lowest since the last row."""
        self._due += seconds
        last_tick = self._due * self._gains.arm.rate + 1e-6
        rows: list[Array] = []
        while not self.state.ended and self._count + self._ticks_per_row <= last_tick:
            readings: list[float] = []
            while len(readings) < self._ticks_per_row and not self.state.ended:
                readings.append(self._tick())
                self._count += 1
            row = self._row(max(readings) if self._show_highest else min(readings))
            self._show_highest = not self._show_highest
            if self._now >= LONGEST:
                self.state.ended = self.state.ended or OVER
            if np.isfinite(row[: AT["depth"] + 1]).all():
                rows.append(row)
        return np.array(rows).reshape(-1, len(COLUMNS))

    def _row(self, measured: float) -> Array:
        """Row of the present tick, which a record has at the time before it."""
        row = np.full(len(COLUMNS), np.nan)
        columns = {"t": self._now - self._gains.arm.tick, "measured": measured, **self._values()}
        row[[AT[name] for name in columns]] = list(columns.values())
        row[AT["q1"] : AT["q1"] + self._arm.joints] = self._simulated.truth.q
        return row

    def _tick(self) -> float:
        """Run one tick; returns the force reading before it [N]."""
        tick, normal = self._sequence.tick(), self._place.normal
        reading = float(tick.sample.force @ normal)
        self._identifier.update(float(normal @ tick.sample.position), reading)
        self._set_phase(tick.action.phase)
        if (self._count + 1) % round(self._gains.arm.rate / _ESTIMATES_PER_SECOND) == 0:
            self._estimate = self._read_estimate()
        return reading

    def _read_estimate(self) -> dict[str, float]:
        """K and B of the surface with their half-widths; a value that is smaller than its half-width is left out."""
        estimate = self._identifier.estimate()
        if estimate.rejected:
            return {}
        half = NORMAL * np.sqrt(np.diag(estimate.covariance))
        K, B = float(estimate.theta[2]), float(estimate.theta[1])
        # Encoders before a spring see the surface through it: k = K/(1 + K/s), and b = B (k/K)^2 while B w << s.
        factor = 1.0 if self._series is None else 1.0 / (1.0 - K / self._series)
        known: dict[str, float] = {}
        for name, value, width in (
            ("K", K * factor, half[2] * factor**2),
            ("B", B * factor**2, half[1] * factor**2),
        ):
            if width < abs(value):
                known |= {name: value, f"{name}_half": float(width)}
        return known

    def _values(self) -> dict[str, float]:
        truth, values = self._simulated.truth, self.state.values
        self.state.warning = self._warning(truth.saturated)
        self.state.ended = self._find_end()
        return {
            "force": truth.force,
            "desired": values["force"] if self._phase == CONTACT else 0.0,
            "depth": 1e3 * truth.depth,
            "K_true": values["surface.stiffness"],
            "B_true": values["surface.damping"],
            "wall": self._simulated.cell.place,
            "phase": self._phase,
            **self._estimate,
        }

    def _warning(self, saturated: Array) -> str:
        if saturated.any():
            joints = " and ".join(self._arm.names[i] for i in np.flatnonzero(saturated))
            return f"{printable(joints)} is at its torque limit; the desired force is out of reach."
        return self._loop.trouble

    def _set_phase(self, phase: float) -> None:
        now = self._now + self._gains.arm.tick
        if phase != self._phase and phase == CONTACT:
            self.state.add_event(Event(now, "touch"))
        elif phase != self._phase and phase == LOST:
            self.state.add_event(Event(now, "contact lost", "fail"))
        self._phase = phase

    def _find_end(self) -> str:
        """Reason why the simulation cannot go on; empty if it can."""
        truth = self._simulated.truth
        if not np.isfinite([truth.force, truth.depth, *truth.q]).all():
            return f"{DIVERGED}: the arm's motion is not finite"
        beyond = np.flatnonzero((truth.q < self._arm.lower) | (truth.q > self._arm.upper))
        if len(beyond):
            return f"{JOINT_LIMIT}: {printable(self._arm.names[beyond[0]])} reached the end of its range"
        return ""


def _sliders(gains: Gains) -> tuple[Slider, ...]:
    """Sliders of a press."""
    least = max(1.0, 10.0 * gains.arm.sensor.noise)
    return (
        Slider("force", "desired force", "N", least, min(40.0, 0.8 * gains.force_limit), FORCE),
        Slider("gain", "force gain", "", 0.1 * gains.alpha, 1.0, gains.alpha, True),
        Slider("surface.stiffness", "surface K", "N/m", STIFFNESS / 20, 20 * STIFFNESS, STIFFNESS, True, "K"),
        Slider("surface.damping", "surface B", "N s/m", DAMPING / 20, 20 * DAMPING, DAMPING, True, "B"),
    )


def scene_of(arm: SerialArm, place: Place) -> Scene:
    """The arm's joints and the surface around the tip, for the page."""
    chain = arm.chain
    tip = place.pose[:3, 3]
    centre = tip + (place.place - place.normal @ tip) * place.normal
    u, v = _PATCH * place.axes[1], _PATCH * place.axes[2]
    return Scene(
        at=_tuples(chain.at),
        turn=tuple(_tuples(axes) for axes in chain.turn),
        slide=tuple(bool(slides) for slides in chain.slide),
        tip=tuple(map(float, chain.tip)),
        normal=tuple(map(float, place.normal)),
        patch=_tuples(np.array([centre + u + v, centre + u - v, centre - u - v, centre - u + v])),
    )


def _tuples(rows: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in rows)
