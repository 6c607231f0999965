"""The domain of a slide in closed form: surfaces on which the force stays within 3 % rms and 10 %."""

from __future__ import annotations

from math import sqrt
from typing import Any

from palpate.errors import InputError
from palpate.force.ceiling import force_ceiling
from palpate.force.gains import Gains
from palpate.force.lag import sum_of_lags
from palpate.force.slide_table import Slide
from palpate.force.sliding.slide_law import EXCESS
from palpate.force.sliding.touches import ACROSS, LIGHT, safe_height, slope_of_touches

LIMITS = {"lag": 0.02, "turning": 0.01, "sticking": 0.08, "tilt": 0.07}
"""Largest terms of the domain; measured by benchmarks/force/sliding.py."""
SETTLING = 10.0
"""Lags of the loop until a light press is held: 3 for which it has to stay, and three decays of 1/alpha.
No slide of benchmarks/judge/slide_judge.py begins later than the time that follows."""
LAG_ERROR, CURVATURE_AGE = 5e-3, 0.01
"""Lag that is not known, and age of the curvature where it is used [s]."""


def slide_terms(gains: Gains, stiffness: float, friction: float, radius: float) -> dict[str, float]:
    """Costs of a surface to a slide: terms that are to be below `LIMITS`.

    Args:
        gains: with a table `slide`.
        stiffness: K of the surface [N/m].
        friction: mu.
        radius: of curvature [m].

    Returns:
        The force, as a share of F_d, that a lag not known costs (`lag`) and a curvature that changes (`turning`);
        the path on which the contact sticks over the radius (`sticking`); the change of the normal force before it
        slips (`tilt`).
    """
    slide = numbers_of(gains)
    F = gains.force
    series = gains.arm.seen(stiffness)
    v = slide.speed
    cost = series * gains.theta * v / (gains.alpha * F)
    return {
        "lag": cost * v * LAG_ERROR / radius,
        "turning": cost * (v * (gains.theta + CURVATURE_AGE) / radius) ** 2,
        "sticking": friction * F / (slide.ratio * series * radius),
        "tilt": friction * _slope(gains, series) / slide.ratio,
    }


def _slope(gains: Gains, stiffness: float) -> float:
    """Standard deviation of the normal at the beginning, each way [rad]."""
    slide = numbers_of(gains)
    if slide.touches == 0.0:
        return slide.slope
    unsure = gains.arm.sensor.noise / stiffness
    return min(float(slope_of_touches(slide.touches, unsure, slide.radius**-3)), slide.slope)


def obeys(terms: dict[str, float]) -> bool:
    """True if a surface with these terms is in the domain."""
    return all(terms[name] < limit for name, limit in LIMITS.items())


def lead_of(gains: Gains) -> float:
    """Sum of the lags from a reading to the tip [s]; of a servo what its own lead leaves."""
    return gains.theta if gains.arm.kind == "servo" else sum_of_lags(gains.arm)


def crossing_speed(gains: Gains) -> float:
    """Speed from a touch to the next [m/s]: the arm's, but a surface in the way stays below the force limit."""
    ceiling = force_ceiling(gains.arm, gains.force, gains.force_limit, gains.cap, gains.theta)
    return max(min(gains.speed, ceiling), gains.approach)


def start_time(gains: Gains) -> float:
    """Time from the first contact until the slide begins, at most [s].

    For the softest surface of the domain, which falls away from each touch by two standard deviations of its tilt. A
    way L with the acceleration a up and a/2 down takes sqrt(6 L/a). A press takes the approach to its light force and
    `SETTLING` lags of the loop.
    """
    slide = numbers_of(gains)
    low, _ = slide_domain(gains) or (gains.cap, gains.cap)
    depth = LIGHT * gains.force / gains.arm.seen(low)
    settling = SETTLING * gains.theta
    if slide.touches == 0.0:
        return depth / gains.approach + settling
    after_touches = _slope(gains, gains.arm.seen(low))
    tilts = (
        (slide.slope, slide.touches),
        (slide.slope, ACROSS * slide.touches),
        (after_touches, slide.touches),
    )
    down = sum(float(safe_height(1.0 / slide.radius, tilt, way)) + 2.0 * tilt * way for tilt, way in tilts)
    across = sqrt(6.0 * (slide.touches + depth) / slide.acceleration) + 2.0 * lead_of(gains)
    return 4.0 * settling + 3.0 * across + (depth + down) / gains.approach


def edge_speed(gains: Gains, stiffness: float) -> float:
    """Largest speed at which a step that was not expected costs half of F_d at most on a surface K [m/s].

    On an edge of 45 degrees the force rises by K_eff v L before the tip stops, with the sum L of the lags. That is
    `EXCESS` of F_d here; the rest up to a half is for the detection, the friction and the way on.
    """
    return EXCESS * gains.force / (gains.arm.seen(stiffness) * lead_of(gains))


def slide_domain(gains: Gains) -> tuple[float, float] | None:
    """Stiffnesses between which a slide with friction mu_max on the smallest radius is in the domain [N/m]."""
    slide = numbers_of(gains)
    points = 400
    low = 100.0
    high = gains.cap
    ladder = [low * (high / low) ** (i / points) for i in range(points + 1)] if high > low else []
    inside = [K for K in ladder if obeys(slide_terms(gains, K, slide.mu_max, slide.radius))]
    return (inside[0], inside[-1]) if inside else None


def numbers_of(gains: Gains) -> Slide:
    """The table `slide` of gains.

    Raises:
        InputError: gains without it.
    """
    if gains.slide is None:
        raise InputError("these gains have no numbers for a slide; tune again with --slide --mu-max .9")
    return gains.slide


def slide_json(gains: Gains) -> dict[str, Any]:
    """Numbers and domain as plain values."""
    slide = numbers_of(gains)
    domain = slide_domain(gains)
    return {
        "speed_m_s": slide.speed, "mu_max": slide.mu_max, "slope_std_rad": slide.slope, "radius_m": slide.radius,
        "floor_of_force": (1.0 + slide.mu_max**2) ** 0.5, "domain": {"stiffness": list(domain) if domain else None},
        "edge_speed_m_s": edge_speed(gains, gains.cap), "start_s": start_time(gains),
    }  # fmt: skip


def slide_sentence(gains: Gains) -> str:
    """The domain in a sentence."""
    slide = numbers_of(gains)
    domain = slide_domain(gains)
    least = (
        f"at {1e3 * slide.speed:.3g} mm/s, on radii from {1e3 * slide.radius:.3g} mm, with friction up to "
    )
    floor = (
        f"it begins within {start_time(gains):.2g} s of the first contact; "
        f"on springs no normal, right or wrong, presses harder than {(1.0 + slide.mu_max**2) ** 0.5:.3g} times the "
        "force at rest: a surface that stiffens, or a sensor's bias, adds to that; "
        f"a step costs half the force at most up to {1e3 * edge_speed(gains, gains.cap):.2g} mm/s on "
        f"{gains.cap / 1e3:.4g} kN/m"
    )
    if domain is None:
        better = "slow down, or give a better normal"
        return f"no surface lies in the domain of a slide {least}{slide.mu_max:g}: {better}; {floor}"
    low, high = (f"{end / 1e3:.4g}" for end in domain)
    return f"the domain of a slide is {low} to {high} kN/m {least}{slide.mu_max:g}; {floor}"
