"""A certificate in words and as plain JSON values."""

from math import isfinite
from typing import Any

import numpy as np

from palpate.force.certificate import Certificate, CertificateVerdict
from palpate.force.claims import Claim
from palpate.force.gains import Gains
from palpate.force.sliding.slide_proof import slide_proof, slide_proof_sentence

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
    least, most = times[0], times[-1]
    for K in np.geomspace(max(claim.low, 1e-9), claim.high, 61).tolist():
        share = (
            gains.theta * gains.arm.seen(K) / gains.alpha * np.array([gains.gain_at(r * K) for r in times])
        )
        least = max(least, times[share <= claim.shares[1]][0])
        most = min(most, times[share >= claim.shares[0]][-1])
    return float(least), float(most) if most < times[-1] else np.inf


def ages(claim: Claim, gains: Gains) -> str:
    """Ages of readings that a claim covers, in words."""
    young, old = claim.ages
    if claim.kind != "adapting":
        return f"a reading that is always {old} ticks old"
    own = gains.arm.rate / gains.arm.sensor.sampling
    return f"a reading of any age from {young} to {old} ticks, from tick to tick (the sensor's own are 0 to {own:.3g})"


def sentence(claim: Claim, gains: Gains) -> str:
    """A claim in words."""
    times = f"B/K from {claim.least:g} to {claim.most:.4g} s" if claim.most > 0.0 else "no damping (B = 0)"
    factor = f", or up to {claim.shares[1]:g} times that gain" if claim.shares[1] > 1.0 else ""
    if claim.kind == "held":
        held = "the gain and the lead" if gains.arm.kind == "servo" else "the gain"
        return (
            f"{held} held at that of the stiffest surface{factor}: every surface whose K + B/theta, as the measured "
            f"position shows it, is {claim.low:.4g} to {claim.high:.4g} N/m, {times}, with {ages(claim, gains)}; K and "
            "B may change from tick to tick within a cell"
        )
    if claim.kind == "one-sided":
        damper = "; the damper acts before the tip touches, too" if claim.most > 0.0 else ""
        return (
            f"the gain held at that of the stiffest surface{factor}, with loss of contact at ticks over gaps of up to "
            f"F_d/({claim.low:.3g} N/m): every surface whose K + B/theta, as the measured position shows it, is up to "
            f"{claim.high:.4g} N/m, {times}, with {ages(claim, gains)}: the force is max(K x + B xdot, 0){damper}"
        )
    which = (
        "every constant stiffness"
        if gains.arm.kind == "position"
        else f"every constant stiffness from {claim.low:.4g} to {claim.high:.4g} N/m"
    )
    least, most = bounds(claim, gains)
    end = f" to {most:.3g}" if most < np.inf else " and more"
    return (
        f"adapting gain, for any estimate while g theta K_eff/alpha is within {claim.shares[0]:g} to "
        f"{claim.shares[1]:g} (K_u is {least:.3g}{end} times K + B/theta), with {ages(claim, gains)}: {which}, "
        f"{times}"
    )


def lines(certificate: Certificate, verdict: CertificateVerdict) -> list[str]:
    """The certificate in words."""
    gains = certificate.proved_gains
    found = [f"proved stable, {sentence(c, gains)} ({len(c.cells)} cells)" for c in certificate.claims]
    if not found:
        found = ["nothing could be proved"]
    if (slide := slide_proof(certificate)) is not None:
        found.append(slide_proof_sentence(slide))
    state = "holds" if verdict.holds else f"does not hold: {verdict.why}"
    found.append(
        f"the certificate {state}; {verdict.cells} cells contract by at least {1.0 - verdict.contraction:.3g} a tick, "
        f"rounding is at most {verdict.rounding:.2g}"
    )
    return [*found, "not covered: " + "; ".join(UNCOVERED)]


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
