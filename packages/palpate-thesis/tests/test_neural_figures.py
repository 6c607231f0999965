"""The figures of the neural controller: what they measure by, on records made by hand, and each whole."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import CONTACT, LOST
from palpate.records import Record
from palpate.studies.metrics.following import LIMIT
from palpate.studies.metrics.window import SETTLE
from palpate_thesis.explanations import e3_divergence
from palpate_thesis.force_control.tracking import tracking

TICK = 1e-3


def pressed(force, seconds=10.0, before=0.2, **columns) -> Record:
    """A record of steps between 20 and 10 N; force(since, desired) is the true and the measured one."""
    n, first = round((seconds + before) / TICK), round(before / TICK)
    since = TICK * (np.arange(n) - first)
    desired = np.where(since < 0.0, 0.0, np.where(np.floor((since + 5e-7) / 2.5) % 2 == 0, 20.0, 10.0))
    table = {name: np.zeros(n) for name in COLUMNS}
    table["t"] = TICK * np.arange(n)
    table["phase"] = np.where(since >= -5e-7, CONTACT, 0.0)
    table["force_desired"] = desired
    table["force"] = table["force_measured"] = force(since, desired)
    table.update(columns)
    return Record(table, COLUMNS, {"experiment": {"force": {"period": 2.5}}, "end": "done"})


def test_errors_right_after_a_step_are_not_judged_and_later_ones_are():
    def late(until):
        return lambda t, d: d - np.where(np.mod(t + 5e-7, 2.5) < until, 8.0, 0.0)

    early = tracking(0.0, 10.0)(pressed(late(SETTLE)))
    assert early.settled == pytest.approx(0.0, abs=1e-9)
    assert early.rms == pytest.approx(8.0 * np.sqrt(SETTLE / 2.5), rel=1e-3)
    assert early.follows
    assert not tracking(0.0, 10.0)(pressed(late(SETTLE + 0.5))).follows


def test_a_steady_error_counts_as_a_share_of_what_is_asked_for():
    found = tracking(0.0, 10.0)(pressed(lambda t, d: d - 1.2))
    assert found.settled == pytest.approx(1.2)
    assert found.off == pytest.approx(0.12)
    assert found.settled < LIMIT
    assert not found.follows


def test_a_lost_contact_never_follows():
    record = pressed(lambda t, d: d)
    record.columns["phase"][2000:2100] = LOST
    found = tracking(5.0, 10.0)(record)
    assert found.lost == 1
    assert not found.follows
    assert not found.kept


def test_a_run_without_the_window_never_follows():
    assert not tracking(20.0, 30.0)(pressed(lambda t, d: d)).kept
    assert not tracking(0.0, 10.0)(pressed(lambda t, d: d, phase=np.zeros(10200))).follows


def test_torque_gains_are_the_slope_of_the_network():
    from palpate.controllers import Neural
    from palpate.networks import Perceptron

    inputs = np.array([0.465, 0.01, 0.01, 0.465, 0.01, 0.01, 1.0, -2.0, 0.1])
    neural, perceptron = Neural.thesis(), Perceptron.thesis()
    state = neural.start()
    state.network.weights[:] *= 100.0
    perceptron.hidden_weights[:] *= 100.0
    perceptron.output[:] *= 100.0
    state.network.signals[:9] = inputs
    neural.network.forward(state.network)
    slopes = []
    for i in (6, 7, 8):
        step = np.zeros(9)
        step[i] = 1e-6
        slopes.append((perceptron.forward(inputs + step)[0] - perceptron.forward(inputs - step)[0]) / 2e-6)
    assert e3_divergence.torque_gains(state) == pytest.approx(slopes, rel=1e-5)
