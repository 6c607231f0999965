"""One's own linear force law by numbers: where its loop is stable on springs, and what of that is proved."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from palpate.certify.controller_answer import LawVerdict, check_timing, judge_law
from palpate.certify.discrete_loop import AffineLoop
from palpate.certify.upstream_laws import Timing, law_signals
from palpate.errors import InputError

MAX_ORDER = 40


class LinearLaw(NamedTuple):
    """A law of one axis, from the error of the force [N] to a command, in controllable canonical form.

    Args:
        numerator: coefficients of z, the highest power first, as many as the denominator has.
        denominator: likewise; the first is 1.
    """

    numerator: tuple[Fraction, ...]
    denominator: tuple[Fraction, ...]

    def loop(self, timing: Timing) -> AffineLoop:
        """One tick on a position or velocity arm."""
        states, arm, error = law_signals(len(self.denominator) - 1, timing)
        newest = error - sum((a * s for a, s in zip(self.denominator[1:], states, strict=True)), 0 * error)
        command: Any = sum((b * s for b, s in zip(self.numerator, [newest, *states], strict=True)), 0 * error)
        return arm.loop([newest, *states[:-1]] if states else [], command, timing)


def certify_law(
    numerator: Sequence[float],
    denominator: Sequence[float],
    *,
    rate: float,
    delay: float,
    interface: str = "velocity",
) -> LawVerdict:
    """Where a linear force law is stable on springs without damping; one axis, without saturation.

    Args:
        numerator: of the law from the force's error, desired minus pressed [N], to the command, in powers of z, the
            highest first.
        denominator: likewise; not of a lower power than the numerator.
        rate: ticks a second.
        delay: from the command to the force that it causes, beyond the tick between them [s].
        interface: `position` or `velocity`, of the command [m, m/s].

    Raises:
        InputError: coefficients that are no numbers, a law that looks ahead, or a rate or delay out of range.
    """
    coefficients = [*numerator, *denominator]
    if not all(isinstance(c, int | float) and isfinite(c) for c in coefficients) or not any(denominator[:1]):
        raise InputError(
            f"a law needs finite coefficients and a denominator that begins with none of 0, got {coefficients}"
        )
    if not 0 < len(numerator) <= len(denominator) <= MAX_ORDER:
        raise InputError(
            f"the numerator must have 1 to {len(denominator)} coefficients, the denominator at most {MAX_ORDER}, got "
            f"{len(numerator)} and {len(denominator)}: a law cannot look ahead"
        )
    if interface not in ("position", "velocity"):
        raise InputError(f"interface must be 'position' or 'velocity', got {interface!r}")
    check_timing(rate, delay)
    first = Fraction(denominator[0])
    padded = [0.0] * (len(denominator) - len(numerator)) + [*numerator]
    law = LinearLaw(
        tuple(Fraction(b) / first for b in padded), tuple(Fraction(a) / first for a in denominator)
    )
    return judge_law(law, Timing(float(rate), float(delay), interface))


def transfer_function(
    A: Sequence[Sequence[float]], B: Sequence[float], C: Sequence[float], D: float = 0.0
) -> tuple[list[float], list[float]]:
    """Numerator and denominator, in powers of z, of x+ = A x + B e, command = C x + D e.

    Args:
        A: shape (n, n).
        B: shape (n,).
        C: shape (n,).
        D: direct part.
    """
    state, column, row = np.asarray(A, float), np.asarray(B, float), np.asarray(C, float)
    denominator = np.poly(state)
    numerator = np.poly(state - np.outer(column, row)) + (D - 1.0) * denominator
    return numerator.tolist(), denominator.tolist()
