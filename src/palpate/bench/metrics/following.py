"""Metrics of force tracking."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from palpate.bench.metrics.summary import BAND
from palpate.bench.metrics.window import SETTLE, Look, Metric, Value, rms

LIMIT = 1.5
"""Largest RMS error of a force that follows [N]: 10 % of 15 N, which is what is asked for on average."""
LEAST: Literal["least"] = "least"
SHARE = 0.10
"""Largest mean error in the last second of an interval, as a share of the desired force there."""


def _mean_error(look: Look) -> Value:
    return float(np.mean(look.error)) if len(look.error) else None


def _std(look: Look) -> Value:
    return float(np.std(look.error)) if len(look.error) else None


def interval_error(look: Look) -> Value:
    """The largest mean error in the last second of an interval, as a share of the desired force there."""
    shares = [abs(float(np.mean(error))) / abs(float(np.mean(desired))) for error, desired in look.intervals]
    return max(shares, default=None)


def settled_rms(look: Look) -> Value:
    """RMS error outside the first half second after each step [N]."""
    return rms(look.after_steps) if len(look.after_steps) else None


def _of_force(key: str) -> Metric:
    unit, text = {
        "settling_s": (
            "s",
            "time from the switch until the force stays within 5 % of its first desired value, 0.5 s at least",
        ),
        "overshoot_N": ("N", "overshoot of the force over its first desired value, before the next"),
    }[key]
    name = key.rpartition("_")[0]

    def of(look: Look) -> Value:
        force = look.summary["force"]
        return None if force is None else force[key]

    return Metric(name, unit, text, of, better=LEAST)


def _settles(look: Look) -> Value:
    force = look.summary["force"]
    return None if force is None else float(force["settling_s"] is not None)


def _overshoot_share(look: Look) -> Value:
    force = look.summary["force"]
    if force is None or force["overshoot_N"] is None:
        return None
    return float(force["overshoot_N"]) / float(look.record["force_desired"][look.pressing][0])


def _ringing(key: str) -> Callable[[Look], Value]:
    def of(look: Look) -> Value:
        force = look.summary["force"]
        return None if force is None else (force["ringing"] or {}).get(key, 0.0 if "_N" in key else None)

    return of


def rings(look: Look) -> bool:
    """Whether the force oscillates at the end by more than the band within which it counts as settled."""
    force = look.summary["force"]
    found = force and force["ringing"]
    return bool(found and found["amplitude_N"] > BAND * abs(force["desired_N"]))


def _peak(look: Look) -> Value:
    return float(np.max(look["force"])) if len(look.error) else None


def _bandwidth(look: Look) -> Value:
    """Slope of the controller's memory over the integral of the measured force error."""
    t = look.record["t"][look.inside]
    if len(t) < 3:
        return None
    error = look["force_desired"] - look["force_measured"]
    integral = np.cumsum(error)[:-1] * (t[1] - t[0])
    return float(np.polyfit(integral, look["memory_fx"][1:], 1)[0])


FOLLOWING = (
    Metric(
        "force_rms",
        "N",
        "RMS of the true force's error, steps included",
        lambda look: rms(look.error),
        better=LEAST,
    ),
    Metric(
        "force_rms_settled",
        "N",
        f"the same without the first {SETTLE:g} s after each step",
        settled_rms,
        better=LEAST,
    ),
    Metric("force_error", "N", "mean error of the true force", _mean_error, signed=True),
    Metric("force_std", "N", "standard deviation of that error", _std, better=LEAST),
    Metric(
        "interval_error",
        "1",
        "largest mean error in the last second of an interval between steps, as a share of the desired force",
        interval_error,
        better=LEAST,
    ),
    Metric("peak_force", "N", "largest true force", _peak, better=LEAST),
    _of_force("settling_s"),
    _of_force("overshoot_N"),
    Metric(
        "settles",
        "1",
        "whether the force settles within 5 % of its first desired value",
        _settles,
        ("no", "yes"),
    ),
    Metric(
        "ring_amplitude",
        "N",
        "amplitude of the force's oscillation in the last second; 0 where it is steady or has no period",
        _ringing("amplitude_N"),
        better=LEAST,
    ),
    Metric("ring_frequency", "Hz", "frequency of that oscillation", _ringing("frequency_Hz")),
    Metric("overshoot_share", "1", "overshoot as a share of the first desired force", _overshoot_share),
    Metric(
        "integral_gain",
        "1/s",
        "slope of the controller's integrated force command over the integral of the force error",
        _bandwidth,
    ),
)
"""Metrics of the force in contact."""
