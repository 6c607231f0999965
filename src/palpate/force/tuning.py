"""Tuning: gains from an arm and a surface, their predicted performance, and where they are proved."""

from dataclasses import asdict, dataclass, field, replace
from math import inf, isfinite
from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop
from palpate.force.certificate import FORM, Certificate
from palpate.force.certifying import certify, exact_interval
from palpate.force.expected import (
    OVERSHOOT,
    RISES,
    SOFT_TISSUE,
    STIFFENING_AT,
    Margins,
    PressTime,
    Step,
    margins,
    press_time,
    rise,
    settling_bound,
    softest,
    step_of,
    stiffening,
)
from palpate.force.gains import Gains, gains_for, known_lag
from palpate.force.known_surface import Known
from palpate.force.lag import MIN_STIFFNESS, sum_of_lags
from palpate.records import Result

RIGID = 1e9
"""Largest stiffness that is printed [N/m]; stiffer surfaces are shown as this."""


@dataclass(frozen=True, eq=False, repr=False)
class Tuning(Result):
    """A tuned loop: what `palpate tune` says.

    Args:
        gains: what `ForceLoop` takes.
        known: of the surface, if anything.
        certificate: what is proved.
        steps: the touch on the softest and on the stiffest surface, K_u being their stiffness.
        margins: on the stiffest surface.
        warnings: code and text.
    """

    gains: Gains
    known: Known | None
    certificate: Certificate
    steps: tuple[Step, Step]
    margins: Margins
    warnings: tuple[tuple[str, str], ...] = field(default=())

    @property
    def proved(self) -> bool:
        """True if any surface is proved stable."""
        return any(c.kind != "adapting" for c in self.certificate.claims)

    @property
    def overshoot(self) -> float:
        """Over F_d, at the worse of the two ends."""
        return max(step.overshoot for step in self.steps)

    @property
    def peak(self) -> float:
        """Force to expect at the touch [N], by the linear loop; a formula, not a bound."""
        gains = self.gains
        peak = gains.force * (1.0 + self.overshoot)
        inner = gains.arm.inner
        if not isinstance(inner, PositionLoop):
            peak = max(peak, gains.approach * float(np.sqrt(gains.cap * inner.mass)))
        return peak

    def surface_stiffness(self, kind: str) -> tuple[float, float] | None:
        """The proved interval of K + B/theta of the surface itself for a kind of claim [N/m]."""
        for claim in self.certificate.claims:
            if claim.kind == kind or (kind == "held" and claim.kind == "one-sided"):
                return surface_ends(self.gains.arm, claim.low, claim.high)
        return None

    @property
    def price(self) -> tuple[float, float] | None:
        """Time that F_max costs on the softest surface [s], and that surface's stiffness [N/m]; None without F_max.

        The command travels to the force at the speed that F_max allows, not at the arm's.
        """
        gains, stiffness = self.gains, self.softest
        if gains.force_max is None:
            return None
        return gains.force / stiffness * (1.0 / gains.speed - 1.0 / gains.arm.limits.speed), stiffness

    @property
    def softest(self) -> float:
        """The softest surface that is known of, or a soft tissue [N/m]."""
        return min(self.known.stiffness[0] if self.known else SOFT_TISSUE, self.gains.cap)

    @property
    def soft_press(self) -> PressTime:
        """Time of a press on the softest surface."""
        return press_time(self.gains, self.softest)

    @property
    def exact(self) -> tuple[float, float]:
        """The surfaces without damping on which the loop with K_u = cap is stable [N/m]; exact for a position arm."""
        return surface_ends(self.gains.arm, *exact_interval(self.gains))

    @property
    def domain(self) -> tuple[float, float] | None:
        """Surfaces on which more than 99.9 % of first touches stay below `expected.OVERSHOOT` [N/m]; None for none.

        More than 99 % settle there in `expected.settling_bound`, its last term left out.
        """
        low = softest(self.gains)
        return (low, self.gains.cap) if low < self.gains.cap else None

    def _domain_json(self) -> dict[str, Any] | None:
        if self.domain is None:
            return None
        seconds = [settling_bound(self.gains, K) - RISES * rise(self.gains, K) for K in self.domain]
        return {"stiffness": list(self.domain), "overshoot": OVERSHOOT, "settling_s": seconds}

    def to_json(self) -> dict[str, Any]:
        """The answer of `palpate tune --json`."""
        gains = self.gains
        arm = self.gains.arm
        held = next((c for c in self.certificate.claims if c.kind != "adapting"), None)
        adapting = next((c for c in self.certificate.claims if c.kind == "adapting"), None)
        known = self.known
        return {
            "arm": arm.title,
            "kind": arm.kind,
            "rate_hz": arm.rate,
            "theta_s": gains.theta,
            "lags_added_s": sum_of_lags(arm),
            "gains": {
                "law": gains.law,
                "alpha": gains.alpha,
                "force_N": gains.force,
                "stiffness_cap": gains.cap,
                "gain_at_cap_m_per_s_N": gains.gain,
                "force_limit_N": gains.force_limit,
            },
            "approach_speed_m_s": gains.approach,
            "speed_m_s": gains.speed,
            "force_max": gains.force_max,
            "price_s": None if self.price is None else self.price[0],
            "soft_press": asdict(self.soft_press),
            "peak_N": self.peak,
            "settling_s": _number(max(step.settling for step in self.steps)),
            "overshoot": self.overshoot,
            "margins": {
                "gain": self.margins.gain,
                "phase_deg": _number(self.margins.phase),
                "delay_s": _number(self.margins.delay),
            },
            "proved": {
                "stiffness": list(self.surface_stiffness("held") or ()) or None,
                "damping_time": [held.least, held.most] if held else None,
                "jitter_ticks": adapting.jitter(self.gains) if adapting else 0,
                "ages_ticks": list(adapting.ages) if adapting else None,
                "adapting": None
                if adapting is None
                else {
                    "gain_share": list(adapting.shares),
                    "damping_time": [adapting.least, adapting.most],
                    "stiffness": list(self.surface_stiffness("adapting") or ())
                    if arm.kind != "position"
                    else "every",
                },
            },
            "exact": {"stiffness": list(self.exact)},
            "domain": self._domain_json(),
            "stiffening": [
                {"error": e, "times": stiffening(gains, self.steps[1], e), "overshoot": OVERSHOOT}
                for e in STIFFENING_AT
            ],
            "estimate": None if known is None else known.to_json(),
            "assumed": {}
            if known is None
            else {name: assumed.to_json() for name, assumed in known.assumed.items()},
            "warnings": [{"code": code, "text": text} for code, text in self.warnings],
        }


def surface_ends(arm: Arm, low: float, high: float) -> tuple[float, float]:
    """Stiffness of the surfaces [N/m] that together with a position arm's own have these; at most `RIGID`."""
    return (low, high) if arm.kind != "position" else (arm.surface(low), min(arm.surface(high), RIGID))


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def tune(
    arm: Arm,
    force: float,
    known: Known | None = None,
    *,
    cap: float | None = None,
    force_max: float | None = None,
    prove_adapting: bool = True,
    theta: float | None = None,
) -> Tuning:
    """Gains for an arm that presses with a force, and what is proved of them.

    Args:
        arm: what moves.
        force: F_d, the smallest that will be asked for [N].
        known: of the surface; the arm's own limit of stiffness if nothing is.
        cap: stiffest surface that there may be, K + B/theta [N/m]; by default what is known, or the arm's limit.
        force_max: F_max, which the force shall not exceed on layers or after a false touch [N]; see `force.ceiling`.
        prove_adapting: prove the adapting law too, which takes a torque arm some two seconds.
        theta: whole lag of the loop [s]; the arm's own if left out.

    Raises:
        InputError: numbers that cannot be met, with what can.
    """
    _check(force, known, cap)
    theta = known_lag(arm) if theta is None else theta
    known = None if known is None else known.beyond(arm)
    farther = () if known is None or cap is not None else _beyond_log(arm, known, force)
    stiffest = arm.limits.stiffness if farther else _cap(arm, known, cap, theta)
    gains = gains_for(arm, force, cap=stiffest, theta=theta, force_max=force_max)
    soft = _softest(known, stiffest)
    felt = arm.seen(soft) if arm.kind == "position" else soft
    steps = step_of(gains, felt), step_of(gains, gains.seen_cap)
    nothing = Certificate(form=FORM, gains=gains, claims=())
    at = margins(gains, gains.seen_cap)
    tuning = Tuning(gains, known, nothing, steps, at, (*farther, *_warnings(arm, known, at.gain)))
    tuning = replace(tuning, certificate=certify(gains, adapting=prove_adapting))
    if not tuning.proved and isinstance(arm.inner, PositionLoop) and arm.inner.bandwidth_interval is not None:
        text = (
            "nothing is proved for all that the inner loop may be: record more steps or a wider sweep, so that its "
            "intervals are narrower"
        )
        tuning = replace(tuning, warnings=(*tuning.warnings, ("inner-loop-wide", text)))
    return tuning


def _softest(known: Known | None, cap: float) -> float:
    """The softest surface that is known of, or that there may be [N/m]."""
    return min(known.stiffness[0] if known else MIN_STIFFNESS, cap)


def _check(force: float, known: Known | None, cap: float | None) -> None:
    if not 0.0 < force < inf:
        raise InputError(f"the force must be above 0 N (it presses), got {force:g} N")
    if known is not None and not 0.0 < known.stiffness[0] <= known.stiffness[1] < inf:
        low, high = known.stiffness
        raise InputError(
            f"the stiffness must be an interval above 0 N/m with its lower end first, got {low:g} to {high:g} N/m"
        )
    if cap is not None and not 0.0 < cap < inf:
        raise InputError(f"the stiffness cap must be above 0 N/m, got {cap:g} N/m")


def _cap(arm: Arm, known: Known | None, cap: float | None, theta: float) -> float:
    if known is None:
        return arm.limits.stiffness if cap is None else cap
    if cap is None and "damping" in known.assumed and not isfinite(known.damping[1]):
        raise InputError(
            f"{known.source} does not bound the damping B ({known.assumed['damping'].why}); "
            "give the highest that there may be with --damping-max, as --damping-max 200 (N s/m)"
        )
    damping = known.damping[1] if isfinite(known.damping[1]) else 0.0
    needed = known.stiffness[1] + damping / theta
    if cap is not None and cap < needed:
        raise InputError(
            f"the stiffness cap of {cap:g} N/m is below what was identified, K + B/theta up to {needed:.4g} N/m; "
            "raise it"
        )
    return needed if cap is None else cap


MAX_FORCE_RATIO = 2.0
"""Force of a press over that of a log, up to which the log's stiffness stands for that of the press.
The stiffness of a force that is a power of the depth grows no faster than the force, and the adapting law's proof bears
one that is twice as high."""


def _beyond_log(arm: Arm, known: Known, force: float) -> tuple[tuple[str, str], ...]:
    """A warning if the force is far beyond that of the log: the arm's own limit of stiffness is the cap then."""
    if known.force is None or force <= MAX_FORCE_RATIO * known.force:
        return ()
    text = (
        f"the log presses with {known.force:.3g} N, and {force:g} N are asked for: a surface may stiffen, so that the "
        f"arm's own limit of {arm.limits.stiffness:.3g} N/m is the cap; record a press of "
        f"{force / MAX_FORCE_RATIO:.3g} N or more, or give --stiffness-cap"
    )
    return (("force-beyond-log", text),)


def _warnings(arm: Arm, known: Known | None, margin: float) -> list[tuple[str, str]]:
    warnings = []
    if known is not None and known.source != "told" and known.stiffness[1] > margin * known.stiffness[0]:
        low, high = known.stiffness
        text = (
            f"the estimate's interval of {low:.4g} to {high:.4g} N/m is wider than the gain margin of {margin:.2g}: "
            f"excite more (palpate excite --stiffness {low:.3g}:{high:.3g} says how), or leave it to the law"
        )
        warnings.append(("wide-estimate", text))
    if arm.delay_ticks > arm.longest_delay * arm.rate + 1e-6:
        late = f"{1e3 * arm.longest_delay:.4g} ms"
        text = f"the delay of {late} is no whole number of ticks; {arm.delay_ticks} were taken"
        warnings.append(("delay-rounded", text))
    if known is not None:
        warnings += known.warnings
    return warnings
