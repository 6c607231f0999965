"""Phases and endings of a run, and its summary: outcome, force, limits of the motors, estimates and the truth."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.records import Record
from palpate.signals.samples import detrend

APPROACH, CONTACT, LOST, RETREAT = 0.0, 1.0, 2.0, 4.0  # 3 is a slide over a wire
PHASES = {APPROACH: "approach", CONTACT: "contact", LOST: "lost contact", RETREAT: "retreat"}
DONE, NO_CONTACT, DIVERGED, LOST_CONTACT, INTERRUPTED = (
    "done",
    "no contact",
    "diverged",
    "lost contact",
    "interrupted",
)
BAND = 0.05
"""Fraction of the desired force within which a force counts as settled."""
TICK_ROUNDING = 5e-7
"""Tolerance for times that are multiples of a tick [s]."""
MIN_SPECTRUM_SAMPLES = 64
"""Samples from which on a spectrum separates a period from a trend."""
WINDOW = 1.0
"""Time before the end over which steady figures are averaged [s]."""
STAY, STAY_FRACTION = 0.5, 0.1
"""Settled: inside the band until the end, for so long [s], and for this fraction of the press at least."""
STEADY = 0.02
"""Steady: a standard deviation of at most this fraction of the desired force."""
JOINTS = (1, 2, 3)
FRONT_ENDS = ("thesis", "raw", "matched")
IDENTIFIER = "identifier"
"""Prefix of the columns of an experiment's additional identifier."""
PARAMETERS = {"K": "N/m", "B": "N s/m", "M": "kg"}


@dataclass(frozen=True)
class Ending:
    """Reason of a run's end.

    Args:
        end: the stable word.
        why: a sentence with the time.
    """

    end: str
    why: str


def summarise(record: Record) -> dict[str, Any]:
    """Plain JSON values: outcome, force, motor limits, estimates, and the truth."""
    pressing = record["phase"] == CONTACT
    t = record["t"]
    summary: dict[str, Any] = {
        "end": record.meta["end"],
        "why": record.meta["why"],
        "seed": record.meta["seed"],
        "duration_s": float(t[-1]) if len(t) else 0.0,
        "contact_at_s": float(t[np.argmax(pressing)]) if pressing.any() else None,
        "contacts_lost": losses(record),
        "force": None,
        "tip": None,
        "saturated": {f"joint{i}": _share(record[f"saturated{i}"]) for i in JOINTS},
        "identified": None,
        "truth": record.meta["truth"],
    }
    if pressing.any():
        last = pressing & (t > t[pressing][-1] - WINDOW)
        summary["force"] = force_figures(record, pressing, last)
        summary["tip"] = {
            "y_error_mm": 1e3 * float(np.mean((record["y"] - record["y_desired"])[last])),
            "phi_error_deg": float(np.degrees(np.mean((record["phi"] - record["phi_desired"])[last]))),
        }
        summary["identified"] = _final_estimates(record, last)
    return summary


def losses(record: Record) -> int:
    """Number of times that contact was lost."""
    phase = record["phase"]
    return int(np.sum((phase[1:] == LOST) & (phase[:-1] == CONTACT)))


def _finite_or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _share(flags: Array) -> float:
    return float(np.mean(flags)) if len(flags) else 0.0


def force_figures(record: Record, pressing: Mask, last: Mask) -> dict[str, Any]:
    """Errors of the true force, which only a simulation knows, and the noise of the measured force.

    Args:
        record: with the columns t, force, force_desired and force_measured.
        pressing: where the force is controlled, shape (n,).
        last: where it counts as steady, shape (n,).
    """
    error = record["force"] - record["force_desired"]
    desired = record["force_desired"][pressing]
    steady = slice(0, _first_change(desired))
    stepped = steady.stop > 1 or len(desired) == 1  # of a sine there is neither settling nor overshoot
    since, force = record["t"][pressing][steady] - record["t"][pressing][0], record["force"][pressing][steady]
    target = float(desired[0])
    outside = np.abs(force - target) > BAND * abs(target)
    return {
        "desired_N": float(desired[-1]),
        "mean_N": float(np.mean(record["force"][last])),
        "error_N": float(np.mean(error[last])),
        "std_N": float(np.std(record["force"][last])),
        "measured_std_N": float(np.std(record["force_measured"][last])),
        "rms_error_N": float(np.sqrt(np.mean(error[pressing] ** 2))),
        "settling_s": settling_time(since, outside) if stepped else None,
        "overshoot_N": max(0.0, float(np.max(force)) - target) if stepped else None,
        "ringing": ringing(record["t"][last], record["force"][last], record["force_desired"][last]),
    }


def settling_time(since: Array, outside: Mask) -> float | None:
    """Time from which on a force stays inside its band [s]; None if it does not stay long enough.

    Args:
        since: time since the touch [s], shape (n,).
        outside: whether the force is outside the band, shape (n,).
    """
    if not len(since) or outside[-1]:
        return None
    settled = float(since[np.max(np.nonzero(outside)[0], initial=-1) + 1])
    stay = max(STAY, STAY_FRACTION * float(since[-1]))
    return settled if since[-1] - settled >= stay - TICK_ROUNDING else None


def ringing(t: Array, force: Array, desired: Array) -> dict[str, float] | None:
    """The oscillation of a force that is to be constant; None where it is steady, or varies without a period.

    It rings if more than half of the variance about its trend lies within an octave around one frequency, of which
    the samples hold two periods or more. The amplitude is half of the range of 95 % of the samples.

    Args:
        t: time [s], shape (n,), at one rate.
        force: shape (n,) [N].
        desired: the desired force, shape (n,) [N].
    """
    n = len(t)
    if n < MIN_SPECTRUM_SAMPLES or np.any(desired != desired[-1]):
        return None
    swing = detrend(force)
    if not np.std(swing) > STEADY * abs(desired[-1]):
        return None
    power = np.abs(np.fft.rfft(swing * np.hanning(n))) ** 2
    power[:2] = 0.0
    peak = int(np.argmax(power))
    octave = slice(int(np.ceil(peak / np.sqrt(2.0))), int(np.sqrt(2.0) * peak) + 1)
    if power[octave].sum() <= 0.5 * power.sum():
        return None
    low, high = np.quantile(swing, (0.025, 0.975))
    return {
        "amplitude_N": float(high - low) / 2.0,
        "frequency_Hz": peak * (n - 1) / (n * float(t[-1] - t[0])),
    }


def _first_change(values: Array) -> int:
    changed = np.nonzero(values != values[0])[0]
    return int(changed[0]) if len(changed) else len(values)


def _final_estimates(record: Record, last: Mask) -> dict[str, Any]:
    """The estimates at the end, the quotient f/x, and the standard deviations that the matched one states.

    They take the surface for a spring, a damper and a mass; whether it is one, `palpate.identify` says of the record.
    """
    end = int(np.nonzero(last)[0][-1])
    estimates: dict[str, Any] = {
        front: {p: float(record[f"{p}_{front}"][end]) for p in PARAMETERS} for front in FRONT_ENDS
    }
    if "K_identifier" in record.columns:
        estimates[IDENTIFIER] = {p: _finite_or_none(record[f"{p}_{IDENTIFIER}"][end]) for p in PARAMETERS}
        estimates[f"{IDENTIFIER}_std"] = {
            p: _finite_or_none(record[f"{p}_{IDENTIFIER}_std"][end]) for p in PARAMETERS
        }
    estimates["matched_std"] = {p: float(record[f"{p}_matched_std"][end]) for p in PARAMETERS}
    displacement = float(np.mean(record["displacement"][last]))
    force = float(np.mean(record["force_measured"][last]))
    estimates["force_over_displacement"] = {"K": force / displacement if displacement else None}
    return estimates
