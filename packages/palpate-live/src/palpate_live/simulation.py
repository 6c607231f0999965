"""The bench, a few ticks at a time, with numbers that change while it runs."""

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.force_input import COLUMNS as ROW
from palpate.bench.force_input import StopCondition
from palpate.bench.from_experiment import build, check_parts
from palpate.bench.summary import CONTACT, LOST
from palpate.bench.tables import Experiment, with_values
from palpate.environments import SurfaceState
from palpate.environments.surface import rest_for
from palpate.signals.types import NORMAL
from palpate.text import printable
from palpate_live.stability import OfBench
from palpate_live.view import (
    AT,
    COLUMNS,
    LEAD,
    LONGEST,
    OVER,
    STRIDE,
    Happened,
    Slider,
    SourceState,
    View,
    check_ahead,
    planar_bones,
)

_FROM = {name: i for i, name in enumerate(ROW)}
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
_SATURATED = [_FROM[f"saturated{i}"] for i in (1, 2, 3)]
_INTO = [AT[name] for name in _TAKEN]
_OUT = [_FROM[name] for name in _TAKEN.values()]


class WatchedSimulation:
    """An experiment that is run as long as somebody watches.

    Args:
        experiment: its numbers.
        seed: of the noise.
        whole: begin at the very start of the search for the surface, not shortly before the touch.
        waiting: called when the loop has to be compiled first.

    Raises:
        InputError: the experiment cannot be built.
    """

    def __init__(
        self,
        experiment: Experiment,
        seed: int = 0,
        *,
        whole: bool = False,
        waiting: Callable[[], None] | None = None,
    ):
        self._experiment, self._whole, self._waiting = experiment, whole, waiting
        self.state = SourceState(seed=seed)
        bench = build(experiment)
        check_parts(bench, waiting)
        self._rate = experiment.run.rate
        self._stride = max(1, round(STRIDE * self._rate))
        sliders = sliders_of(experiment)
        self.state.values = {slider.key: slider.value for slider in sliders}
        q, length = bench.q, bench.loop.plant.arm.length
        self.view = View(
            title=printable(experiment.title),
            about=printable(experiment.about),
            kind="simulation",
            rate=float(self._rate),
            sliders=sliders,
            links=(length.x, length.y, length.z),
            rest=(q.x, q.y, q.z),
            notes=_notes(experiment),
        )
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """To the beginning, the sliders where they stand."""
        self.state.begin(seed)
        first = 0 if self._whole else self._before_touch()
        self._begin()
        while self._run.ticks < first:
            self._run.advance(min(500 * self._stride, first - self._run.ticks))

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come: one for each `STRIDE`."""
        strides = round(seconds / STRIDE)
        if self.state.ended or not strides:
            return np.empty((0, len(COLUMNS)))
        out = self._run.advance(strides * self._stride)
        keep, ending = self._ending.judge(out, self._run.loop.controller.trouble(self._run.state.controller))
        out = out[:keep]
        self._note(out)
        self.state.warning = _at_limit(out)
        if ending is not None:
            self.state.ended = f"{ending.end}: {ending.why}"
            self.state.note(Happened(float(out[-1, 0]) if len(out) else 0.0, ending.end, "fail"))
        elif self._run.ticks >= LONGEST * self._rate:
            self.state.ended = OVER
        return self._rows_shown(out)

    def set(self, key: str, value: float) -> None:
        """Moves a slider; a surface that is pressed gets the rest length that leaves the force as it is.

        Raises:
            InputError: none of that key, or a value out of range.
        """
        self.view.check(key, value)
        if value == self.state.values[key]:
            return
        experiment = with_values(self._experiment, {key: value})
        new = build(experiment).loop
        if key.startswith("surface."):
            self._resurface(new.plant.surface)
        run: Any = self._run
        run.loop = run.loop._replace(schedule=new.schedule, controller=new.controller)
        self._experiment = experiment
        self.state.values[key] = value
        self._truth = _truth(experiment)

    def seek(self, time: float) -> None:
        """Runs on to a moment, as fast as it goes.

        Raises:
            InputError: it lies behind, or beyond a run's longest.
        """
        here = self._run.ticks / self._rate
        check_ahead(here, time)
        while self._run.ticks < round(time * self._rate) and not self.state.ended:
            self.advance(min(2.5, STRIDE * round((time - self._run.ticks / self._rate) / STRIDE) or STRIDE))

    @property
    def experiment(self) -> Experiment:
        """As it now is, with what was changed."""
        return self._experiment

    @property
    def loop_asked(self) -> OfBench:
        """The loop as it now is, for `palpate_live.stability`."""
        return OfBench(self._experiment)

    def bones(self, row: Array) -> Array:
        """Positions of the joints, see `Source`."""
        return planar_bones(self.view.links, row)

    def _begin(self) -> None:
        self._run = build(self._experiment).simulation(self.state.seed or 0, waiting=self._waiting)
        self._ending = StopCondition(self._experiment.run.losses)
        self._phase, self._contacts = 0.0, 0
        self._high = True
        self._truth = _truth(self._experiment)

    def _before_touch(self) -> int:
        """The tick, on a stride, from which it is shown: the same seed touches at the same tick again."""
        self._begin()
        most = round(min(self._experiment.run.duration, 120.0) * self._rate)
        while self._run.ticks < most:
            out = self._run.advance(min(2000, most - self._run.ticks))
            touching = out[:, _FROM["touching"]] > 0.0
            if touching.any():
                touch = self._run.ticks - len(out) + int(np.argmax(touching))
                return max(0, touch - round(LEAD * self._rate)) // self._stride * self._stride
        return 0

    def _resurface(self, new: Any) -> None:
        """Puts another surface before the tip, and lets the estimate begin again."""
        run: Any = self._run
        plant, state = run.loop.plant, run.state
        s: SurfaceState = state.plant.surface
        if s.contact == 1.0:
            old: Any = plant.surface
            force = float(old.force(s, s.deflection, s.rate))
            relaxed = s._replace(internal=0.0)
            branch = float(new.force(s, s.deflection, s.rate)) - float(
                new.force(relaxed, s.deflection, s.rate)
            )
            depth = rest_for(new, force - branch, s.rate)
            plant = plant._replace(wall=plant.wall + s.deflection - depth)
            state = state._replace(plant=state.plant._replace(surface=s._replace(deflection=depth)))
        estimators = run.loop.estimators
        anew = state.estimators._replace(
            matched=estimators.matched.start(), centring=estimators.centring.start()
        )
        run.loop = run.loop._replace(plant=plant._replace(surface=new))
        run.state = state._replace(estimators=anew)

    def _note(self, out: Array) -> None:
        """Touches and losses, to be marked."""
        phases = np.concatenate([[self._phase], out[:, 1]])
        for i in np.flatnonzero(phases[1:] != phases[:-1]):
            if phases[i + 1] == CONTACT:
                self._contacts += 1
                self.state.note(Happened(float(out[i, 0]), "switch to force"))
            elif phases[i + 1] == LOST:
                self.state.note(Happened(float(out[i, 0]), "contact lost", "fail"))
        self._phase = float(phases[-1])

    def _rows_shown(self, out: Array) -> Array:
        """Each stride's last row; of the measured force its least and its largest value by turns."""
        whole = len(out) // self._stride * self._stride
        if not whole:
            return np.empty((0, len(COLUMNS)))
        blocks = out[:whole].reshape(-1, self._stride, len(ROW))
        rows = np.full((len(blocks), len(COLUMNS)), np.nan)
        rows[:, _INTO] = blocks[:, -1, _OUT]
        measured = blocks[:, :, _FROM["force_measured"]]
        high = (np.arange(len(rows)) % 2 == 0) == self._high
        rows[:, AT["measured"]] = np.where(high, measured.max(axis=1), measured.min(axis=1))
        self._high = bool(high[-1]) is False
        rows[:, AT["depth"]] *= 1e3
        rows[:, AT["wall"]] = blocks[:, -1, _FROM["x"]] - blocks[:, -1, _FROM["penetration"]]
        for name, column in (("K", "K_matched_std"), ("B", "B_matched_std")):
            half = NORMAL * blocks[:, -1, _FROM[column]]
            value = rows[:, AT[name]]
            # As wide as itself, or before there was force control: nothing is known yet.
            unknown = ~(half < np.abs(value)) | (self._contacts == 0)
            rows[:, AT[f"{name}_half"]] = np.where(unknown, np.nan, half)
            rows[unknown, AT[name]] = np.nan
        rows[:, AT["K_true"]], rows[:, AT["B_true"]] = self._truth
        return rows


def _at_limit(out: Array) -> str:
    """Which motors gave all they can in most of these ticks."""
    share = out[:, _SATURATED].mean(axis=0) if len(out) else np.zeros(3)
    motors = [str(i + 1) for i in np.flatnonzero(share > 0.5)]
    if not motors:
        return ""
    return f"motor {' and '.join(motors)} is at its torque limit; the desired force is out of reach."


def _truth(experiment: Experiment) -> tuple[float, float]:
    """K and B of a surface that is a spring and a damper; else none."""
    surface = experiment.surface
    if type(surface).__name__ != "KelvinVoigtSurface":
        return float("nan"), float("nan")
    return float(surface.stiffness), float(surface.damping)


def _notes(experiment: Experiment) -> tuple[str, ...]:
    notes = []
    if type(experiment.surface).__name__ != "KelvinVoigtSurface":
        notes.append(
            "The estimate takes the surface for a spring and a damper, which this one is not: there is no true K and B."
        )
    if not hasattr(experiment.controller, "kf"):
        notes.append("This controller has no force gain to change.")
    return tuple(notes)


def sliders_of(experiment: Experiment) -> tuple[Slider, ...]:
    """Sliders of a running experiment."""
    force, surface = float(experiment.force.first), experiment.surface
    K, B = (
        float(getattr(surface, name, 0.0)) for name in ("stiffness", "damping")
    )  # a user's may have neither
    linear = type(surface).__name__ != "HuntCrossleySurface"
    units = ("N/m", "N s/m") if linear else ("N/m^n", "N s/m^(n+1)")
    found = [Slider("force.first", "desired force", "N", min(1.0, force), max(40.0, 2.0 * force), force)]
    gain = getattr(experiment.controller, "kf", None)
    if isinstance(gain, int | float) and gain > 0:
        found.append(Slider("controller.kf", "force gain", "", 0.05 * gain, 20.0 * gain, float(gain), True))
    if K > 0:
        found.append(Slider("surface.stiffness", "surface K", units[0], K / 20, 20 * K, K, True, "K"))
    if B > 0:
        found.append(Slider("surface.damping", "surface B", units[1], B / 20, 20 * B, B, True, "B"))
    return tuple(found)
