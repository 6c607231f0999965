"""The figures of the neural controller: what they measure by, on records made by hand, and each whole."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.bench import with_values
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import CONTACT, LOST
from palpate.records import Record
from palpate.studies.metrics.following import LIMIT
from palpate.studies.metrics.window import SETTLE
from palpate_thesis.claims import often
from palpate_thesis.explanations import e2_integrator, e3_divergence
from palpate_thesis.figures import fig_6_10_17
from palpate_thesis.force_control.tracking import (
    FOAM,
    Tracking,
    tracking,
)
from palpate_thesis.runs import rougher

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


def test_nine_of_ten_are_enough_and_eight_are_not():
    good, bad = Tracking(0.1, 0.1, 0.0, 0.0, 0), Tracking(9.0, 9.0, 0.5, 0.0, 0)
    assert often(run.follows for run in [good] * 9 + [bad])
    assert not often(run.follows for run in [good] * 8 + [bad] * 2)


def test_rougher_joints_have_another_friction_and_nothing_else():
    rough = with_values(FOAM, rougher(FOAM, 2.0))
    assert rough.friction.coulomb == tuple(2.0 * f for f in FOAM.friction.coulomb)
    assert (rough.controller, rough.surface) == (FOAM.controller, FOAM.surface)


def test_ends_of_intervals_are_told_apart_by_level():
    ends = fig_6_10_17.interval_ends(pressed(lambda t, d: np.where(d == 20.0, 16.0, 12.5)))
    assert (ends.high, ends.low) == pytest.approx((-4.0, 2.5))
    assert fig_6_10_17.misses(ends)
    assert not fig_6_10_17.misses(fig_6_10_17.Ends(-4.0, 0.5))


def test_the_course_of_the_error_has_a_value_for_each_whole_cycle():
    record = pressed(lambda t, d: d - np.where(t < 10.0, 2.0, 1.0), seconds=17.0)
    assert fig_6_10_17.course(record).errors == pytest.approx([2.0, 2.0, 1.0])


def test_an_error_that_changes_sign_is_still_an_error():
    record = pressed(lambda t, d: d, seconds=15.0)
    t = record["t"] - 0.2
    record.columns["y"][:] = np.where(np.floor(t / 2.5) % 2 == 0, 2e-3, -2e-3)
    assert fig_6_10_17.measure_free_errors(record).y == pytest.approx(2e-3)


@pytest.mark.parametrize("restart", [0.0, 5.0])
@pytest.mark.parametrize("adapts", [1.0, 4.0])
def test_the_time_of_adapting_is_found_whether_the_clock_restarts_or_not(adapts, restart):
    def force(t, d):
        sine = 3.0 * np.sin(np.pi * (np.mod(t, restart) if restart else t))
        return d + sine - np.where(t < adapts, 5.0, 0.0)

    record = pressed(force, seconds=20.0)
    adapted = fig_6_10_17.adapting(record).adapted
    assert adapted == pytest.approx(adapts, abs=fig_6_10_17.SMOOTHED)


def test_the_gain_of_an_integrator_is_found_under_noise():
    noise = np.random.default_rng(3).normal(0.0, 0.5, 10200)
    record = pressed(lambda t, d: d - 3.0 * np.exp(-np.mod(t, 2.5)) + noise)
    pressing = record["phase"] == CONTACT
    error = (record["force_desired"] - record["force_measured"]) * pressing
    record.columns["memory_fx"][1:] = 7.0 * TICK * np.cumsum(error)[:-1]
    assert e2_integrator.fit_integral_gain(record) == pytest.approx(7.0, rel=1e-9)


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
