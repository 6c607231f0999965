"""The figures of the neural identifier: what is measured, how it is judged, and that each figure stands."""

import numpy as np
import pytest

from palpate_thesis.figures import fig_6_06_09
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import Identified, NetworkChoice, NetworkPress

STIFFNESS = 6000.0
GOOD = Identified(
    K=6600.0,
    B=200.0,
    M=0.1,
    ratio=6700.0,
    squares_B=210.0,
    settled_K=0.6,
    settled_B=0.6,
    settled_M=0.6,
    error_gone=0.6,
    ripple=0.0,
    truth=np.array([6000.0, 200.0, 0.1]),
)


def spring(offset: float = 0.0) -> NetworkPress:
    """A press on a spring, without noise: to 3 mm within 0.1 s, then at rest."""
    t = np.arange(4000) * network.TICK
    x = 3e-3 * np.minimum(t / 0.1, 1.0)
    v = np.where(t < 0.1, 0.03, 0.0)
    force = offset + STIFFNESS * x
    ratio = float(force[-1] / x[-1])
    ones = np.ones((len(t), 3))
    return NetworkPress("foam", np.column_stack([x, v, 0.0 * t]), force, ratio, ones, ones, ones[0])


def test_an_error_is_gone_when_its_running_mean_stays_small():
    error = np.where(np.arange(4000) < 500, 5.0, 0.0)
    assert 0.5 < network.error_gone(error) < 0.5 + network.MEAN_OVER
    assert network.error_gone(np.zeros(4000)) == 0.0
    assert network.error_gone(np.full(4000, 2.0)) == np.inf
    assert network.error_gone(np.full(4000, np.nan)) == np.inf
    assert network.error_gone(5.0 * (-1.0) ** np.arange(4000)) < 0.01  # noise is no error


def test_the_tangent_is_the_derivative_of_the_networks_force():
    probe, _ = network.learn(spring(), NetworkChoice(), start=1)
    hidden, output = probe.layers
    x = 2.5e-3
    signal = np.tanh((hidden[:, 0] + hidden[:, 1] * 1e3 * x) / 2)
    out = np.tanh((output[0, 0] + output[0, 1:] @ signal) / 2)
    slope = 40.0 * 0.5 * (1 - out**2) * (output[0, 1:] @ (0.5 * (1 - signal**2) * hidden[:, 1])) * 1e3
    assert network.tangent(probe, x) == pytest.approx(slope, rel=1e-3)


def test_a_probe_beyond_what_was_pressed_is_warned_of():
    probe, _ = network.learn(spring(), NetworkChoice(), 0)
    assert {code for code, _ in probe.probe(displacement=4e-3).warnings} == {"probe-outside-learned"}


def judge(answers):
    """The claims of figure 6.7 from answers of its runs."""
    figure = next(one for one in fig_6_06_09.STUDIES if one.NUMBER == "6.7")
    return figure.check(fig_6_06_09.Data(spring(), {}, {1e-4: answers}))


def test_every_part_holds_of_an_answer_as_the_thesis_has_it():
    found = judge([GOOD] * 10)
    assert [c.id for c in found] == [
        f"network-foam.{s}" for s in ("time-K", "time-B", "time-M", "K", "B", "M")
    ]
    assert {c.verdict for c in found} == {"reproduced"}


@pytest.mark.parametrize(
    ("suffix", "change"),
    [
        ("time-K", {"settled_K": 0.1}),
        ("time-B", {"settled_B": 1.5}),
        ("time-M", {"settled_M": 0.0}),
        ("K", {"K": 7500.0}),
        ("B", {"B": 100.0}),
        ("M", {"M": -0.1}),
        ("M", {"M": 1.5}),
    ],
)
def test_a_part_differs_alone_when_its_own_number_does(suffix, change):
    bad = GOOD._replace(**change)
    found = judge([GOOD] * 8 + [bad] * 2)
    assert [c.id for c in found if c.verdict != "reproduced"] == [f"network-foam.{suffix}"]


def test_a_rate_is_slower_only_if_every_smaller_one_takes_longer():
    times = dict(zip(fig_6_06_09.SMALLER, (0.1, 0.2, 0.6, 2.0), strict=True))
    by_rate = {rate: [GOOD._replace(error_gone=t)] for rate, t in times.items()}
    assert fig_6_06_09.slower_throughout(by_rate) == [True]
    by_rate[fig_6_06_09.SMALLER[2]] = [GOOD._replace(error_gone=0.15)]
    assert fig_6_06_09.slower_throughout(by_rate) == [False]


def test_a_rate_is_too_large_when_all_beyond_it_are_stuck_too():
    stuck = [GOOD._replace(error_gone=np.inf)]
    by_rate = {rate: stuck if rate in (1e-3, 3e-2, 1e-1) else [GOOD] for rate in fig_6_06_09.RATES}
    assert fig_6_06_09.stuck_from(by_rate) == 3e-2
    assert fig_6_06_09.stuck_from({rate: [GOOD] for rate in fig_6_06_09.RATES}) == np.inf
