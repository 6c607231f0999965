"""Where a fit has found the surface, and what that has to do with the exponent."""

from __future__ import annotations

import numpy as np

from palpate.identification.judging import Candidate
from palpate.identification.result import Parameter, Verdict

_TOGETHER = 0.8


def surface(candidate: Candidate, rejected: bool, tolerance: float, unit: str) -> Parameter | None:
    """The place of the surface on the log's own scale; None if the model has none in it.

    Its interval is held against the depth of the press, for where the log counts from is nobody's business.

    Args:
        candidate: the model.
        rejected: whether it does not describe the log.
        tolerance: largest half-width, as a share of the depth.
        unit: of the position.
    """
    fitted, question = candidate.fit, candidate.question
    if "x0" not in fitted.names:
        return None
    sign = question.position_sign
    value, std = sign * (fitted["x0"] + question.origin), fitted.std("x0")
    half = fitted.t * std
    depth = float(question.motion.moved(0, fitted.lag).max()) - fitted["x0"]
    seen = f"the press goes {depth:.3g} {unit} deeper"
    interval = (value - half, value + half)
    if rejected:
        reason = f"where the model has it, which does not hold; {seen}{together(candidate)}"
        return Parameter(value, std, interval, unit, Verdict.REJECTED, reason)
    if half <= tolerance * depth:
        reason = f"known to {100 * half / depth:.2g} % (95 %) of the depth: {seen}{together(candidate)}"
        return Parameter(value, std, interval, unit, Verdict.IDENTIFIED, reason)
    reason = f"known to {half:.2g} {unit} only (95 %), and {seen}{together(candidate)}"
    return Parameter(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, reason)


def together(candidate: Candidate) -> str:
    """That exponent and place of the surface move together, if they do: a later surface looks like a steeper curve."""
    rho = correlation(candidate, "n", "x0")
    if abs(rho) < _TOGETHER:
        return ""
    return f"; n and x0 are told together only (correlation {rho:.2f})"


def correlation(candidate: Candidate, one: str, other: str) -> float:
    """Of two parameters of a fit; 0 if it has not both of them."""
    names, cov = candidate.fit.names, candidate.fit.cov
    if not {one, other} <= set(names):
        return 0.0
    i, j = names.index(one), names.index(other)
    size = float(np.sqrt(cov[i, i] * cov[j, j]))
    return float(cov[i, j]) / size if size > 0 else 0.0
