"""A single bad reading of the force: the law reacts at once, and takes back what it learned once that is refuted.

A reading that the locked estimate does not foretell may be a bad sample, or the beginning of a change. The law acts on
it in either case, and learns from it. What was known before is remembered until one of the next `CHANGE - 1` readings
is foretold by that again: then the readings between were outliers, and the law goes on from what it knew before them.
A change that lasts for `CHANGE` readings is believed for good. So no change is acted on later, and none can be locked
out.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import solve
from palpate.force.contact_estimate import ContactEstimate, reading_variance, regressor
from palpate.force.contact_evidence import EVIDENT, Watch, is_fresh
from palpate.force.stage import LOCKED, Backstop, Stage
from palpate.force.stiffness_bound import Bound

CHANGE = 3.0
"""Readings in a row that the estimate does not foretell, after which the change is believed."""

REFUTED = -1.0
"""Number of readings of a memory from which the law goes on."""


@part
class Knowledge(NamedTuple):
    """State of the law that its readings have taught it."""

    watch: Watch
    stage: Stage
    estimate: ContactEstimate
    bound: Bound
    backstop: Backstop


@part
class Recall(NamedTuple):
    """Knowledge before a reading that may be an outlier."""

    readings: float  # not foretold since then, in a row; 0 if there is none
    known: Knowledge


@law
def is_foretold(law, estimate, watch, follow, force):
    """True if a reading is within the noise of what the last theta foretells: an innovation test.

    Its variance is that of a reading and that of the estimate; the threshold is that of every other evidence.
    """
    rate = (follow.y - follow.y0) / law.tick
    phi = regressor(law, estimate, follow, rate)
    along = solve(estimate.fast.N, phi)
    error = force - estimate.fast.r @ along
    variance = reading_variance(law, estimate, watch, rate) + phi @ along
    return error * error <= EVIDENT * variance


@law
def next_recall(law, state, follow, force):
    """Memory after this reading; with `REFUTED` readings where those before it were outliers.

    A step of the desired force makes the law learn anew, which is no outlier's doing.
    """
    readings, known = state.recall
    if readings <= 0.0:
        readings, known = (
            0.0,
            Knowledge(state.watch, state.stage, state.estimate, state.bound, state.backstop),
        )
    if state.stage.phase != LOCKED:
        return Recall(0.0, known)
    if is_fresh(law, state.watch, force):
        if not is_foretold(law, known.estimate, known.watch, follow, force):
            readings = readings + 1.0 if readings < CHANGE - 1.0 else 0.0
        elif readings > 0.0:
            readings = REFUTED
    return Recall(readings, known)
