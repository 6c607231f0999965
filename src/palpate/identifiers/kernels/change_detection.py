"""When did it change? A cheap alarm on the innovations, and a look back through the last samples.

The alarm is a cumulative sum (Page, 1954). The look back fits the samples anew, from the last one backwards, and
adds up how much better they are foretold so than they were by the old estimate: the logarithm of a likelihood
ratio (Gustafsson, Adaptive Filtering and Change Detection, 2000, ch. 9), whose largest value dates the change.
"""

from __future__ import annotations

from math import inf, log

from palpate._jit import law
from palpate.identifiers.kernels.least_squares import (
    learn_sample,
    length,
    long_run_variance,
    put,
    statistics_at,
    unsure,
)

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
    """Where the counters stand in a state of n parameters, behind all of `flat`; the memory follows them."""
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
