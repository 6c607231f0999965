"""The record's columns: each with a unit, each written at every tick, in the order that is promised."""

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build, march, start_at
from palpate.bench.force_input import COLUMNS
from palpate.robots import Planar3R


@pytest.mark.parametrize("name", ["foam-hybrid", "foam-neural"])
def test_every_column_is_written_at_every_tick(name):
    bench = build(quick(name))
    out = np.full((250, len(COLUMNS) + 3), np.nan)
    march(bench.loop, start_at(bench.loop, bench.q), 0, np.zeros(250), out)
    assert np.isfinite(out[:, :-3]).all(), [
        n for n, c in zip(COLUMNS, out.T, strict=False) if np.isnan(c).any()
    ]
    assert np.isnan(out[:, -3:]).all(), "write() goes beyond COLUMNS"
    assert {0.0, 1.0} <= set(out[:, 1]), "both phases were looked at"


@pytest.fixture(scope="module")
def record():
    bench = build(quick("foam-hybrid"))
    return bench.run(1.5, seed=1, press=0.5)


def test_time_is_k_times_the_tick_and_no_running_sum(record):
    np.testing.assert_array_equal(record["t"], np.arange(len(record)) * 0.001)


def test_columns_hold_what_their_names_say(record):
    """Each column against another way to the same number."""
    robot = Planar3R()
    q = np.column_stack([record[f"q{i}"] for i in (1, 2, 3)])
    pose = robot.forward_kinematics(q)
    for i, name in enumerate(("x", "y", "phi")):
        np.testing.assert_allclose(record[name], pose[:, i], atol=1e-12)
        lag = 2e-3 if name != "phi" else 0.02  # joint 3 is filtered and has 2000 counts
        np.testing.assert_allclose(record[f"{name}_measured"], record[name], atol=lag)
    np.testing.assert_allclose(np.diff(record["x_measured"]) / 1e-3, record["vx_raw"][1:], atol=1e-9)
    np.testing.assert_allclose(np.diff(record["vx_raw"]) / 1e-3, record["ax_raw"][1:], atol=1e-6)
    experiment = record.meta["experiment"]
    np.testing.assert_allclose(record["penetration"], record["x"] - experiment["wall"]["x"], atol=1e-12)
    pressing = record["phase"] == 1.0
    first = np.argmax(pressing)
    assert (
        record["force_measured"][first]
        >= experiment["approach"]["switch"]
        > record["force_measured"][first - 1]
    )
    np.testing.assert_allclose(
        record["displacement"][pressing],
        (record["x_measured"] - record["x_measured"][first])[pressing],
        atol=1e-12,
    )
    assert not record["displacement"][~pressing].any()
    np.testing.assert_array_equal(record["force_desired"], np.where(pressing, 20.0, 0.0))
    assert np.all(record["force"][record["touching"] == 0.0] == 0.0)
    assert np.all(record["force"] >= 0.0)


def test_saturated_means_that_the_limit_held_it_back():
    bench = build(quick("foam-hybrid", robot={"torque_limits": (16.0, 1.5, 0.6)}))
    record = bench.run(1.5, seed=1, press=0.3)
    held = record["saturated2"] == 1.0
    assert held.any()
    step = 9.8 / 2**11
    np.testing.assert_allclose(np.abs(record["torque2"][held]), 1.5, atol=0.51 * step)
