"""Lateness by two clocks that nobody has set, and what it says of a certificate."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.wires.realtime import Stopwatch

TICK = 0.002


def run(late, allowed=TICK, drift=0.0, missed=()):
    """Readings every tick by a clock that is 5 s ahead, their commands late by so much."""
    watch = Stopwatch(TICK, allowed, len(late))
    for k, delay in enumerate(late):
        stamp = 5.0 + k * TICK * (1.0 + drift)
        watch.note_sent(stamp, 100.0 + k * TICK + 0.001 + delay, 1 if k in missed else 0)
    return watch.summary()


def test_it_is_told_beyond_the_least_that_was_seen():
    late = np.random.default_rng(0).uniform(0, 0.001, 5000)
    found = run(late)
    assert found.ticks == 5000
    assert found.late[0] == pytest.approx(np.percentile(late, 50), rel=0.05)
    assert found.late[2] == pytest.approx(np.percentile(late, 99.9), rel=0.05)
    assert found.jumps == 0
    assert "within the 2 ms of jitter" in found.sentences()[1]


def test_lateness_beyond_the_certificates_jitter_is_counted_and_said():
    late = np.zeros(1000)
    late[500:502] = 0.0025
    found = run(late)
    assert found.jumps == 2
    walk = np.minimum(np.arange(1000) * 1e-4, 0.016)  # no change is large, but the age leaves the window
    assert run(walk).jumps == 1000 - 21
    assert "does not cover this run" in found.sentences()[1]
    assert run(late, allowed=None).sentences()[1].startswith("no certificate")
    assert run(np.zeros(100), missed={7}).missed == 1
    assert "does not cover" in run(np.zeros(100), missed={7}).sentences()[1]


@pytest.mark.parametrize("drift", [-5e-5, 5e-5])
def test_clocks_that_run_apart_are_not_taken_for_lateness(drift):
    found = run(np.zeros(30_000), drift=drift)  # a minute, quartz against quartz: 3 ms apart at its end
    assert found.late[3] < 1e-4
