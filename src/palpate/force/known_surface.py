"""Prior of the surface before the first press: a range, or an identification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from typing import Any, NamedTuple, TypeGuard

from palpate.errors import InputError
from palpate.force.arm import Arm
from palpate.force.lag import MIN_STIFFNESS

_OF_IDENTIFY = " (to palpate identify, whose --json palpate tune takes)"
"""Behind what an identification asks for."""
_SERIES = "series-compliance"
"""Warning of an identification whose position does not show how the arm gives way."""


class Assumed(NamedTuple):
    """A value that nothing measured.

    Args:
        value: that the gains allow for; infinite if there is none.
        unit: in SI.
        why: it is this one.
    """

    value: float
    unit: str
    why: str

    def to_json(self) -> dict[str, Any]:
        """The surface as plain values for JSON."""
        return {"value": _finite(self.value), "unit": self.unit, "why": self.why}


@dataclass(frozen=True)
class Known:
    """Prior of the surface.

    Args:
        stiffness: K, lowest and highest [N/m].
        damping: B, lowest and highest [N s/m]; infinite where nothing bounds it.
        value: K itself [N/m]; None where only a range was given.
        source: where that comes from.
        warnings: of the identification, code and text.
        assumed: of what has no number, by name.
        in_series: the position that it was measured with does not show how the arm gives way.
        force: at which it was measured [N]; None where that is unknown.
    """

    stiffness: tuple[float, float]
    damping: tuple[float, float] = (0.0, 0.0)
    value: float | None = None
    source: str = "told"
    warnings: tuple[tuple[str, str], ...] = ()
    assumed: Mapping[str, Assumed] = field(default_factory=dict)
    in_series: bool = False
    force: float | None = None

    @classmethod
    def of_range(cls, stiffness: tuple[float, float], damping: float | None = None) -> Known:
        """A surface from a range of K [N/m] and the highest B [N s/m]; no damping is assumed when None."""
        none = {"damping": Assumed(0.0, "N s/m", "none is given: --damping-max allows for one")}
        return cls(stiffness, assumed=none).with_damping_up_to(damping)

    def with_damping_up_to(self, highest: float | None) -> Known:
        """The surface with a stated highest B [N s/m]; unchanged if None.

        Raises:
            InputError: below 0.
        """
        if highest is None:
            return self
        if not 0.0 <= highest < inf:
            raise InputError(f"--damping-max must be 0 N s/m or more, got {highest:g} N s/m")
        return replace(self, damping=(min(self.damping[0], highest), highest), assumed={})

    def to_json(self) -> dict[str, Any]:
        """Plain values of the estimate."""
        return {
            "stiffness": self.value,
            "stiffness_interval": list(self.stiffness),
            "damping_interval": [_finite(end) for end in self.damping],
            "source": self.source,
        }

    def beyond(self, arm: Arm) -> Known:
        """The surface alone, where the arm gave way in series with it in the log.

        K = Ks k/(Ks + k) and B = Bs (k/(Ks + k))^2 of the surface's Ks and Bs and the arm's k.
        """
        if not self.in_series or arm.kind != "position":
            return self
        in_series = self.stiffness[1]
        alone = min(arm.surface(in_series), max(arm.limits.stiffness, in_series))
        why = f"through the arm it is at most {in_series:.4g} N/m, the arm alone has {arm.series / 1e3:.3g} kN/m"
        return replace(
            self,
            stiffness=(self.stiffness[0], alone),
            damping=(self.damping[0], self.damping[1] * (alone / in_series) ** 2),
            assumed={**self.assumed, "stiffness": Assumed(alone, "N/m", why)},
            in_series=False,
        )


def known_from(found: Mapping[str, Any], source: str) -> Known:
    """The surface of an identification, from the object that `palpate identify --json` prints.

    Raises:
        InputError: no such object, or one without a stiffness in N/m that can be bounded.
    """
    logs = found.get("logs")
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
    damping, assumed = _damping(parameters.get("B"), logs if isinstance(logs, list) else [])
    value = K.get("value")
    warnings = _warnings_of(found.get("warnings")) + _of_mass(parameters.get("M"))
    force = point.get("force_N") if isinstance(point, Mapping) else None
    return Known(
        (max(low, MIN_STIFFNESS), high + _relaxing(parameters)),
        damping,
        float(value) if _is_number(value) else None,
        source,
        warnings,
        assumed,
        any(code == _SERIES for code, _ in warnings),
        float(force) if _is_number(force) and force > 0.0 else None,
    )


def _damping(B: object, logs: list[Any]) -> tuple[tuple[float, float], dict[str, Assumed]]:
    """B's interval [N s/m], and what is assumed of it: where it has no number, its upper end counts.

    Args:
        B: the parameter.
        logs: that it is pooled from; the widest of their intervals counts where the pooled B has none.
    """
    each = [_of_unit(log["B"], "N s/m") for log in map(_parameters, logs) if "B" in log]
    widest = [end for end in each if end is not None]
    interval = _of_unit(B, "N s/m")
    if interval is None and each and len(widest) == len(each):
        interval = min(low for low, _ in widest), max(high for _, high in widest)
    why = B.get("reason") or B.get("verdict") if isinstance(B, Mapping) else None
    if interval is None:
        return (0.0, inf), {"damping": Assumed(inf, "N s/m", str(why or "it has no B in N s/m"))}
    low = max(interval[0], 0.0)
    high = max(interval[1], 0.0)
    if isinstance(B, Mapping) and _is_number(B.get("value")) and B.get("verdict") in (None, "identified"):
        return (low, high), {}
    text = f"the upper end of its 95 % interval, {interval[0]:.3g} to {interval[1]:.3g} N s/m"
    return (low, high), {"damping": Assumed(high, "N s/m", text)}


def _of_mass(M: object) -> tuple[tuple[str, str], ...]:
    """A warning of a surface that has a mass of its own, which is in no proof."""
    interval = _of_unit(M, "kg")
    if (
        interval is None
        or not interval[0] > 0.0
        or not isinstance(M, Mapping)
        or M.get("verdict") != "identified"
    ):
        return ()
    text = f"the surface moves a mass of {interval[0]:.3g} to {interval[1]:.3g} kg, which no proof covers: touch slowly"
    return (("surface-mass", text),)


def _parameters(log: object) -> Mapping[str, Any]:
    parameters = log.get("parameters") if isinstance(log, Mapping) else None
    return parameters if isinstance(parameters, Mapping) else {}


def _of_unit(parameter: object, unit: str) -> tuple[float, float] | None:
    """A parameter's interval; None if it has none, or is in another unit."""
    right = isinstance(parameter, Mapping) and parameter.get("unit") in (None, unit)
    return _interval(parameter) if right and isinstance(parameter, Mapping) else None


def _relaxing(parameters: Mapping[str, Any]) -> float:
    """The stiffness that a relaxing solid has beyond K while it is pressed fast [N/m]."""
    interval = _of_unit(parameters.get("K1"), "N/m")
    return max(interval[1], 0.0) if interval else 0.0


def _warnings_of(warnings: object) -> tuple[tuple[str, str], ...]:
    """Warnings of an identification, as far as they are text."""
    entries = warnings if isinstance(warnings, list) else []
    return tuple(
        (w["code"], w["text"] + (_OF_IDENTIFY if "--" in w["text"] else ""))
        for w in entries
        if isinstance(w, Mapping) and isinstance(w.get("code"), str) and isinstance(w.get("text"), str)
    )


def _interval(parameter: Mapping[str, Any]) -> tuple[float, float] | None:
    for key in ("prediction95", "ci95"):
        ends = parameter.get(key)
        if isinstance(ends, list | tuple) and len(ends) == 2 and all(_is_number(end) for end in ends):
            return float(ends[0]), float(ends[1])
    return None


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
