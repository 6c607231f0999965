"""Figure 6.13: the neural controller with a small learning rate, at first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.bench import changed
from palpate.thesis.claims import Claim, decided, often
from palpate.thesis.conditions import stops_holding
from palpate.thesis.force_control.panels import tracked_figure
from palpate.thesis.force_control.tracking import FOAM, FOLLOWING, Tracked, Tracking, described, tracked
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.13"
TITLE = "Neural controller with a small learning rate, at first"
CAPTION = (
    "The first ten seconds on foam with a learning rate of 1e-5, a fifth of that before. The thesis says "
    "that the force cannot follow immediately."
)
SLOW = {"controller.learning_rate": 1e-5}
PARAMETERS = changed(FOAM, {**SLOW, "run.press": 10.0})
WINDOW = (0.0, 10.0)


def run(runs: Runs) -> Tracked:
    """Ten seconds from the first touch on, drawn and judged."""
    return tracked(runs, PARAMETERS, WINDOW, WINDOW)


def check(data: Tracked) -> Sequence[Claim]:
    """The force must not follow in the first ten seconds."""
    return [
        Claim(
            id="neural-slow-rate.first",
            source="fig. 6.13, sec. 6.3",
            claim="With a learning rate of 1e-5 the force cannot follow at first.",
            thesis="cannot follow immediately",
            measured=described(data.nominal),
            tolerance=f"in 9 of 10 runs it does not follow from 0 to 10 s; following: {FOLLOWING}",
            verdict=decided(often(map(_late, data.nominal))),
            note=(
                "The network starts as an integrator whose gain is proportional to the learning rate: K_i = 1 per "
                "second here, a time constant of (1 + K_fp)/K_i = 1.25 s, half the length of an interval. A step ends "
                "before the controller has compensated friction. The level of friction determines the remaining "
                f"error. That the force does not follow {stops_holding(data.varied, _late)[3:]}"
            ),
        )
    ]


def plot(data: Tracked) -> Figure:
    """The beginning, and the runs."""
    return tracked_figure(data)


def _late(one: Tracking) -> bool:
    return not one.follows
