"""A certificate in words and as plain JSON values."""

from __future__ import annotations

from math import isfinite
from typing import Any

from palpate.force.certificate import Certificate, Verdict
from palpate.force.claims import Claim

UNCOVERED = (
    "the backstop, the feed-forward of dF_d/dt",
    "limits of speed and torque",
    "loss of contact while the gain changes or within a tick, and of a torque arm",
    "readings between ticks (their age counts in whole ticks)",
    "the arm's compliance between encoders and tip together with damping of the surface; the tip's mass on it",
    "a surface that curves, except by the range of its tangent stiffness",
    "the peak on a surface that stiffens under the tip: the gain is the old one for a lag",
)


def sentence(claim: Claim, gains_kind: str) -> str:
    """A claim in words."""
    times = f"B/K from {claim.least:g} to {claim.most:.4g} s" if claim.most > 0.0 else "no damping (B = 0)"
    if claim.kind == "held":
        factor = f", or up to {claim.shares[1]:g} times that gain" if claim.shares[1] > 1.0 else ""
        return (
            f"the gain held at that of the stiffest surface{factor}: every surface whose K + B/theta, as the measured "
            f"position shows it, is {claim.low:.4g} to {claim.high:.4g} N/m, {times}; K and B may change from tick to "
            "tick within a cell"
        )
    if claim.kind == "one-sided":
        return (
            f"the gain held at that of the stiffest surface, with loss of contact at ticks over gaps of up to "
            f"F_d/({claim.low:.3g} N/m): every surface whose K + B/theta, as the measured position shows it, is up to "
            f"{claim.high:.4g} N/m, {times}"
        )
    which = (
        "every constant stiffness"
        if gains_kind == "position"
        else f"every constant stiffness from {claim.low:.4g} to {claim.high:.4g} N/m"
    )
    ticks = f"{claim.jitter} tick{'s' * (claim.jitter > 1)}"
    jitter = f", the age of a reading changing by up to {ticks}" if claim.jitter else ""
    return (
        f"adapting gain, for any estimate while g theta K_eff/alpha is within {claim.shares[0]:g} to "
        f"{claim.shares[1]:g}{jitter}: {which}, {times}"
    )


def lines(certificate: Certificate, verdict: Verdict) -> list[str]:
    """The certificate in words."""
    kind = certificate.gains.arm.kind
    found = [f"proved stable, {sentence(c, kind)} ({len(c.cells)} cells)" for c in certificate.claims]
    if not found:
        found = ["nothing could be proved"]
    state = "holds" if verdict.holds else f"does not hold: {verdict.why}"
    found.append(
        f"the certificate {state}; {verdict.cells} cells contract by at least {1.0 - verdict.contraction:.3g} a tick, "
        f"rounding is at most {verdict.rounding:.2g}"
    )
    return [*found, "not covered: " + "; ".join(UNCOVERED)]


def as_json(certificate: Certificate, verdict: Verdict) -> dict[str, Any]:
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
                "jitter_ticks": c.jitter,
                "cells": len(c.cells),
            }
            for c in certificate.claims
        ],
        "uncovered": list(UNCOVERED),
    }
