"""Tissue that stiffens and relaxes: its model, and what it never hides or invents."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
import pytest

from identification.synthetic_contacts import press_path, record
from palpate.identification import Verdict, identify
from palpate.identification.models import Motion

TIME = np.arange(4000) / 1000
NAME = "quasi-linear-viscoelastic"
K, N, SHARE, TAU = 4.0e4, 1.6, 0.8, 0.15


def tissue(time, path, seed=0, n=N, share=SHARE, noise=0.02):
    """F = K (u + share y), u = d^n, y' + y/tau = u', by a fine step of its own, while the probe is in it."""
    fine = np.arange(20 * len(time)) * (time[1] - time[0]) / 20
    u = np.maximum(path(fine), 0.0) ** n
    fade = np.exp(-(fine[1] - fine[0]) / TAU)
    y = np.fromiter(accumulate(np.diff(u, prepend=0.0).tolist(), lambda y, du: fade * y + du), float)
    force = np.where(path(fine) > 0, np.maximum(K * (u + share * y), 0.0), 0.0)[::20]
    rng = np.random.default_rng(seed)
    return record(time, path(time), force + noise * rng.standard_normal(len(time)))


def once(t):
    """One press with dips, by `press_path`."""
    return press_path(t, 0.06)


def holds(p, truth):
    return p.verdict is Verdict.IDENTIFIED and p.ci95[0] <= truth <= p.ci95[1]


def test_tissue_is_recognised_and_its_intervals_hold():
    held = []
    for seed in range(3):
        found = identify(tissue(TIME, once, seed), lag=0.0)
        assert found.model == NAME
        steep = K * N * found.depth ** (N - 1)
        truths = {"K": steep, "K1": SHARE * steep, "n": N, "tau": TAU}
        held += [holds(found.parameters[name], truth) for name, truth in truths.items()]
    assert sum(held) >= 10  # of twelve 95 % intervals: fewer would be chance in one of 50 such
    assert found.parameters["K"].unit == found.parameters["K1"].unit == "N/m"
    assert (
        2.5e-3 < found.to_json()["depth_m"] < 3e-3
    )  # the deepest is 3 mm, counted from where the force is first seen
    assert "at a penetration of" in found.parameters["K"].reason


@pytest.mark.parametrize(
    ("n", "share"), [(1.0, 0.8), (1.6, 0.0), pytest.param(1.0, 0.0, marks=pytest.mark.long)]
)
def test_a_surface_that_does_not_stiffen_or_does_not_relax_is_not_called_tissue(n, share):
    log = tissue(TIME, once, n=n, share=share)
    assert identify(log, lag=0.0).model != NAME
    asked = identify(log, lag=0.0, model=NAME)
    relaxed, exponent = asked.parameters["K1"], asked.parameters["n"]
    if not share:
        assert relaxed.verdict is not Verdict.IDENTIFIED or relaxed.value < 0.02 * asked.parameters["K"].value
    if n == 1.0 and exponent.verdict is Verdict.IDENTIFIED:
        assert exponent.ci95[0] <= 1.0 <= exponent.ci95[1]


def test_a_surface_that_is_touched_before_it_has_come_back_identifies_no_branch():
    def taps(t):
        return -2e-4 + 2.2e-3 * np.abs(np.sin(np.pi * 2.0 * t)) * (t > 0.5)

    asked = identify(tissue(TIME, taps), lag=0.0, model=NAME)
    assert len(asked.contacts) > 3
    assert asked.parameters["K1"].verdict is not Verdict.IDENTIFIED
    assert asked.parameters["K"].verdict is not Verdict.IDENTIFIED


def test_a_power_of_the_depth_is_refused_where_no_surface_is_seen():
    log = tissue(TIME, lambda t: 3e-3 + 1e-3 * np.sin(2 * np.pi * 2 * t) + 4e-4 * np.sin(2 * np.pi * 7 * t))
    asked = identify(log, lag=0.0, model=NAME, bonded=True)
    assert all(p.verdict is not Verdict.IDENTIFIED for p in asked.parameters.values())


@pytest.mark.parametrize("count", [1, 2, 99, 100, 101, 2000])
@pytest.mark.parametrize("size", [0.01, 0.5, 4.0])
def test_friction_turns_within_its_way_as_step_by_step(count, size):
    steps = size * np.random.default_rng(count).standard_normal(count)
    position = np.r_[0.0, np.cumsum(steps)]
    found = Motion(None, position, np.arange(len(position)), bonded=False).direction(least=1.0)
    one_by_one = [*accumulate(steps, lambda z, d: min(max(z + d, -1.0), 1.0), initial=0.0)][1:]
    assert found[1:] == pytest.approx(one_by_one, abs=1e-11)  # of steps taken from sums of some hundred
