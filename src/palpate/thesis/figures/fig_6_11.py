"""Figure 6.11: the neural controller on foam, steps of force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.bench import changed
from palpate.thesis.claims import Claim, decided
from palpate.thesis.conditions import stops_holding
from palpate.thesis.force_control.panels import tracked_figure
from palpate.thesis.force_control.tracking import FOAM, FOLLOWS, Tracked, following, told, tracked
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.11"
TITLE = "Neural controller on foam: steps between 10 and 20 N"
CAPTION = (
    "Four seconds of the force, some ten seconds after contact, with the hybrid controller of figure 6.10 "
    "and the network at learning rate 5e-5. The thesis says that the force follows acceptably well. Below: "
    "the same over the seeds and under what was varied."
)
PARAMETERS = changed(FOAM, {"run.press": 15.0})
SHOWN, JUDGED = (9.5, 13.5), (10.0, 15.0)


def run(runs: Runs) -> Tracked:
    """Fifteen seconds of contact, the last five judged."""
    return tracked(runs, PARAMETERS, SHOWN, JUDGED)


def check(data: Tracked) -> Sequence[Claim]:
    """The force has to follow from 10 to 15 s."""
    return [
        Claim(
            id="NNC-S1",
            source="fig. 6.11, sec. 6.3",
            claim="On foam the neural controller follows steps between 10 and 20 N, about 10 s after the start.",
            thesis="follows acceptably well",
            measured=told(data.nominal),
            tolerance=f"{FOLLOWS}, from 10 to 15 s",
            verdict=decided(following(data.nominal)),
            note=(
                "The feed-forward of the desired force makes most of each step at once; what friction "
                "withholds the network then learns, within about a quarter of a second, as an integral term "
                "would. The foam is a spring, a damper and a mass, chosen because the thesis gives none; "
                "the foam that relaxes is among the variations. "
                f"{stops_holding(data.varied, lambda one: one.follows)} With the wall at 0.40 m, motor 2 "
                "reaches its limit below 20 N, which no controller can change. Minutes later the picture is "
                "another one: see delayed-divergence."
            ),
        )
    ]


def plot(data: Tracked) -> Figure:
    """The slot, and the runs."""
    return tracked_figure(data)
