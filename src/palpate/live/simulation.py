"""An experiment of the bench in the browser; its surface, force and gain may be changed."""

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.force_input import COLUMNS as BENCH_COLUMNS
from palpate.bench.force_input import StopCondition
from palpate.bench.from_experiment import build, check_parts
from palpate.bench.summary import CONTACT, LOST
from palpate.bench.tables import Experiment, with_values
from palpate.environments import SurfaceState
from palpate.environments.surface import rest_for
from palpate.live.view import AT, COLUMNS, LONGEST, OVER, STRIDE, Event, LiveSource, Slider, View
from palpate.signals.types import NORMAL
from palpate.text import printable

LEAD = 1.5
"""Time before the first touch at which the page begins [s]; the long search for the surface is skipped."""
MAX_APPROACH = 120.0
"""Time within which the first touch is looked for [s]."""
_BENCH = {name: i for i, name in enumerate(BENCH_COLUMNS)}
"""Index of each column of the bench."""
_TAKEN = {
    "t": "t",
    "measured": "force_measured",
    "force": "force",
    "desired": "force_desired",
    "depth": "penetration",
    "K": "K_matched",
    "B": "B_matched",
    "q1": "q1",
    "q2": "q2",
    "q3": "q3",
    "phase": "phase",
}
"""Columns of the page that are columns of the bench."""
_TO = [AT[name] for name in _TAKEN]
_FROM = [_BENCH[name] for name in _TAKEN.values()]
_SATURATED = [_BENCH[f"saturated{i}"] for i in (1, 2, 3)]


class WatchedSimulation(LiveSource):
    """An experiment that runs as long as somebody watches.

    Args:
        experiment: its numbers.
        seed: of the noise.
        whole: begin with the search for the surface, not shortly before the touch.
        before_compiling: called before kernels are compiled.

    Raises:
        InputError: the experiment cannot be built, or a seed below 0.
    """

    def __init__(
        self,
        experiment: Experiment,
        seed: int = 0,
        *,
        whole: bool = False,
        before_compiling: Callable[[], None] | None = None,
    ):
        self.experiment, self._whole, self._before_compiling = experiment, whole, before_compiling
        bench = build(experiment)
        check_parts(bench, before_compiling)
        self._rate = experiment.run.rate
        self._ticks_per_row = max(1, round(STRIDE * self._rate))
        q, length = bench.q, bench.loop.plant.arm.length
        view = View(
            title=printable(experiment.title),
            about=printable(experiment.about),
            rate=float(self._rate),
            sliders=sliders_of(experiment),
            links=(length.x, length.y, length.z),
            rest=(q.x, q.y, q.z),
            notes=_notes(experiment),
        )
        super().__init__(view, seed)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Return to the beginning; the sliders stay."""
        self.state.restart(seed)
        first = 0 if self._whole else self._tick_before_touch()
        self._start()
        while self._run.ticks < first:
            self._run.advance(min(500 * self._ticks_per_row, first - self._run.ticks))

    def advance(self, seconds: float) -> Array:
        """Rows of the next seconds; the measured force is by turns the highest and the lowest since the last row."""
        count = round(seconds / STRIDE)
        if self.state.ended or not count:
            return np.empty((0, len(COLUMNS)))
        ticks = self._run.advance(count * self._ticks_per_row)
        trouble = self._run.loop.controller.trouble(self._run.state.controller)
        valid, ending = self._stop_condition.judge(ticks, trouble)
        ticks = ticks[:valid]
        self._add_events(ticks)
        self.state.warning = _torque_warning(ticks)
        if ending is not None:
            self.state.ended = f"{ending.end}: {ending.why}"
            last = float(ticks[-1, 0]) if len(ticks) else 0.0
            self.state.add_event(Event(last, ending.end, "fail"))
        elif self._run.ticks >= LONGEST * self._rate:
            self.state.ended = OVER
        return self._rows(ticks)

    def _apply(self, key: str) -> None:
        """Use a slider's new value; a surface in contact gets the rest length that keeps the force."""
        experiment = with_values(self.experiment, {key: self.state.values[key]})
        loop = build(experiment).loop
        if key.startswith("surface."):
            self._replace_surface(loop.plant.surface)
        run: Any = self._run
        run.loop = run.loop._replace(schedule=loop.schedule, controller=loop.controller)
        self.experiment = experiment

    def _start(self) -> None:
        self._run = build(self.experiment).simulation(self.state.seed, waiting=self._before_compiling)
        self._stop_condition = StopCondition(self.experiment.run.losses)
        self._phase, self._in_force_control = 0.0, False
        self._show_highest = True

    def _tick_before_touch(self) -> int:
        """First tick that is shown, a multiple of the ticks of a row: the same seed touches at the same tick again."""
        self._start()
        last = round(min(self.experiment.run.duration, MAX_APPROACH) * self._rate)
        while self._run.ticks < last:
            ticks = self._run.advance(min(2000, last - self._run.ticks))
            touching = ticks[:, _BENCH["touching"]] > 0.0
            if touching.any():
                touch = self._run.ticks - len(ticks) + int(np.argmax(touching))
                first = max(0, touch - round(LEAD * self._rate))
                return first // self._ticks_per_row * self._ticks_per_row
        return 0

    def _replace_surface(self, new: Any) -> None:
        """Put another surface before the tip, and restart the estimate."""
        run: Any = self._run
        plant, state = run.loop.plant, run.state
        surface: SurfaceState = state.plant.surface
        if surface.contact == 1.0:
            old: Any = plant.surface
            force = float(old.force(surface, surface.deflection, surface.rate))
            relaxed = surface._replace(internal=0.0)
            branch = float(new.force(surface, surface.deflection, surface.rate)) - float(
                new.force(relaxed, surface.deflection, surface.rate)
            )
            depth = rest_for(new, force - branch, surface.rate)
            plant = plant._replace(wall=plant.wall + surface.deflection - depth)
            state = state._replace(plant=state.plant._replace(surface=surface._replace(deflection=depth)))
        estimators = run.loop.estimators
        restarted = state.estimators._replace(
            matched=estimators.matched.start(), centring=estimators.centring.start()
        )
        run.loop = run.loop._replace(plant=plant._replace(surface=new))
        run.state = state._replace(estimators=restarted)

    def _add_events(self, ticks: Array) -> None:
        """Note each begin of force control and each loss of contact."""
        phases = np.concatenate([[self._phase], ticks[:, 1]])
        for i in np.flatnonzero(phases[1:] != phases[:-1]):
            if phases[i + 1] == CONTACT:
                self._in_force_control = True
                self.state.add_event(Event(float(ticks[i, 0]), "switch to force"))
            elif phases[i + 1] == LOST:
                self.state.add_event(Event(float(ticks[i, 0]), "contact lost", "fail"))
        self._phase = float(phases[-1])

    def _rows(self, ticks: Array) -> Array:
        """The last tick of each row."""
        count = len(ticks) // self._ticks_per_row
        if not count:
            return np.empty((0, len(COLUMNS)))
        blocks = ticks[: count * self._ticks_per_row].reshape(count, self._ticks_per_row, len(BENCH_COLUMNS))
        last = blocks[:, -1]
        rows = np.full((count, len(COLUMNS)), np.nan)
        rows[:, _TO] = last[:, _FROM]
        rows[:, AT["measured"]] = self._extremes(blocks[:, :, _BENCH["force_measured"]])
        rows[:, AT["depth"]] *= 1e3
        rows[:, AT["wall"]] = last[:, _BENCH["x"]] - last[:, _BENCH["penetration"]]
        for name in ("K", "B"):
            half = NORMAL * last[:, _BENCH[f"{name}_matched_std"]]
            # An interval as wide as its value, or before force control, is no knowledge.
            unknown = ~(half < np.abs(rows[:, AT[name]])) | (not self._in_force_control)
            rows[:, AT[f"{name}_half"]] = np.where(unknown, np.nan, half)
            rows[unknown, AT[name]] = np.nan
        rows[:, AT["K_true"]], rows[:, AT["B_true"]] = _truth(self.experiment)
        return rows

    def _extremes(self, measured: Array) -> Array:
        """By turns the highest and the lowest force of a row [N], shape (n,) from (n, ticks)."""
        highest = (np.arange(len(measured)) % 2 == 0) == self._show_highest
        self._show_highest = not highest[-1]
        return np.where(highest, measured.max(axis=1), measured.min(axis=1))


def _torque_warning(ticks: Array) -> str:
    """Which motors were at their torque limit in most of these ticks; empty if none."""
    share = ticks[:, _SATURATED].mean(axis=0) if len(ticks) else np.zeros(3)
    motors = [str(i + 1) for i in np.flatnonzero(share > 0.5)]
    if not motors:
        return ""
    return f"motor {' and '.join(motors)} is at its torque limit; the desired force is out of reach."


def _is_kelvin_voigt(experiment: Experiment) -> bool:
    return type(experiment.surface).__name__ == "KelvinVoigtSurface"


def _truth(experiment: Experiment) -> tuple[float, float]:
    """K [N/m] and B [N s/m] of a Kelvin-Voigt surface; NaN for others."""
    if not _is_kelvin_voigt(experiment):
        return float("nan"), float("nan")
    return float(experiment.surface.stiffness), float(experiment.surface.damping)


def _notes(experiment: Experiment) -> tuple[str, ...]:
    notes = []
    if not _is_kelvin_voigt(experiment):
        notes.append(
            "The estimate takes the surface for a spring and a damper, which this one is not: there is no true K and B."
        )
    if not hasattr(experiment.controller, "kf"):
        notes.append("This controller has no force gain to change.")
    return tuple(notes)


def sliders_of(experiment: Experiment) -> tuple[Slider, ...]:
    """Sliders of an experiment: those of its numbers that its parts have."""
    force, surface = float(experiment.force.first), experiment.surface
    # A user's own surface may have neither.
    K, B = float(getattr(surface, "stiffness", 0.0)), float(getattr(surface, "damping", 0.0))
    linear = type(surface).__name__ != "HuntCrossleySurface"
    units = ("N/m", "N s/m") if linear else ("N/m^n", "N s/m^(n+1)")
    sliders = [Slider("force.first", "desired force", "N", min(1.0, force), max(40.0, 2.0 * force), force)]
    gain = getattr(experiment.controller, "kf", None)
    if isinstance(gain, int | float) and gain > 0:
        sliders.append(Slider("controller.kf", "force gain", "", 0.05 * gain, 20.0 * gain, float(gain), True))
    if K > 0:
        sliders.append(Slider("surface.stiffness", "surface K", units[0], K / 20, 20 * K, K, True, "K"))
    if B > 0:
        sliders.append(Slider("surface.damping", "surface B", units[1], B / 20, 20 * B, B, True, "B"))
    return tuple(sliders)
