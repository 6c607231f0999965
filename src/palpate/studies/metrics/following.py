"""Metrics of force tracking, of contact and motors, and of the final estimates against the truth."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from palpate.bench.summary import BAND, FRONT_ENDS, IDENTIFIER, LOST, PARAMETERS, losses
from palpate.studies.metrics.window import SETTLE, Metric, Value, Window, rms

JOINTS = (1, 2, 3)


def _time_to_loss(window: Window) -> Value:
    """Time from the first contact to its first loss, or to where numbers are none [s]; None if it is kept."""
    if not window.touched:
        return None
    lost = np.flatnonzero((window.record["phase"] == LOST) & (window.since > 0.0))
    if len(lost):
        return float(window.since[lost[0]])
    return float(window.since[-1]) if window.ended else None


def _time_in_contact(window: Window) -> Value:
    """Time from the first contact to its first loss, or to the end of the run [s]."""
    if not window.touched:
        return 0.0
    lost = _time_to_loss(window)
    return float(window.since[-1]) if lost is None else lost


def _saturation(window: Window) -> Value:
    if not len(window.error):
        return None
    return max(float(np.mean(window[f"saturated{joint}"])) for joint in JOINTS)


CONTACT_METRICS = (
    Metric(
        "contacts_lost",
        "1",
        "number of losses of contact",
        lambda window: float(losses(window.record)),
        better="least",
    ),
    Metric(
        "time_in_contact",
        "s",
        "from the first contact to its first loss, or to the end",
        _time_in_contact,
        better="most",
    ),
    Metric(
        "saturation",
        "1",
        "share of the time that a motor is at its limit, the worst one",
        _saturation,
        better="least",
    ),
    Metric(
        "hidden_weights",
        "1",
        "norm of a neural controller's weights into the first hidden layer, at the end",
        lambda window: float(window.record["adapted1"][-1]) if window.touched else None,
    ),
)
"""Metrics of contact, motors and pose."""


LIMIT = 1.5
"""Largest RMS error of a force that follows [N]: 10 % of 15 N, which is what is asked for on average."""
LEAST: Literal["least"] = "least"
SHARE = 0.10
"""Largest mean error in the last second of an interval, as a share of the desired force there."""


def _std(window: Window) -> Value:
    return float(np.std(window.error)) if len(window.error) else None


def interval_error(window: Window) -> Value:
    """The largest mean error in the last second of an interval, as a share of the desired force there."""
    shares = [
        abs(float(np.mean(error))) / abs(float(np.mean(desired))) for error, desired in window.intervals
    ]
    return max(shares, default=None)


def settled_rms(window: Window) -> Value:
    """RMS error outside the first half second after each step [N]."""
    return rms(window.after_steps) if len(window.after_steps) else None


def _of_force(key: str) -> Metric:
    unit, text = {
        "settling_s": (
            "s",
            "time from the switch until the force stays within 5 % of its first desired value, 0.5 s at least",
        ),
        "overshoot_N": ("N", "overshoot of the force over its first desired value, before the next"),
    }[key]
    name = key.rpartition("_")[0]

    def of(window: Window) -> Value:
        force = window.summary["force"]
        return None if force is None else force[key]

    return Metric(name, unit, text, of, better=LEAST)


def rings(window: Window) -> bool:
    """True if the force oscillates at the end by more than the band within which it counts as settled."""
    force = window.summary["force"]
    ringing = force and force["ringing"]
    return bool(ringing and ringing["amplitude_N"] > BAND * abs(force["desired_N"]))


def _peak(window: Window) -> Value:
    return float(np.max(window["force"])) if len(window.error) else None


def _bandwidth(window: Window) -> Value:
    """Slope of the controller's memory over the integral of the measured force error."""
    t = window.record["t"][window.inside]
    if len(t) < 3:
        return None
    error = window["force_desired"] - window["force_measured"]
    integral = np.cumsum(error)[:-1] * (t[1] - t[0])
    return float(np.polyfit(integral, window["memory_fx"][1:], 1)[0])


FOLLOWING = (
    Metric(
        "force_rms",
        "N",
        "RMS of the true force's error, steps included",
        lambda window: rms(window.error),
        better=LEAST,
    ),
    Metric(
        "force_rms_settled",
        "N",
        f"the same without the first {SETTLE:g} s after each step",
        settled_rms,
        better=LEAST,
    ),
    Metric("force_std", "N", "standard deviation of the true force's error", _std, better=LEAST),
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
        "integral_gain",
        "1/s",
        "slope of the controller's integrated force command over the integral of the force error",
        _bandwidth,
    ),
)
"""Metrics of the force in contact."""


QUOTIENT = "force_over_displacement"
TOLD = {
    "thesis": "recursive least squares on the thesis' signals",
    "raw": "recursive least squares on raw signals",
    "matched": "recursive least squares on channels of equal lag",
    IDENTIFIER: "the experiment's [identifier]",
    QUOTIENT: "force over displacement",
}


def estimate(front: str, parameter: str) -> Callable[[Window], Value]:
    """An estimate at the end of a run, in SI units; None without contact."""

    def of(window: Window) -> Value:
        identified = window.summary["identified"]
        return None if identified is None else identified.get(front, {}).get(parameter)

    return of


def error(front: str, parameter: str) -> Callable[[Window], Value]:
    """The estimate over the truth, less one; None where the surface has no such parameter."""
    estimated = estimate(front, parameter)

    def of(window: Window) -> Value:
        truth, value = window.summary["truth"].get(parameter), estimated(window)
        if truth is None or value is None or not truth["value"]:
            return None
        return float(value / truth["value"] - 1.0)

    return of


def _pair(front: str, parameter: str, unit: str) -> tuple[Metric, Metric]:
    name = "quotient" if front == QUOTIENT else front
    return (
        Metric(f"{parameter}_{name}", unit, f"{parameter} by {TOLD[front]}", estimate(front, parameter)),
        Metric(
            f"{parameter}_error_{name}",
            "1",
            f"error of {parameter}, as a fraction of the truth",
            error(front, parameter),
            signed=True,
        ),
    )


SURFACE = (
    *(
        m
        for front in (*FRONT_ENDS, IDENTIFIER)
        for parameter, unit in PARAMETERS.items()
        for m in _pair(front, parameter, unit)
    ),
    *_pair(QUOTIENT, "K", PARAMETERS["K"]),
)
"""Metrics of the estimators."""
