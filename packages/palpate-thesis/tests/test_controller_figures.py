"""The linear force loop, against its transfer functions and the bench's own parts stepped one by one."""

from functools import reduce

import numpy as np
import pytest
from scipy import signal

from palpate.bench import load, with_values
from palpate.instruments import force_sensor
from palpate.signals.filters import butterworth2
from palpate_thesis.force_control.linear_loop import LoopParameters
from palpate_thesis.runs import SHORT

FOAM = with_values(load("foam-hybrid"), {**SHORT, "run.press": 1.2})


def swings(loop, stiffness, seconds=3.0, physics=20000):
    """How much a small knock has grown, stepping tip, sensor and filter one by one."""
    sensor, smooth = force_sensor(noise=0.0, bits=32, rate=physics), butterworth2(loop.smoothing, 1000.0)
    chain, past, total, command = sensor.start(), smooth.start_at(0.0), 0.0, 0.0
    x, v, f, dt, early, late = 1e-5, 0.0, 0.0, 1.0 / physics, 0.0, 0.0
    for k in range(round(seconds * physics)):
        if k % 20 == 0:
            measured, past = smooth.step(past, chain.held)
            total += loop.ki * measured
            command = -loop.kf * measured - total
        v += dt * (command - stiffness * x - loop.damping * v) / (loop.tip + loop.mass)
        x += dt * v
        f = stiffness * x + loop.damping * v
        _, chain = sensor.sample(chain, f, k, 0.0)
        early, late = (max(early, abs(x)), late) if k < 0.4 * physics else (early, late)
        late = max(late, abs(x)) if k > (seconds - 0.4) * physics else late
    return late / early


@pytest.mark.long
@pytest.mark.parametrize("gains", [(1.0, 0.003), (0.25, 0.0015)])
def test_the_linear_limit_is_where_a_stepped_loop_begins_to_swing(gains):
    """Another way to the same number: the parts of the bench, step by step, without friction."""
    loop = LoopParameters(*gains, 60.0, 8.2)
    limit = loop.limit()
    assert swings(loop, 0.85 * limit) < 1.0
    assert swings(loop, 1.15 * limit) > 1.0


def by_transfer_functions(kf, ki, damping, stiffness):
    """The largest root of the same loop: plant and low-pass held, 3.125 ticks late, smoothed, and the PI."""
    low_pass = signal.butter(3, 2.0 * np.pi * 120.0, analog=True)
    above = np.polymul([damping, stiffness], low_pass[0])
    below = np.polymul([8.2 + 0.05, damping, stiffness], low_pass[1])
    (plant,), poles, _ = signal.cont2discrete((above, below), 1e-3)
    smooth = signal.butter(2, 120.0, fs=1000.0)
    loop = reduce(np.polymul, (plant, smooth[0], [0.875, 0.125], [kf + ki, -kf]))
    return np.abs(
        np.roots(np.polyadd(reduce(np.polymul, (poles, smooth[1], [1, 0, 0, 0, 0], [1, -1])), loop))
    ).max()


@pytest.mark.parametrize(
    "case",
    [
        (1.0, 0.003, 60.0, 6e3),
        (1.0, 0.003, 60.0, 24e3),
        (0.25, 0.0015, 480.0, 4e5),
        (0.25, 0.0015, 480.0, 8e5),
    ],
)
def test_the_linear_loop_is_its_transfer_functions(case):
    """On either side of the limit; roots of order 14 near the unit circle are known to 1e-9."""
    kf, ki, damping, stiffness = case
    (radius,) = LoopParameters(kf, ki, damping, 8.2).radius(np.array([stiffness]))
    assert radius == pytest.approx(by_transfer_functions(*case), abs=1e-8)


def test_without_gain_every_surface_is_stable():
    assert LoopParameters(0.0, 0.0, 60.0, 8.2).limit() == np.inf


def test_a_hopeless_loop_has_no_limit():
    assert np.isnan(LoopParameters(400.0, 0.003, 60.0, 8.2).limit())
