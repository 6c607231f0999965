"""Recursive least squares that notices when the surface changes, and starts again from there.

The alarm is a cumulative sum (Page, 1954). The look back fits the samples anew, from the last one backwards, and
adds up how much better they are foretold so than they were by the old estimate: the logarithm of a likelihood
ratio (Gustafsson, Adaptive Filtering and Change Detection, 2000, ch. 9), whose largest value dates the change.
"""

from math import inf, log
from typing import Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate._jit.typed_edge import cast_number
from palpate.errors import InputError
from palpate.identifiers.estimator import (
    LARGEST,
    NAMES,
    VAGUE,
    Forgetting,
    IdentifierTable,
    check_start,
    forgetting_policy,
)
from palpate.identifiers.least_squares import (
    known_first,
    learn_sample,
    length,
    long_run_variance,
    put,
    statistics_at,
    unsure,
)
from palpate.identifiers.recursive_least_squares import LeastSquaresEstimator, absorb
from palpate.signals.types import Positive, require

MOST_ROWS = 100_000
"""Most samples that one looks back over; each look costs time for all of them."""
COUNTERS = 5
"""Behind the initial estimate and its root: the alarm, the next row, rows written, changes, samples since the last."""
EXTRA = 6
"""Numbers in a row of the memory beside its regressor."""
_LOUDER = 4.0
"""How many times the noise's variance an innovation's must be for the alarm to build up."""
_ALARM = 5.0
"""Log-likelihood ratio at which one looks back; a false alarm costs time, nothing else."""
_SETTLED = 30.0
"""Samples from which the noise is known well enough to call an innovation large."""
_SUSPECTED = 32
"""Samples just seen that do not tell how large the noise is: they may be the change."""
_MARGIN = 2.0
"""Samples are left out that add less than this to the ratio: they may be from before the change."""

_ENOUGH = 2
"""Samples a parameter that the new surface must have shown: one outlier is no change."""


@law
def counters(n):
    """Where the counters stand in a state of n parameters, behind the estimate; the memory follows them."""
    return length(n) + n + n * n


@law
def alarm_sum(alarm, e, noise):
    """The cumulative sum after an innovation: is its variance likelier `_LOUDER` times the noise's, or once?"""
    if not noise > 0.0:
        return 0.0
    return max(0.0, alarm + 0.5 * ((1.0 - 1.0 / _LOUDER) * e * e / noise - log(_LOUDER)))


@law
def row_at(state, n, rows, back):
    """Where the row stands that was written `back` samples ago, 1 being the last."""
    c = counters(n)
    return c + COUNTERS + int((state[c + 1] - back + rows) % rows) * (n + EXTRA)


@law
def noise_at(state, n, at):
    """Long-run variance of the noise as it was known before the row at `at`; 0 where it was not."""
    k = at + n + 3
    if state[k] < n + _SETTLED:
        return 0.0
    return long_run_variance(state[k], state[k + 1], state[k + 2], n)


@law
def notice(state, n, phi, y, e, a, before, rows):
    """Writes a sample into the memory, and brings the alarm up to date: the noise to look back with, or 0.

    A row: regressor, force, what the old estimate paid for it (its squared innovation and the logarithm of that
    one's variance), and the noise's statistics before it.
    """
    c = counters(n)
    at = row_at(state, n, rows, 0)
    for i in range(n):
        state[at + i] = phi[i]
    k = at + n
    state[k], state[k + 1], state[k + 2] = y, e * e, log(a)
    state[k + 3], state[k + 4], state[k + 5] = before
    state[c + 1] = (state[c + 1] + 1.0) % rows
    state[c + 2] = min(state[c + 2] + 1.0, rows)
    state[c + 4] += 1.0
    noise = noise_at(state, n, row_at(state, n, rows, min(state[c + 2], _SUSPECTED)))
    state[c] = alarm_sum(state[c], e, noise)
    return noise if state[c] > _ALARM else 0.0


@law
def walk_back(state, rows, noise, until, size):
    """A new fit from the last sample backwards, until its log-likelihood ratio against the old one is reached.

    (theta, root, doubt), the largest ratio, and how many samples were taken.
    """
    n, taken, ratio, best = size.n, 0, 0.0, -inf
    theta, S = size.vector(state, length(n)), size.matrix(state, length(n) + n)
    doubt = unsure(theta, S, size.identity())
    while taken < int(state[counters(n) + 2]) and best < until:
        taken += 1
        at = row_at(state, n, rows, taken)
        k = at + n
        theta, S, doubt, e, a = learn_sample(theta, S, doubt, size.vector(state, at), state[k], 1.0, size)
        ratio += 0.5 * ((state[k + 1] - e * e) / noise + state[k + 2] - log(a))
        best = max(best, ratio)
    return (theta, S, doubt), best, taken


@law
def looked_back(state, watch, noise, size):
    """Starts again from where the surface changed, if it did and enough of the new one was seen."""
    c, n = counters(size.n), size.n
    state[c] = 0.0
    _, best, _ = walk_back(state, watch.rows, noise, inf, size)
    if best > watch.evidence:
        (theta, S, doubt), _, taken = walk_back(state, watch.rows, noise, best - _MARGIN, size)
        if taken < _ENOUGH * n:
            state[c] = 0.5 * _ALARM
        else:
            put(state, size, theta, S, doubt)
            started_again(state, n, watch.rows, taken)


@law
def started_again(state, n, rows, taken):
    """The counters after a new start `taken` samples ago; the noise is as it was known there."""
    s, c, k = statistics_at(n), counters(n), row_at(state, n, rows, taken) + n + 3
    state[s], state[s + 1], state[s + 2], state[s + 3] = state[k], state[k + 1], state[k + 2], 0.0
    state[c], state[c + 1], state[c + 2] = 0.0, 0.0, 0.0
    state[c + 3] += 1.0
    state[c + 4] = float(taken)


@part
class RestartingUpdate(NamedTuple):
    """The update of `RestartingLeastSquares`.

    Args:
        forgetting: the policy between changes.
        rows: samples that it looks back over.
        evidence: log-likelihood ratio from which the surface has changed.
    """

    forgetting: Any
    rows: float
    evidence: float

    def absorb(self, state, phi, y, size):
        """Takes a sample in; False where it is none."""
        n = size.n
        s = statistics_at(n)
        before = (state[s], state[s + 1], state[s + 2])
        e, a = absorb(state[: length(n)], phi, y, self.forgetting, size)
        if not a > 0.0:
            return False
        noise = notice(state, n, phi, y, e, a, before, self.rows)
        if noise > 0.0:
            looked_back(state, self, noise, size)
        return True


class RestartingLeastSquares(LeastSquaresEstimator):
    """Estimates theta in ``force = regressor . theta`` on a surface that may become another at any moment.

    When to use it: a probe that slides from foam onto metal, a grasp that closes on something else. Where the force
    stops being what the estimate foretells, the last samples are fitted anew, and if that is far likelier the
    estimate starts again, from the first sample of the new surface that can be told from the old. Between changes it
    is `RecursiveLeastSquares`. Its covariance is the new estimate's own: wide after a change, as it should be. A
    sample whose regressor is exactly zero teaches nothing, neither of theta nor of the noise.

    Args:
        theta: initial estimate, shape (n,); also the one that it starts again from.
        covariance: initial P, shape (n, n), symmetric and positive definite; vague, for a surface not met before.
        forgetting: what is forgotten between changes: a factor in (0, 1] or a policy, such as `SIFt`.
        memory: samples that it looks back over; a change that shows later than so is dated at the latest there.
        evidence: log-likelihood ratio from which it takes the surface to have changed.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: shapes that do not fit, numbers out of range.
    """

    def __init__(
        self,
        theta: ArrayLike,
        covariance: ArrayLike,
        forgetting: float | Forgetting = 1.0,
        memory: int = 480,
        evidence: float = 20.0,
        names: tuple[str, ...] | None = None,
    ):
        start, P = check_start(theta, covariance)
        n = len(start)
        rows = cast_number("memory", memory)
        evidence = cast_number("evidence", evidence)
        if not n < rows <= MOST_ROWS or rows % 1.0:
            raise InputError(
                f"memory must be a whole number of samples above {n}, to {MOST_ROWS:g}, got {rows:g}"
            )
        require(0.0 < evidence <= LARGEST, "evidence", "above 0", evidence)
        self.forgetting = forgetting_policy(forgetting)
        initial = [start, np.linalg.cholesky(P).ravel(), np.zeros(COUNTERS + int(rows) * (n + EXTRA))]
        state = np.concatenate([known_first(start, P), *initial])
        super().__init__(state, n, RestartingUpdate(self.forgetting, rows, evidence), names)

    def _worth(self, weight: float) -> float:
        return min(weight, float(self.since))

    @property
    def changes(self) -> int:
        """Number of changes of the surface that were detected."""
        return int(self._state[counters(self._n) + 3])

    @property
    def since(self) -> int:
        """Number of samples that the estimate rests on: those since the last change, or all."""
        return int(self._state[counters(self._n) + 4])


class RestartingIdentifier(IdentifierTable, tag="restarting-least-squares"):
    """Least squares that notice when the surface becomes another one."""

    memory: Annotated[int, Meta(ge=4, le=MOST_ROWS)] = 480
    """Samples that it looks back over."""
    evidence: Positive = 20.0
    """Log-likelihood ratio from which the surface has changed."""

    def build(self, tick: float) -> RestartingLeastSquares:
        """The estimator at its start."""
        P = np.diag(np.square(VAGUE))
        return RestartingLeastSquares(np.zeros(3), P, 1.0, self.memory, self.evidence, NAMES)
