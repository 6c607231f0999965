"""An inner loop from a log, against loops whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from palpate.errors import InputError
from palpate.force.arm import load_arm
from palpate.force.inner_loop import identify_inner_loop

TRUE = {"bandwidth": 10.0, "damping": 0.9, "delay": 0.0136}
TICK, FINE = 0.002, 10


def answered(command, bandwidth, damping, delay):
    """Position at each tick, stepped exactly in tenths of a tick, which the delay is a whole number of."""
    w, h = 2.0 * np.pi * bandwidth, TICK / FINE
    b, a, _ = cont2discrete(([w * w], [1.0, 2.0 * damping * w, w * w]), h)
    late = round(delay / h)
    fine = np.concatenate([np.zeros(late), np.repeat(command - command[0], FINE)])[: FINE * len(command)]
    return command[0] + lfilter(b.ravel(), a, fine)[::FINE]


def log(seed, n=2500, kind="steps", noise=1e-5, colour=0.0, **true):
    rng = np.random.default_rng(seed)
    t = TICK * np.arange(n)
    if kind == "steps":
        command = np.repeat(rng.uniform(-0.01, 0.01, n // 125 + 1), 125)[:n]
    else:
        command = 0.02 * np.sin(2.0 * np.pi * 0.2 * t)
    e = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], noise * rng.standard_normal(n))
    return t, command, answered(command, **{**TRUE, **true}) + e


@pytest.fixture(scope="module")
def found():
    return identify_inner_loop(*log(0))


def test_it_finds_what_is_there(found):
    for name, true in TRUE.items():
        one = getattr(found, name)
        assert abs(one.value - true) < 2.0 * one.half  # one draw may miss; how often is counted below
        assert one.half < 0.1 * true
    assert abs(found.gain.value - 1.0) < 2.0 * found.gain.half
    assert found.explained > 0.999


@pytest.mark.long
@pytest.mark.parametrize("colour", [0.0, 0.95])
def test_its_intervals_hold_the_truth(colour):
    """24 numbers of 95 %: fewer than 20 would be seen once in 2000 times. The benchmark counts 200 logs."""
    inside = 0
    for seed in range(8):
        one = identify_inner_loop(*log(10 + seed, n=1500, colour=colour))
        inside += sum(getattr(one, n).low <= true <= getattr(one, n).high for n, true in TRUE.items())
    assert inside >= 20


@pytest.mark.parametrize(
    ("spoiled", "says"),
    [
        (lambda t, u, x: (t, 0.0 * u, x), "command does not move"),
        (lambda t, u, x: (t, u, 0.0 * x), "position does not move"),
        (lambda t, u, x: (t[:100], u[:100], x[:100]), "too few"),
        (lambda t, u, x: (np.sort(t + 0.05 * np.sin(t)), u, x), "evenly"),
        (lambda t, u, x: (t, u, np.where(t == t[50], np.nan, x)), "no number"),
        (lambda t, u, x: (t, u, 1e3 * x), "units"),
        (lambda t, u, x: (t, u, -x), "times as far"),
        (lambda t, u, x: (t, u, np.roll(x, 700)), "explains"),
    ],
)
def test_a_log_that_tells_nothing_is_refused_in_one_line(spoiled, says):
    with pytest.raises(InputError, match=says) as caught:
        identify_inner_loop(*spoiled(*log(1)), where="mine.csv")
    assert "\n" not in str(caught.value)
    assert "mine.csv" in str(caught.value)


def test_slow_motion_is_told_to_excite_more():
    with pytest.raises(InputError, match="steps, or a sweep"):
        identify_inner_loop(*log(2, kind="slow"))


def test_an_arm_takes_it_over_with_its_intervals(found):
    arm = found.of(load_arm("ur5e"), "sweep.csv")
    assert arm.inner.bandwidth == found.bandwidth.value
    assert arm.inner.delay_interval == (found.delay.low, found.delay.high)
    assert arm.delay_ticks * arm.tick >= found.delay.high
    assert (arm.delay_ticks - arm.unsure_ticks) * arm.tick <= found.delay.low
    with pytest.raises(InputError, match="by position"):
        found.of(load_arm("fr3"), "sweep.csv")
