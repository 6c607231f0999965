"""The search for a proof: which claims are tried of a tuned loop, and the cells that prove them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil

import msgspec
import numpy as np

from palpate.force.arm import PositionLoop
from palpate.force.cells import Box, Prover
from palpate.force.certificate import FORM, Certificate, with_inner
from palpate.force.claims import Claim, ProvedCell, adapting_claims, held_claim, one_sided_claim
from palpate.force.cover import Cell, Search
from palpate.force.gains import Gains
from palpate.force.lag import ultimate_gain
from palpate.force.sampled_loop import SampledLoop
from palpate.force.sliding.slide_proof import sliding_claim

SOFTEST = 1e-3
"""Of the cap: as far down as a held gain is proved by default."""
EXACT_SHARE = 0.99
"""Of the exact interval of a held gain: as far up as it is proved by default."""
RINGS, CUTS = 3, 8
"""Into which an adapting law's damping times, and what lies near the edge of a held gain, are cut before a norm is
searched: they decide how long the search takes, not what it finds."""
PART = 0.06
"""Relative width of w^2 and of 2 z w that one norm is asked to serve."""


def exact_interval(gains: Gains, damping_time: float = 0.0) -> tuple[float, float]:
    """K + B/theta, as felt, on which the loop with K_u = cap is stable, for B/K of this size [N/m].

    Exact for a position arm. For others the upper end is the cap: its gain is chosen for all below it.
    """
    if gains.arm.kind != "position":
        return 0.0, gains.seen_cap
    cap = gains.seen_cap
    K = cap / (1.0 + damping_time / gains.theta)
    corners = gains.arm.inner.corners if isinstance(gains.arm.inner, PositionLoop) else []
    most = min(ultimate_gain(SampledLoop(gains.arm, inner=c), K, damping_time * K) for c in corners)
    return 0.0, cap * most / (gains.gain * K)  # `most` is g K at the boundary


# More than seven arguments: each is a claim of the certificate, and may be left out.
def certify(
    gains: Gains,
    stiffness: tuple[float, float] | None = None,
    damping_time: float | None = None,
    jitter: int = 1,
    margin: float = 1.0,
    *,
    adapting: bool = True,
    measured: PositionLoop | None = None,
    progress: Callable[[str], None] | None = None,
) -> Certificate:
    """Proves what can be proved of a tuned loop.

    Args:
        gains: of the loop.
        stiffness: of the surfaces, lowest and highest K + B/theta, their own [N/m]; by default from a thousandth of
            the cap to 99 % of what is stable at all.
        damping_time: longest B/K [s]; theta by default, 0 for the adapting law of a torque arm.
        jitter: ticks by which a reading may be older than the sensor's period while the law adapts.
        margin: factor that all gains may grow by.
        adapting: prove the adapting law too.
        measured: the inner loop as a log told it, instead of the arm's own.
        progress: told what is being proved.

    Returns:
        The claims that were proved; those that were not are left out.
    """
    own_gains, gains = gains, gains if measured is None else with_inner(gains, measured)
    position = gains.arm.kind == "position"
    most = gains.theta if damping_time is None else damping_time
    low, high = _felt_range(gains, stiffness, most, margin)
    wanted = [[held_claim(gains, low, high, most, margin)]]
    if position:
        wanted.append([one_sided_claim(gains, most, margin)])
    if adapting:
        softest = max(low, SOFTEST * gains.seen_cap)
        own = most if position or damping_time is not None else 0.0
        wanted += adapting_claims(gains, softest, own, jitter, margin)
    parts = _parts(gains)
    if parts > 0:  # an inner loop known to intervals: what spans all surfaces in one norm, and no more
        wanted = [wanted[1], *(tries[1:] for tries in wanted[3:])]
        wanted = [[msgspec.structs.replace(c, parts=parts) for c in tries] for tries in wanted]
    claims = [_first_proved(gains, tries, progress) for tries in wanted]
    if gains.slide is not None and not position:  # a position arm's one-sided claim serves a slide, too
        claims.append(sliding_claim(gains, low, high))
    proved = tuple(claim for claim in claims if claim is not None)
    return Certificate(form=FORM, gains=own_gains, claims=proved, measured=measured)


def _parts(gains: Gains) -> int:
    """Into how many parts what the inner loop may be is cut each way; 0 where it is known."""
    inner = gains.arm.inner
    if not isinstance(inner, PositionLoop) or (len(inner.corners) == 1 and gains.arm.unsure_ticks == 0):
        return 0
    corners = np.array(inner.corners)
    widest = float((np.ptp(corners, axis=0) / corners.mean(axis=0)).max())
    return max(ceil(widest / PART), 1)


def _first_proved(
    gains: Gains, tries: Sequence[Claim], progress: Callable[[str], None] | None
) -> Claim | None:
    for claim in tries:
        if progress is not None:
            progress(f"the {claim.kind} law, gains of {claim.shares[0]:g} to {claim.shares[1]:g}")
        found = proved_claim(gains, claim)
        if found is not None:
            return found
    return None


def _felt_range(
    gains: Gains, stiffness: tuple[float, float] | None, most: float, margin: float
) -> tuple[float, float]:
    if stiffness is not None:
        low, high = stiffness
        if gains.arm.kind == "position":
            return gains.arm.seen(low), gains.arm.seen(high)
        return low, high
    cap = gains.seen_cap
    ends = [exact_interval(gains, t)[1] for t in np.linspace(0.0, most, 9).tolist()]
    share = 1.0 if gains.arm.kind != "position" else EXACT_SHARE / margin
    return SOFTEST * cap, float(share * min(ends))


def proved_claim(gains: Gains, claim: Claim, starts: Sequence[Box] | None = None) -> Claim | None:
    """The claim with the cells that prove it; None if some of it cannot be proved.

    Args:
        gains: of the loop.
        claim: without cells.
        starts: boxes that tile it, from which the search for cells begins.
    """
    prover = claim.prover(gains)
    search = Search(prover)
    cells: list[Cell] = []
    whole = claim.boxes(gains)
    edge = exact_interval(gains)[1] / claim.shares[1]
    for start in starts or [s for box in whole for s in _starts(prover, box, edge)]:
        found, left = search.cover(start)
        if left:
            return None
        cells += found
    proved = tuple(
        ProvedCell(
            low=c.box.low, high=c.box.high, least=c.box.least, most=c.box.most,
            norm=tuple(tuple(map(float, row)) for row in c.L), part=c.box.part, loss=c.box.loss,
        )
        for c in cells
    )  # fmt: skip
    state, units = prover.loop.state, prover.loop.units
    return msgspec.structs.replace(claim, cells=proved, state=state, units=units)


def _starts(prover: Prover, box: Box, edge: float) -> list[Box]:
    """The box cut as the search would cut it at last: by decades; for a position arm, finer towards the edge.

    Args:
        prover: of the box.
        box: of surfaces.
        edge: K + B/theta without damping from which on the loop with the gain held grows [N/m].
    """
    if prover.fading:
        return [box]
    if box.low == box.high:
        return _rings(box, prover.theta, RINGS)
    if prover.loop.arm.kind != "position" or box.most == 0.0 or box.high <= 0.5 * edge:
        return _decades(box)
    soft = _decades(replace(box, high=0.5 * edge)) if box.low < 0.5 * edge else []
    return soft + _grade(replace(box, low=max(box.low, 0.5 * edge)), prover.theta, edge)


def _decades(box: Box) -> list[Box]:
    """Its bounds cut into decades from above: a norm seldom serves more."""
    edges = [box.high]
    while edges[-1] / 10.0 > box.low:
        edges.append(edges[-1] / 10.0)
    edges.append(box.low)
    return [replace(box, low=a, high=b) for b, a in pairwise(edges)]


def _rings(box: Box, theta: float, cuts: int) -> list[Box]:
    """Its damping times cut so often, each time the lower half."""
    if cuts == 0 or box.most == box.least:
        return [box]
    lower, upper = box.halves(theta, damping=True)
    return [upper, *_rings(lower, theta, cuts - 1)]


def _grade(box: Box, theta: float, edge: float) -> list[Box]:
    """Cut towards the corner nearest to the edge: a norm serves surfaces whose distances to it differ by four times."""
    upper, rest = _rings(box, theta, 1)
    found, distance = [upper], edge - box.low
    for _ in range(CUTS):
        upper, rest = _rings(rest, theta, 1)
        found.append(upper)
        distance *= 0.5
        middle = edge - distance
        if not rest.low < middle < rest.high:
            break
        found.append(replace(rest, high=middle))
        rest = replace(rest, low=middle)
        if edge - rest.high > 0.25 * distance:
            break
    return [*found, rest]
