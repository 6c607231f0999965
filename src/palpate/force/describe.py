"""A certificate in words, for a terminal, and as plain JSON values."""

from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from palpate.force.certificate import Certificate, CertificateVerdict
from palpate.force.claims import Claim
from palpate.force.gains import Gains
from palpate.force.sliding.slide_proof import slide_proof
from palpate.force.tuning import RIGID, surface_ends
from palpate.text import printable
from palpate.units import quantity

UNCOVERED = (
    "the backstop, the feed-forward of dF_d/dt",
    "limits of speed and torque",
    "loss of contact while the gain changes or within a tick, and of a torque arm",
    "readings between ticks (their age counts in whole ticks)",
    "other numbers of a servo than the file's",
    "the arm's compliance between encoders and tip together with damping of the surface; the tip's mass on it",
    "a surface's own mass; a surface that curves, except by the range of its tangent stiffness",
    "the peak on a surface that stiffens under the tip: the gain is the old one for a lag",
)


def bounds(claim: Claim, gains: Gains) -> tuple[float, float]:
    """K_u over K + B/theta from and to which an adapting claim covers all of its surfaces.

    The gain falls with K_u, since rho is below 2/3. For a position arm the shares tell it; for a torque arm it depends
    on the stiffness, and the worst of a grid is taken.
    """
    if gains.arm.kind != "torque":
        return 1.0 / claim.shares[1], 1.0 / claim.shares[0]
    times = np.geomspace(1e-3, 1e3, 6001)
    least = times[0]
    most = times[-1]
    for K in np.geomspace(max(claim.low, 1e-9), claim.high, 61).tolist():
        gain_fraction = (
            gains.theta * gains.arm.seen(K) / gains.alpha * np.array([gains.gain_at(r * K) for r in times])
        )
        least = max(least, times[gain_fraction <= claim.shares[1]][0])
        most = min(most, times[gain_fraction >= claim.shares[0]][-1])
    return float(least), float(most) if most < times[-1] else np.inf


def as_json(certificate: Certificate, verdict: CertificateVerdict) -> dict[str, Any]:
    """The certificate as plain JSON values, without its norms."""
    return {
        "holds": verdict.holds,
        "why": verdict.why,
        "cells": verdict.cells,
        "contraction": 1.0 - verdict.contraction if isfinite(verdict.contraction) else None,
        "rounding": verdict.rounding,
        "claims": [
            {
                "kind": c.kind,
                "felt_stiffness": [c.low, c.high],
                "damping_time": [c.least, c.most],
                "gain_shares": list(c.shares),
                "ages_ticks": list(c.ages),
                "cells": len(c.cells),
            }
            for c in certificate.claims
        ],
        "slide": slide_proof(certificate),
        "uncovered": list(UNCOVERED),
    }


def proof_lines(
    certificate: Certificate,
    verdict: CertificateVerdict,
    written: Path | None = None,
    *,
    verbose: bool = False,
) -> Iterator[Text]:
    """A certificate: whether it holds, and the surfaces that each of its claims covers, a line each.

    Args:
        certificate: to be described.
        verdict: of its check.
        written: where it was written.
        verbose: add the contraction, the rounding error, and the cases that are not covered.
    """
    gains = certificate.gains
    place = f"   written: {written}" if written else ""
    if not certificate.claims:
        yield Text("✕ Nothing could be proved.", "bold red")
    elif verdict.holds:
        title = (
            f"✓ The certificate holds: {verdict.cells} cells, each contracts by more than its rounding error."
        )
        yield Text(title, "bold green").append(printable(place), "default")
        yield Text(f"Stable on surfaces with K + B/theta (theta {1e3 * gains.theta:.2g} ms) of")
    else:
        yield Text(printable(f"✕ The certificate does not hold: {verdict.why}."), "bold red")
    for i, claim in enumerate(certificate.claims):
        if claim.kind != "held" or i == 0:  # a later one is that of a slide, below
            yield Text(f"  {claim_title(claim):24}{claim_scope(claim, gains)}")
    if (slide := slide_proof(certificate)) is not None:
        yield Text(f"  {'slide':24}{_slide_scope(slide, gains)}")
    if not verbose:
        yield Text(f"Not covered: {len(UNCOVERED)} cases, which --verbose lists.")
        return
    yield Text(
        f"Each cell contracts by at least {1.0 - verdict.contraction:.3g} a tick; rounding is at most "
        f"{verdict.rounding:.2g}."
    )
    yield Text("Not covered: " + "; ".join(UNCOVERED))


_CLAIMS = {"held": "constant gain", "one-sided": "contact lost and found", "adapting": "adapting gain"}


def claim_title(claim: Claim) -> str:
    """The kind of a claim in words."""
    return _CLAIMS[claim.kind]


def claim_scope(claim: Claim, gains: Gains) -> str:
    """Surfaces, gains, ages of readings and damping that a claim covers."""
    low, high = surface_ends(gains.arm, claim.low, claim.high)
    if claim.kind == "adapting":
        least, most = bounds(claim, gains)
        end = f" to {most:.3g}" if isfinite(most) else " and more"
        span = "any stiffness" if gains.arm.kind == "position" else _stretch(low, high)
        gain = f", K_u {least:.3g}{end} times theirs, readings {claim.ages[0]} to {claim.ages[1]} ticks old"
    else:
        span = _stretch(low, high)
        if claim.kind == "one-sided":
            gap = quantity(gains.force / claim.low, "m")
            span = f"up to {quantity(high, 'N/m')}, over gaps of up to {gap}"
        gain = f", at up to {claim.shares[1]:g} times the gain" if claim.shares[1] > 1.0 else ""
    damping = f"; B/K up to {quantity(claim.most, 's')}" if claim.most else "; B = 0"
    return f"{span}{gain}{damping}"


def _slide_scope(slide: dict[str, Any], gains: Gains) -> str:
    ends, (least, most) = slide["felt_stiffness"], slide["gain_factor"]
    span = "no surface" if ends is None else _stretch(*surface_ends(gains.arm, *ends))
    errors = (
        f"normal off by up to {slide['angle_deg']:g}\N{DEGREE SIGN}, friction up to {slide['friction']:g}"
    )
    return f"{span}, {errors}, both changing (gain x {least:.2g} to {most:.3g}); B = 0"


def _stretch(low: float, high: float) -> str:
    end = "up" if high >= RIGID else f"to {quantity(high, 'N/m')}"
    return f"{quantity(low, 'N/m')} {end}"
