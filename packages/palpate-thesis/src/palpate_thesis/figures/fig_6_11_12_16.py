"""Figures 6.11, 6.12 and 6.16: the neural controller follows steps, with a sine on top too, on foam and on rubber."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.bench import Experiment, changed
from palpate_thesis.claims import Numbered, ThesisClaim, claim
from palpate_thesis.conditions import stops_holding
from palpate_thesis.force_control import tracking
from palpate_thesis.force_control.panels import tracked_figure
from palpate_thesis.force_control.tracking import FOLLOWS, Tracked, describe, following, track
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

JUDGED = (10.0, 15.0)


@dataclass(frozen=True, eq=False)
class Steps(Numbered):
    """The figure of one surface and one desired force."""

    id: str  # of its claim
    PARAMETERS: Experiment
    shown: tuple[float, float] = (9.5, 13.5)  # from when to when after contact [s]

    def run(self, runs: Runs) -> Tracked:
        """Fifteen seconds of contact, the last five judged."""
        return track(runs, self.PARAMETERS, self.shown, JUDGED)

    def check(self, data: Tracked) -> Sequence[ThesisClaim]:
        """The force has to follow from 10 to 15 s, by the same limits for every desired force."""
        return [
            claim(
                self.id,
                following(data.nominal),
                described=describe(data.nominal),
                limited=100 * float(np.median([one.saturated for one in data.nominal])),
                follows=FOLLOWS,
                where=stops_holding(data.varied, lambda one: one.follows),
            )
        ]

    def plot(self, data: Tracked) -> Figure:
        """The slot, and the runs."""
        return tracked_figure(data)


FOAM = Steps("6.11", "neural-foam-steps", changed(tracking.FOAM, {"run.press": 15.0}))
RUBBER = Steps("6.16", "neural-rubber-steps", changed(tracking.RUBBER, {"run.press": 15.0}))
SINE = Steps(
    "6.12", "neural-foam-sine", changed(tracking.FOAM, {**tracking.SINE, "run.press": 15.0}), (9.75, 15.0)
)
STUDIES = (FOAM, SINE, RUBBER)
