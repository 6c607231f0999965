"""Figure 6.16: the neural controller on rubber, steps of force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.bench import changed
from palpate.thesis.claims import Claim, decided
from palpate.thesis.conditions import stops_holding
from palpate.thesis.force_control.panels import tracked_figure
from palpate.thesis.force_control.tracking import FOLLOWS, RUBBER, Tracked, following, told, tracked
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.16"
TITLE = "Neural controller on rubber: steps between 10 and 20 N, same gains"
CAPTION = (
    "Four seconds of the force on rubber, some ten seconds after contact, with the gains and the learning "
    "rate that were used on foam. The thesis says that the force follows pretty well."
)
PARAMETERS = changed(RUBBER, {"run.press": 15.0})
SHOWN, JUDGED = (9.5, 13.5), (10.0, 15.0)


def run(runs: Runs) -> Tracked:
    """Fifteen seconds of contact, the last five judged."""
    return tracked(runs, PARAMETERS, SHOWN, JUDGED)


def check(data: Tracked) -> Sequence[Claim]:
    """The force has to follow from 10 to 15 s."""
    return [
        Claim(
            id="NNC-R1",
            source="fig. 6.16, sec. 6.3",
            claim="On rubber, with the same gains, it follows steps between 10 and 20 N, about 10 s after the start.",
            thesis="follows pretty well",
            measured=told(data.nominal),
            tolerance=f"{FOLLOWS}, from 10 to 15 s",
            verdict=decided(following(data.nominal)),
            note=(
                "That the gains need no change is true, and owes little to the network: with the desired "
                "force fed forward the loop's speed hardly depends on the surface's stiffness, and a PI of "
                "fixed gain does the same (neural-is-an-integrator). On rubber less motion goes with the "
                "same force, so that friction, which is elastic at first, withholds less of a step than on "
                f"foam. {stops_holding(data.varied, lambda one: one.follows)} With the wall at 0.40 m motor "
                "2 reaches its limit below 20 N."
            ),
        )
    ]


def plot(data: Tracked) -> Figure:
    """The slot, and the runs."""
    return tracked_figure(data)
