"""Prior of the surface before the first press: a range, or an identification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, TypeGuard

from palpate.errors import InputError
from palpate.force.lag import SOFTEST

_OF_IDENTIFY = " (to palpate identify, whose --json palpate tune takes)"
"""Behind what an identification asks for."""


@dataclass(frozen=True)
class Known:
    """Prior of the surface.

    Args:
        stiffness: K, lowest and highest [N/m].
        damping: B, lowest and highest [N s/m].
        value: K itself [N/m]; None where only a range was given.
        source: where that comes from.
        warnings: of the identification, code and text.
    """

    stiffness: tuple[float, float]
    damping: tuple[float, float] = (0.0, 0.0)
    value: float | None = None
    source: str = "told"
    warnings: tuple[tuple[str, str], ...] = ()


def known_from(found: Mapping[str, Any], source: str) -> Known:
    """The surface of an identification, from the object that `palpate identify --json` prints.

    Raises:
        InputError: no such object, or one without a stiffness in N/m that can be bounded.
    """
    if "logs" in found:
        found = found.get("pooled") or {}
    parameters = found.get("parameters") if isinstance(found, Mapping) else None
    if not isinstance(parameters, Mapping):
        raise InputError(
            f"{source}: not what palpate identify --json prints; give that, a log, or --stiffness A:B"
        )
    point = found.get("working_point")
    stiffness = point.get("stiffness") if isinstance(point, Mapping) else None
    K = stiffness if isinstance(stiffness, Mapping) and _interval(stiffness) else parameters.get("K")
    interval = _interval(K) if isinstance(K, Mapping) else None
    if not isinstance(K, Mapping) or interval is None:
        why = K.get("reason") if isinstance(K, Mapping) else "it has no stiffness"
        raise InputError(
            f"{source}: the stiffness has no interval ({why}); excite more (palpate excite), or give --stiffness A:B"
        )
    unit = K.get("unit")
    if unit not in (None, "N/m"):
        raise InputError(
            f"{source}: the stiffness is in {unit}; name the log's units (as --force f:N) so that it is in N/m"
        )
    low, high = interval
    if not high > 0.0:
        raise InputError(f"{source}: a stiffness of {low:g} to {high:g} N/m is none that one can press on")
    B = parameters.get("B")
    damping = (_interval(B) if isinstance(B, Mapping) else None) or (0.0, 0.0)
    value = K.get("value")
    return Known(
        (max(low, SOFTEST), high),
        (max(damping[0], 0.0), max(damping[1], 0.0)),
        float(value) if _is_number(value) else None,
        source,
        _warned(found.get("warnings")),
    )


def _warned(warnings: object) -> tuple[tuple[str, str], ...]:
    """Warnings of an identification, as far as they are text."""
    given = warnings if isinstance(warnings, list) else []
    return tuple(
        (w["code"], w["text"] + (_OF_IDENTIFY if "--" in w["text"] else ""))
        for w in given
        if isinstance(w, Mapping) and isinstance(w.get("code"), str) and isinstance(w.get("text"), str)
    )


def _interval(parameter: Mapping[str, Any]) -> tuple[float, float] | None:
    for key in ("prediction95", "ci95"):
        ends = parameter.get(key)
        if isinstance(ends, list | tuple) and len(ends) == 2 and all(_is_number(end) for end in ends):
            return float(ends[0]), float(ends[1])
    return None


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
