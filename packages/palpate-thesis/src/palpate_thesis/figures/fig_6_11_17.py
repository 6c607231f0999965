"""Figures 6.11 to 6.13, 6.16, 6.17: the neural controller follows steps, with a sine on top too, on foam and rubber."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate.studies.metrics.following import LIMIT
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import LIMIT_LINE, Figure, force_panel, panels
from palpate_thesis.force_control import tracking
from palpate_thesis.force_control.tracking import FOLLOWS, Tracked, Tracking, describe, since_contact, track
from palpate_thesis.runs import Runs, stops_holding

JUDGED = (10.0, 15.0)
SLOW_RATE = {"controller.learning_rate": 1e-5}
CYCLE = 10.0
"""Common period of the steps (5 s) and of the sine (2 s), whether its clock restarts or not [s]."""
SMOOTHED = 0.25
"""Time over which deviations are averaged [s]."""
Window = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Steps:
    """The figure of one surface and one desired force."""

    NUMBER: str
    id: str  # of its claim
    PARAMETERS: Experiment
    shown: Window = (9.5, 13.5)  # time after contact [s]
    judged: Window = JUDGED
    follows: bool = True  # statement of the thesis

    def run(self, runs: Runs) -> Tracked:
        """All seeds, drawn and judged, and the variations."""
        return track(runs, self.PARAMETERS, self.shown, self.judged)

    def check(self, data: Tracked) -> Sequence[ThesisClaim]:
        """The force has to follow, or not to follow, by the same limits for every desired force."""
        return [
            claim(
                self.id,
                often(map(self._as_said, data.nominal)),
                described=describe(data.nominal),
                limited=100 * float(np.median([run.saturated for run in data.nominal])),
                follows=FOLLOWS,
                following=tracking.FOLLOWING,
                where=stops_holding(data.varied, self._as_said),
            )
        ]

    def plot(self, data: Tracked) -> Figure:
        """The force in the slot."""
        drawing, ((force,),) = panels([3.2])
        force_panel(force, data.shown)
        return drawing

    def _as_said(self, run: Tracking) -> bool:
        return run.follows is self.follows


class Adapting(NamedTuple):
    """Data of figure 6.17."""

    tracked: Tracked
    t: Array
    away: Array  # of the first seed: from the settled cycle, smoothed [N]
    adapted: list[float]  # time from which the force stays near it, one a seed [s]


class FromTheStart(Steps):
    """Steps judged from the first touch on, and how long adapting takes: the second of two cycles is settled."""

    def run(self, runs: Runs) -> Adapting:  # type: ignore[override]
        """Two cycles; the second is the reference of the first."""
        away = runs.over_seeds(self.PARAMETERS, away_from_settled)
        t = np.array(1e-3 * np.arange(len(away[0])) + SMOOTHED / 2, dtype=np.float64)
        return Adapting(super().run(runs), t, away[0], [adapted_at(distance) for distance in away])

    def check(self, data: Adapting) -> Sequence[ThesisClaim]:  # type: ignore[override]
        """The force has to follow from the start; and adapting has to take from 2.5 to 7.5 s."""
        adapts = 2.5 <= float(np.median(data.adapted)) <= 7.5
        return [
            *super().check(data.tracked),
            claim(f"{self.id}.adapts", adapts, adapted=data.adapted, smoothed=SMOOTHED, limit=LIMIT),
        ]

    def plot(self, data: Adapting) -> Figure:  # type: ignore[override]
        """The beginning, and the way to the settled cycle."""
        drawing, ((force,), (away,)) = panels([3.2, 1.5])
        force_panel(force, data.tracked.shown)
        shown = data.t < self.shown[1]
        away.plot(data.t[shown], data.away[shown])
        away.axhline(LIMIT, **LIMIT_LINE)
        away.set(xlabel="time since contact [s]", ylabel="deviation [N]", xlim=self.shown, ylim=(0.0, None))
        away.set_title("from the settled cycle, mean over 0.25 s; dashed: limit of adapted")
        return drawing


def away_from_settled(record: Record) -> Array:
    """Smoothed distance of the force from the last cycle, from contact on [N]."""
    force = record["force"][since_contact(record) >= 0.0]
    ticks = round(CYCLE * 1000)
    cycles = force[: len(force) // ticks * ticks].reshape(-1, ticks)
    away = (cycles - cycles[-1]).ravel()
    smoothed: Array = np.abs(np.convolve(away, np.full(round(SMOOTHED * 1000), 1e-3 / SMOOTHED), "valid"))
    return smoothed


def adapted_at(away: Array) -> float:
    """Time from which the distance stays below the limit [s]."""
    beyond = np.nonzero(away > LIMIT)[0]
    return SMOOTHED + (float(beyond[-1]) * 1e-3 if len(beyond) else 0.0)


def _pressing(experiment: Experiment, seconds: float, **changes: object) -> Experiment:
    return with_values(experiment, {**changes, "run.press": seconds})


FIRST = (0.0, 10.0)
FOAM = Steps("6.11", "neural-foam-steps", _pressing(tracking.FOAM, 15.0))
SINE = Steps("6.12", "neural-foam-sine", _pressing(tracking.FOAM, 15.0, **tracking.SINE), (9.75, 15.0))
SLOW = Steps(
    "6.13", "neural-slow-rate.first", _pressing(tracking.FOAM, 10.0, **SLOW_RATE), FIRST, FIRST, follows=False
)
RUBBER = Steps("6.16", "neural-rubber-steps", _pressing(tracking.RUBBER, 15.0))
RUBBER_SINE = FromTheStart(
    "6.17", "neural-rubber-sine", _pressing(tracking.RUBBER, 20.0, **tracking.SINE), FIRST, FIRST
)
STUDIES = (FOAM, SINE, SLOW, RUBBER, RUBBER_SINE)
