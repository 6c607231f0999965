"""The search for a proof: which claims are tried of a tuned loop, and the cells that prove them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil

import msgspec
import numpy as np

from palpate.force.arm import PositionLoop
from palpate.force.certificate import FORM, Certificate, with_inner
from palpate.force.claims import Claim, ProvedCell, adapting_claims, held_claim, one_sided_claim
from palpate.force.cover import Search
from palpate.force.gains import Gains
from palpate.force.lag import ultimate_gain
from palpate.force.sampled_loop import SampledLoop
from palpate.force.sliding.slide_proof import sliding_claim

MIN_CAP_FRACTION = 1e-3
"""Fraction of the cap down to which a held gain is proved by default."""
MAX_EXACT_FRACTION = 0.99
"""Fraction of the exact interval of a held gain up to which it is proved by default."""
MAX_PART_WIDTH = 0.06
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
    gain_at_boundary = min(
        ultimate_gain(SampledLoop(gains.arm, inner=c), K, damping_time * K) for c in corners
    )
    return 0.0, cap * gain_at_boundary / (gains.gain * K)


def certify(
    gains: Gains,
    stiffness: tuple[float, float] | None = None,
    damping_time: float | None = None,
    jitter: int = 1,
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
        adapting: prove the adapting law too.
        measured: the inner loop as a log told it, instead of the arm's own.
        progress: told what is being proved.

    Returns:
        The claims that were proved; those that were not are left out.
    """
    own_gains = gains
    gains = gains if measured is None else with_inner(gains, measured)
    position = gains.arm.kind == "position"
    most = gains.theta if damping_time is None else damping_time
    low, high = _felt_range(gains, stiffness, most)
    wanted = [[held_claim(gains, low, high, most)]]
    if position:
        wanted.append([one_sided_claim(gains, most)])
    if adapting:
        softest = max(low, MIN_CAP_FRACTION * gains.seen_cap)
        longest_adapting = most if position or damping_time is not None else 0.0
        wanted += adapting_claims(gains, softest, longest_adapting, jitter)
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
    """Number of parts into which the intervals of the inner loop are cut, each; 0 where it is known."""
    inner = gains.arm.inner
    if not isinstance(inner, PositionLoop) or (len(inner.corners) == 1 and gains.arm.unsure_ticks == 0):
        return 0
    corners = np.array(inner.corners)
    widest = float((np.ptp(corners, axis=0) / corners.mean(axis=0)).max())
    return max(ceil(widest / MAX_PART_WIDTH), 1)


def _first_proved(
    gains: Gains, tries: Sequence[Claim], progress: Callable[[str], None] | None
) -> Claim | None:
    for claim in tries:
        if progress is not None:
            progress(f"the {claim.kind} law, gains of {claim.shares[0]:g} to {claim.shares[1]:g}")
        proved = proved_claim(gains, claim)
        if proved is not None:
            return proved
    return None


def _felt_range(gains: Gains, stiffness: tuple[float, float] | None, most: float) -> tuple[float, float]:
    if stiffness is not None:
        low, high = stiffness
        if gains.arm.kind == "position":
            return gains.arm.seen(low), gains.arm.seen(high)
        return low, high
    cap = gains.seen_cap
    ends = [exact_interval(gains, t)[1] for t in np.linspace(0.0, most, 9).tolist()]
    fraction = 1.0 if gains.arm.kind != "position" else MAX_EXACT_FRACTION
    return MIN_CAP_FRACTION * cap, float(fraction * min(ends))


def proved_claim(gains: Gains, claim: Claim) -> Claim | None:
    """The claim with the cells that prove it; None if some of it cannot be proved.

    Args:
        gains: of the loop.
        claim: without cells.
    """
    prover = claim.prover(gains)
    search = Search(prover)
    cells: list[ProvedCell] = []
    for box in claim.boxes(gains):
        proved, unproved = search.cover(box)
        if unproved:
            return None
        cells += proved
    state = prover.loop.state
    units = prover.loop.units
    return msgspec.structs.replace(claim, cells=tuple(cells), state=state, units=units)
