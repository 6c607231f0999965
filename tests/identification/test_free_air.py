"""Where the probe is in free motion is found by position; a force that moves there is taken out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.synthetic_contacts import coloured, force_of, pressed, record
from palpate.identification import identify
from palpate.identification.free_motion import Drift, find_free_motion
from palpate.logs import read_log

PRESS = Path(__file__).parents[2] / "examples" / "data" / "press.csv"
TIME = np.arange(8000) / 1000


def hinge(depth: float, noise: float, n: float = 1.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A slow sine over 4 mm whose lowest `depth` is air: force and position."""
    x = 2e-3 - 2e-3 * np.cos(2 * np.pi * 0.5 * TIME)
    force = 20 * (np.maximum(x - depth, 0) / (4e-3 - depth)) ** n
    return force + coloured(len(TIME), noise, 0.9, np.random.default_rng(seed)), x


def ends(force: np.ndarray) -> tuple[float, float]:
    return float(force.min()), float(force.max())


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_air_lies_where_the_force_stays(way, sign):
    force, x = hinge(1e-3, 0.05)
    air = find_free_motion(sign * force + 3.0, way * x, ends(sign * force + 3.0))
    assert air is not None
    assert air.way == way
    assert air.rest == pytest.approx(3.0, abs=0.05)
    assert not air.drifts


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_surface_that_is_never_left_has_no_air(n, seed):
    """The probe turns where a quarter of the depth is still pressed: 6 % of the force for n = 2."""
    x = 2.5e-3 - 1.5e-3 * np.cos(2 * np.pi * 0.5 * TIME)
    force = 20 * (x / 4e-3) ** n + coloured(len(TIME), 0.05, 0.9, np.random.default_rng(seed))
    assert find_free_motion(force, x, ends(force)) is None


def test_a_short_stretch_of_air_at_the_begin_is_seen():
    """A tenth of a second of eight, and a tenth of the way: the touch itself is within 5 % of the force."""
    log = read_log(PRESS, time="time_s", position="position_mm:mm", force="force_N:N")
    found = identify(log)
    assert "contact-at-start" not in found.codes
    assert found.working_point is not None
    assert found.working_point.depth_m == pytest.approx(2.2e-3, rel=0.1)


@pytest.mark.parametrize(
    ("ramp", "every"),
    [
        (0.06, 8),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((0.06, 2), (0.06, 4), (0.3, 2), (0.3, 4), (0.3, 8))
        ),
    ],
)
def test_a_held_position_leaves_the_surface_all_the_same(every, ramp):
    held = []
    for seed in range(3):
        log = pressed(ramp=ramp, seed=seed)
        position = np.repeat(log["position"][::every], every)[: len(log)]
        found = identify(record(log["time"], position, log["force"]))
        assert "contact-at-start" not in found.codes
        low, high = found.parameters["K"].ci95
        held.append(low < 5000 < high)
    assert sum(held) >= 2  # of 95 % intervals: fewer would be chance in one of 140 such logs


@pytest.mark.long
def test_many_presses_are_as_many_contacts():
    """In contact for more than half of the time, and in free motion for half a second at a time."""
    t = np.arange(int(60 * 1.6 * 125)) / 125
    x = np.interp(t % 1.6, [0, 0.2, 0.45, 1.15, 1.4, 1.6], [-1e-3, -1e-3, 3e-3, 3e-3, -1e-3, -1e-3])
    force = force_of(x, lambda d, v: 2000 * d + 8 * v, 1 / 125)
    force += np.random.default_rng(0).normal(0, 0.03, len(t))
    assert len(identify(record(t, x, force)).contacts) == 60


def test_a_drift_bends_between_its_stays_as_a_random_walk_does():
    drift = Drift(np.array([0.0, 4.0, 6.0]), np.array([1.0, 3.0, 4.0]))
    walk = (2.0**2 + 1.0**2) / 6  # N^2/s
    times = np.linspace(0.0, 6.0, 1201)
    bends = drift.bends(times)
    assert bends[[0, 800, 1200]] == pytest.approx(0.0, abs=1e-12)
    for begin, end in ((0, 800), (800, 1200)):
        span = times[end] - times[begin]
        # Mean variance of Brown's bridge over its span: walk span/6; its first three modes have 83 % of it.
        mean = np.mean(np.sum(bends[begin:end] ** 2, axis=1))
        assert mean == pytest.approx(0.827 * walk * span / 6, rel=0.005)
