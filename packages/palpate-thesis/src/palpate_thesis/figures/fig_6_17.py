"""Figure 6.17: the neural controller on rubber from the first touch, steps of force with a sine on top."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.bench import changed
from palpate.records import Record
from palpate.report import style
from palpate_studies.metrics.following import LIMIT
from palpate_thesis.claims import ThesisClaim, claim, texts
from palpate_thesis.conditions import stops_holding
from palpate_thesis.force_control.panels import following_panel, force_panel, panels
from palpate_thesis.force_control.tracking import (
    FOLLOWS,
    RUBBER,
    SINE,
    Tracked,
    describe,
    following,
    since_contact,
    track,
)
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "6.17"
TITLE, CAPTION = texts(NUMBER)
PARAMETERS = changed(RUBBER, {**SINE, "run.press": 20.0})
SHOWN, JUDGED = (0.0, 10.0), (0.0, 10.0)
CYCLE = 5.0
"""The desired force repeats itself [s]."""
SMOOTHED = 0.25
"""Over which deviations are averaged [s]."""


@dataclass(frozen=True)
class Data:
    """Measured values for `check` and `plot`."""

    tracked: Tracked
    t: Array
    away: Array  # of the first seed: from the settled cycle, smoothed [N]
    adapted: list[float]  # when the force has come to stay near it, one a seed [s]


def run(runs: Runs) -> Data:
    """Four cycles; the last two are the reference of the first."""
    found = track(runs, PARAMETERS, SHOWN, JUDGED)
    away = runs.over_seeds(PARAMETERS, away_from_settled)
    times = [adapted_at(one) for one in away]
    return Data(
        found, np.array(1e-3 * np.arange(len(away[0])) + SMOOTHED / 2, dtype=np.float64), away[0], times
    )


def check(data: Data) -> Sequence[ThesisClaim]:
    """The force has to follow from the start; and adapting has to take from 2.5 to 7.5 s."""
    found = data.tracked
    limited = 100 * float(np.median([one.saturated for one in found.nominal]))
    middle = float(np.median(data.adapted))
    return [
        claim(
            "neural-rubber-sine",
            following(found.nominal),
            described=describe(found.nominal),
            limited=limited,
            follows=FOLLOWS,
            where=stops_holding(found.varied, lambda one: one.follows),
        ),
        claim(
            "neural-rubber-sine.adapts",
            2.5 <= middle <= 7.5,
            adapted=data.adapted,
            smoothed=SMOOTHED,
            limit=LIMIT,
        ),
    ]


def plot(data: Data) -> Figure:
    """The beginning, the runs, and the way to the settled cycle."""
    drawing, ((force,), (dots,), (away,)) = panels([3.2, 2.0, 1.5])
    force_panel(force, data.tracked.shown)
    following_panel(dots, data.tracked.varied)
    shown = data.t < SHOWN[1]
    away.plot(data.t[shown], data.away[shown])
    away.axhline(LIMIT, color=style.INK, linewidth=1, linestyle="--")
    away.set(xlabel="time since contact [s]", ylabel="deviation [N]", xlim=SHOWN, ylim=(0.0, None))
    away.set_title("from the settled cycles, mean over 0.25 s; dashed: limit of adapted")
    return drawing


def away_from_settled(record: Record) -> Array:
    """Smoothed distance of the force from the mean of the last two cycles, from contact on [N]."""
    force = record["force"][since_contact(record) >= 0.0]
    ticks = round(CYCLE * 1000)
    cycles = force[: len(force) // ticks * ticks].reshape(-1, ticks)
    away = (cycles - cycles[-2:].mean(axis=0)).ravel()
    smoothed: Array = np.abs(np.convolve(away, np.full(round(SMOOTHED * 1000), 1e-3 / SMOOTHED), "valid"))
    return smoothed


def adapted_at(away: Array) -> float:
    """When the distance has come below the limit for good [s]."""
    beyond = np.nonzero(away > LIMIT)[0]
    return SMOOTHED + (float(beyond[-1]) * 1e-3 if len(beyond) else 0.0)
