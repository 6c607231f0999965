"""Surfaces on which a slide is proved, whose normal is not quite known while friction pulls along the surface.

A tip that is moved along an estimated normal at an angle phi to the true one changes its reading along it by
m = cos phi (cos phi -+ mu sin phi) times what it would. So the loop is that of a surface of m K, where m goes from tick
to tick anywhere between two ends: a cell of the proof that holds all of m K, whose surface may change from tick to
tick, proves it.
"""

from __future__ import annotations

from math import atan, cos, radians, sin
from typing import Any

import msgspec

from palpate.force.cells import Box
from palpate.force.certificate import Certificate
from palpate.force.claims import Claim, ProvedCell, held_claim
from palpate.force.cover import Search
from palpate.force.gains import Gains

MAX_MISALIGNMENT = radians(10.0)
"""Angle between the estimated and the true normal up to which a slide is proved [rad]."""
WIDTHS = 2.2, 1.6, 1.25, 1.1
"""Logarithmic widths of a cell that are tried, in units of that of m."""


ROUNDING = 1e-9
"""Relative width by which a statement is less than what floating point shows."""


def gain_factors(friction: float, angle: float = MAX_MISALIGNMENT) -> tuple[float, float]:
    """Least and largest m, for angles and friction up to these."""
    most = min(angle, 0.5 * atan(friction))  # where cos phi (cos phi + mu sin phi) is largest
    return cos(angle) * (cos(angle) - friction * sin(angle)), cos(most) * (cos(most) + friction * sin(most))


def sliding_claim(gains: Gains, low: float, high: float) -> Claim | None:
    """The held gain without damping, in cells that overlap by the width of m; None if a part cannot be proved.

    Args:
        gains: of a torque arm, with a table `slide`.
        low: m K + B/theta from [N/m].
        high: to [N/m].
    """
    assert gains.slide is not None
    least, most = gain_factors(gains.slide.mu_max)
    claim = held_claim(gains, low, high, 0.0)
    prover = claim.prover(gains)
    search = Search(prover)
    cells = list[ProvedCell]()
    top = high
    while not cells or cells[-1].box.low > low:
        boxes = (Box(max(top / (most / least) ** width, low), top, 0.0, 0.0) for width in WIDTHS)
        proved = next((proved for proved, _ in map(search.cover, boxes) if len(proved) == 1), None)
        if proved is None:
            return None
        cells += proved
        top = proved[0].box.low * most / least * (1.0 + 4.0 * ROUNDING)
    return msgspec.structs.replace(
        claim, cells=tuple(cells), state=prover.loop.state, units=prover.loop.units
    )


def slide_proof(certificate: Certificate) -> dict[str, Any] | None:
    """Surfaces of a slide that are proved while m changes from tick to tick; None of gains without a slide.

    Returns:
        `gain_factor`: ends of m; `angle_deg`, `friction`: up to which; `felt_stiffness`: K as the measured position
        feels it, with the gain of the cap [N/m], None if nothing is proved; `bound_share`: for a position arm K_u of
        the press over that K, from and to which the same is proved with the gain of K_u.
    """
    slide = certificate.gains.slide
    if slide is None:
        return None
    least, most = gain_factors(slide.mu_max)
    cells = [
        c for claim in certificate.claims if claim.kind != "adapting" for c in claim.cells if c.least == 0.0
    ]
    ends = sorted((c.low / least * (1.0 + ROUNDING), c.high / most * (1.0 - ROUNDING)) for c in cells)
    shares = [
        (most / claim.shares[1], least / claim.shares[0])
        for claim in certificate.claims
        if claim.kind == "adapting" and certificate.gains.arm.kind == "position"
    ]
    return {
        "gain_factor": [least, most], "angle_deg": 10.0, "friction": slide.mu_max,
        "felt_stiffness": widest([interval for interval in ends if interval[0] < interval[1]]),
        "bound_share": [list(share) for share in shares],
    }  # fmt: skip


def widest(ends: list[tuple[float, float]]) -> list[float] | None:
    """The interval of the largest ratio without a gap that intervals cover, given in order of their lower ends."""
    joined: list[list[float]] = []
    for low, high in ends:
        if joined and low <= joined[-1][1]:
            joined[-1][1] = max(joined[-1][1], high)
        else:
            joined.append([low, high])
    return max(joined, key=lambda interval: interval[1] / interval[0], default=None)
