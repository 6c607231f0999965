"""A hum or a ripple of the force in free motion: the stiffness holds behind it, and a clean log is as it was."""

from __future__ import annotations

import numpy as np
import pytest

import palpate
from palpate.records import Record

UNITS = {"time": "s", "position": "m", "force": "N"}


def pressed(seed, kind):
    """Ramps onto a spring with a disturbance of 2 to 20 % of the peak: hum in time, ripple in time or over place.

    Args:
        seed: of everything that is random.
        kind: `hum` (50 or 60 Hz), `time` (1.5 to 6 Hz), `place` (periods of 0.3 to 1.2 mm) or `clean`.

    Returns:
        The log, and its stiffness.
    """
    rng = np.random.default_rng(seed)
    rate = rng.choice([200, 500, 1000])
    stiffness, deep = 10 ** rng.uniform(2.5, 4.3), rng.uniform(1e-3, 4e-3)
    free, loading = rng.uniform(2e-3, 4e-3), rng.uniform(1.0, 4.0)
    times, places = [0.0], [-free]
    for _ in range(rng.integers(1, 4)):
        for place, seconds in ((-free, rng.uniform(0.5, 1.5)), (deep, loading), (-free, 0.8 * loading)):
            times.append(times[-1] + seconds)
            places.append(place)
    time = np.arange(0, times[-1] + 1, 1 / rate)
    window = np.hanning(int(0.05 * rate) + 2)
    x = np.interp(time, times, places)
    x = np.convolve(np.pad(x, len(window), mode="edge"), window / window.sum(), "same")[
        len(window) : -len(window)
    ]
    force = stiffness * np.maximum(x, 0)
    peak = stiffness * deep
    force += peak * 10 ** rng.uniform(-3.3, -2.3) * rng.standard_normal(len(time))
    size, phase = peak * 10 ** rng.uniform(-1.7, -0.7), rng.uniform(0, 2 * np.pi)
    turns = {
        "hum": rng.choice([50, 60]) * (1 + rng.uniform(-1e-3, 1e-3)) * time,
        "time": rng.uniform(1.5, 6) * time,
        "place": x / rng.uniform(3e-4, 1.2e-3),
    }
    if kind in turns:
        force += size * np.sin(2 * np.pi * turns[kind] + phase)
    return Record({"time": time, "position": x, "force": force}, UNITS, {}), stiffness


def holds(parameter, value):
    low, high = parameter.ci95
    return low <= value <= high


@pytest.mark.parametrize(("seed", "kind"), [(2, "time"), (5, "place")])
def test_a_ripple_is_removed_and_said(seed, kind):
    log, stiffness = pressed(seed, kind)
    result = palpate.identify(log)
    assert "force-ripples" in result.codes
    assert holds(result.K, stiffness)
    assert result.K.verdict == "identified"
    assert "ripple" in result.working_point.stiffness.budget


def test_a_clean_log_has_no_ripple():
    log, stiffness = pressed(2, "clean")
    result = palpate.identify(log)
    assert "force-ripples" not in result.codes
    assert "ripple" not in result.K.budget
    assert holds(result.K, stiffness)


@pytest.mark.long
def test_the_stiffness_holds_in_90_percent_of_40_logs():
    results = [
        (palpate.identify(log), K)
        for kind in ("hum", "time")
        for log, K in (pressed(s, kind) for s in range(100, 120))
    ]
    assert sum(holds(result.K, K) for result, K in results) >= 36
    assert sum(holds(result.working_point.stiffness, K) for result, K in results) >= 36
    assert sum(result.K.verdict == "identified" for result, _ in results) >= 36
