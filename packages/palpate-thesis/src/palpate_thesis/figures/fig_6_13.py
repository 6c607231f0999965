"""Figure 6.13: the neural controller with a small learning rate, at first."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.bench import changed
from palpate_thesis.claims import ThesisClaim, claim, often, texts
from palpate_thesis.conditions import stops_holding
from palpate_thesis.force_control.panels import tracked_figure
from palpate_thesis.force_control.tracking import FOAM, FOLLOWING, Tracked, Tracking, describe, track
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "6.13"
TITLE, CAPTION = texts(NUMBER)
SLOW = {"controller.learning_rate": 1e-5}
PARAMETERS = changed(FOAM, {**SLOW, "run.press": 10.0})
WINDOW = (0.0, 10.0)


def run(runs: Runs) -> Tracked:
    """Ten seconds from the first touch on, drawn and judged."""
    return track(runs, PARAMETERS, WINDOW, WINDOW)


def check(data: Tracked) -> Sequence[ThesisClaim]:
    """The force must not follow in the first ten seconds."""
    return [
        claim(
            "neural-slow-rate.first",
            often(map(_late, data.nominal)),
            described=describe(data.nominal),
            following=FOLLOWING,
            where=stops_holding(data.varied, _late)[3:],
        )
    ]


def plot(data: Tracked) -> Figure:
    """The beginning, and the runs."""
    return tracked_figure(data)


def _late(one: Tracking) -> bool:
    return not one.follows
