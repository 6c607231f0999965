"""Figures 6.11 to 6.13, 6.16, 6.17: the neural controller follows steps, with a sine on top too, on foam and rubber."""

from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate.studies.metrics.following import LIMIT
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import LIMIT_LINE, Figure, panels
from palpate_thesis.force_control import tracking
from palpate_thesis.force_control.tracking import FOLLOWS, ForceStudy, Tracked, since_contact
from palpate_thesis.runs import Runs

JUDGED = (10.0, 15.0)
SLOW_RATE = {"controller.learning_rate": 1e-5}
CYCLE = 10.0
"""Common period of the steps (5 s) and of the sine (2 s), whether its clock restarts or not [s]."""
SMOOTHED = 0.25
"""Time over which deviations are averaged [s]."""
Window = tuple[float, float]


def _numbers(data: Tracked) -> dict[str, Any]:
    """Errors and saturation in words."""
    limited = 100 * float(np.median([run.saturated for run in data.nominal]))
    described = tracking.describe(data.nominal)
    return {
        "described": described,
        "limited": limited,
        "follows": FOLLOWS,
        "following": tracking.FOLLOWING,
    }


def _steps(
    number: str,
    id_: str,
    experiment: Experiment,
    judged: Window = JUDGED,
    shown: Window = (9.5, 13.5),
    follows: bool = True,
    kind: type[ForceStudy] = ForceStudy,
) -> ForceStudy:
    """The figure of one surface and one desired force.

    Args:
        number: of the figure.
        id_: of its claim.
        experiment: on the surface.
        judged: from when to when after contact the force is measured [s].
        shown: and drawn.
        follows: statement of the thesis.
        kind: class of the figure.
    """
    return kind(
        number,
        id_,
        experiment,
        tracking.tracking(*judged),
        lambda run: run.follows is follows,
        size=lambda run: float(run.settled),
        label="RMS error outside steps [N]",
        limit=LIMIT,
        numbers=_numbers,
        shown=shown,
    )


class Adapting(NamedTuple):
    """Data of figure 6.17."""

    tracked: Tracked
    t: Array
    away: Array  # of the first seed: from the settled cycle, smoothed [N]
    adapted: list[float]  # time from which the force stays near it, one a seed [s]


class FromTheStart(ForceStudy):
    """Steps judged from the first touch on, and how long adapting takes: the second of two cycles is settled."""

    def run(self, runs: Runs) -> Adapting:
        """Two cycles; the second is the reference of the first."""
        away = runs.over_seeds(self.PARAMETERS, away_from_settled)
        t = np.array(1e-3 * np.arange(len(away[0])) + SMOOTHED / 2, dtype=np.float64)
        return Adapting(super().run(runs), t, away[0], [adapted_at(distance) for distance in away])

    def check(self, data: Adapting) -> list[ThesisClaim]:
        """The force has to follow from the start; and adapting has to take from 2.5 to 7.5 s."""
        adapts = 2.5 <= float(np.median(data.adapted)) <= 7.5
        return [
            *super().check(data.tracked),
            claim(f"{self.id}.adapts", adapts, adapted=data.adapted, smoothed=SMOOTHED, limit=LIMIT),
        ]

    def plot(self, data: Adapting) -> Figure:
        """The first ten seconds of the force."""
        return super().plot(data.tracked)

    def beside(self, data: Adapting) -> Figure:
        """Distance of the force from the settled cycles, mean over 0.25 s; dashed: the limit of adapted."""
        drawing, ((away,),) = panels([2.2])
        shown = data.t < self.shown[1]
        away.plot(data.t[shown], data.away[shown])
        away.axhline(LIMIT, **LIMIT_LINE)
        away.set(xlabel="time since contact [s]", ylabel="deviation [N]", xlim=self.shown, ylim=(0.0, None))
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
FOAM = _steps("6.11", "neural-foam-steps", _pressing(tracking.FOAM, 15.0))
SINE = _steps("6.12", "neural-foam-sine", _pressing(tracking.FOAM, 15.0, **tracking.SINE), shown=(9.75, 15.0))
SLOW = _steps(
    "6.13", "neural-slow-rate.first", _pressing(tracking.FOAM, 10.0, **SLOW_RATE), FIRST, FIRST, follows=False
)
RUBBER = _steps("6.16", "neural-rubber-steps", _pressing(tracking.RUBBER, 15.0))
_FROM_THE_START = _pressing(tracking.RUBBER, 20.0, **tracking.SINE)
RUBBER_SINE = _steps("6.17", "neural-rubber-sine", _FROM_THE_START, FIRST, FIRST, kind=FromTheStart)
STUDIES = (FOAM, SINE, SLOW, RUBBER, RUBBER_SINE)
