"""Figures 6.11, 6.12 and 6.16: the neural controller follows steps, with a sine on top too, on foam and on rubber."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.bench import Experiment, changed
from palpate.thesis.claims import Claim, decided
from palpate.thesis.conditions import stops_holding
from palpate.thesis.force_control import tracking
from palpate.thesis.force_control.panels import tracked_figure
from palpate.thesis.force_control.tracking import FOLLOWS, Tracked, described, following, tracked
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JUDGED = (10.0, 15.0)


@dataclass(frozen=True, eq=False)
class Steps:
    """The figure of one surface and one desired force."""

    NUMBER: str
    TITLE: str
    CAPTION: str
    PARAMETERS: Experiment
    id: str  # of its claim
    claim: str
    thesis: str
    note: str  # with a place for where the claim stops holding
    shown: tuple[float, float] = (9.5, 13.5)  # from when to when after contact [s]
    limited: bool = False  # whether it is told how long motor 2 is at its limit

    def run(self, runs: Runs) -> Tracked:
        """Fifteen seconds of contact, the last five judged."""
        return tracked(runs, self.PARAMETERS, self.shown, JUDGED)

    def check(self, data: Tracked) -> Sequence[Claim]:
        """The force has to follow from 10 to 15 s, by the same limits for every desired force."""
        share = 100 * float(np.median([one.saturated for one in data.nominal]))
        limited = f"; motor 2 at its limit {share:.0f} % of the time" if self.limited else ""
        return [
            Claim(
                id=self.id,
                source=f"fig. {self.NUMBER}, sec. 6.3",
                claim=self.claim,
                thesis=self.thesis,
                measured=f"{described(data.nominal)}{limited}",
                tolerance=f"{FOLLOWS}, from 10 to 15 s",
                verdict=decided(following(data.nominal)),
                note=self.note.format(stops_holding(data.varied, lambda one: one.follows)),
            )
        ]

    def plot(self, data: Tracked) -> Figure:
        """The slot, and the runs."""
        return tracked_figure(data)


FOAM = Steps(
    "6.11",
    "Neural controller on foam: steps between 10 and 20 N",
    (
        "Four seconds of the force, some ten seconds after contact, with the hybrid controller of figure 6.10 and the "
        "network at learning rate 5e-5. The thesis says that the force follows acceptably well. Below: the same over "
        "the seeds and under varied conditions."
    ),
    changed(tracking.FOAM, {"run.press": 15.0}),
    "neural-foam-steps",
    "On foam the neural controller follows steps between 10 and 20 N, about 10 s after the start.",
    "follows acceptably well",
    (
        "The feed-forward of the desired force makes most of each step at once. The network then compensates friction "
        "within about a quarter of a second, as an integral term would. The foam is a spring, a damper and a mass, "
        "chosen because the thesis states none; the relaxing foam is among the variations. {} With the wall at 0.40 "
        "m, motor 2 reaches its limit below 20 N, which no controller can change. After minutes the result differs: "
        "see delayed-divergence."
    ),
)
RUBBER = Steps(
    "6.16",
    "Neural controller on rubber: steps between 10 and 20 N, same gains",
    (
        "Four seconds of the force on rubber, some ten seconds after contact, with the gains and the learning "
        "rate that were used on foam. The thesis says that the force follows pretty well."
    ),
    changed(tracking.RUBBER, {"run.press": 15.0}),
    "neural-rubber-steps",
    "On rubber, with the same gains, it follows steps between 10 and 20 N, about 10 s after the start.",
    "follows pretty well",
    (
        "It is true that the gains need no change, but the network contributes little: with the desired force fed "
        "forward the loop's speed hardly depends on the surface's stiffness, and a PI of fixed gain does the same "
        "(neural-is-an-integrator). On rubber the same force needs less motion, so friction, which is elastic at "
        "first, reduces a step less than on foam. {} With the wall at 0.40 m motor 2 reaches its limit below 20 N."
    ),
)
SINE = Steps(
    "6.12",
    "Neural controller on foam: steps with 4 sin(πt) added",
    (
        "The same controller, with steps of the desired force between 10 and 20 N and a sine of 4 N added, which "
        "restarts every 5 s as in the listing. The thesis says that the force follows acceptably well. The bar at the "
        "lower edge: motor 2 at its limit of 2.5 N m, near the peaks of 24 N."
    ),
    changed(tracking.FOAM, {**tracking.SINE, "run.press": 15.0}),
    "neural-foam-sine",
    "On foam it also follows the steps with 4 sin(πt) added.",
    "follows acceptably well",
    (
        "The limits are those of the plain steps, set beforehand, and the result lies close to them: with 2 N instead "
        "of 1.5 N this would be following. In the figure the force lags by a fifth of a second and is flat at the "
        "crests. There are two causes. First, friction in the joints reverses with every half wave, and the network, "
        "a slow integrator, has to learn its new sign each time (half the friction reduces the error by a third, and "
        "so does the listing's rate, twice that of the text). Second, motor 2 is at its limit at the 24 N peaks; on "
        "foam this matters less, and a stronger motor hardly helps. {}"
    ),
    shown=(9.75, 15.0),
    limited=True,
)
STUDIES = (FOAM, SINE, RUBBER)
