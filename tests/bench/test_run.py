"""A run: the same numbers compiled and stepped, the same numbers from the same seed, and every way to end."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.quick import DURATION, PRESS, quick
from palpate.bench import bench as running
from palpate.bench import build, load, names, simulation
from palpate.errors import InputError


def same(one, other, *, tolerance=0.0):
    assert len(one) == len(other)
    for name in one.columns:
        a, b = one[name], other[name]
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance, err_msg=name)


@pytest.fixture(scope="module")
def foam():
    return build(quick("foam-hybrid"))


def press(bench, seed=0, **options):
    return bench.run(DURATION, seed, press=PRESS, **options)


def kinds_of_loop():
    """One experiment of each controller, surface and wave: others differ from it in numbers alone."""
    found = {}
    for name in names():
        e = load(name)
        waves = e.force.chirp is not None, e.force.multisine is not None
        found.setdefault((type(e.controller), type(e.surface), waves), name)
    return list(found.values())


FEW = ("foam-hybrid", "foam-neural")
"""Kinds of loop of which each test run asks; the others take as long and are `long`."""
OF_ITS_OWN = "cautious"
"""The controller that has a loop compiled for itself; the others share one."""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in FEW else pytest.mark.long) for n in kinds_of_loop()]
)
def test_compiled_and_stepped_runs_agree_to_the_bit(name):
    """Over the approach, the touch and the switch. Networks call exp, of which there are two in a process."""
    bench = build(quick(name))
    short = 0.4 * PRESS
    compiled, stepped = (bench.run(DURATION, press=short, compiled=how) for how in (True, False))
    assert (compiled["phase"] == 1.0).sum() == round(short / bench.loop.tick)
    assert compiled.meta["end"] == stepped.meta["end"] == "done"
    same(compiled, stepped, tolerance=1e-12 if "neural" in name else 0.0)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if n.endswith(OF_ITS_OWN) else ()) for n in names()]
)
def test_the_same_seed_gives_the_same_numbers_and_another_others(name):
    bench = build(quick(name))
    first, other, again = press(bench, 3), press(bench, 4), press(bench, 3)
    same(first, again)
    same(first, press(build(quick(name)), 3))
    n = min(len(first), len(other))
    assert not np.array_equal(first["force_sampled"][:n], other["force_sampled"][:n])
    for column in first.columns.values():
        assert np.isfinite(column).all()


@pytest.mark.parametrize("chunk", [1, 7, 100_000])
def test_how_often_progress_is_looked_at_changes_nothing(foam, monkeypatch, chunk):
    before = press(foam)
    monkeypatch.setattr(running, "CHUNK", chunk)
    same(before, press(foam))


def test_a_run_may_start_where_another_left_off(foam):
    """The state is all there is: two marches are one."""
    from palpate.bench import march, start_at
    from palpate.bench.force_input import COLUMNS

    noise, whole, parts = np.random.default_rng(0).standard_normal(60), *np.empty((2, 60, len(COLUMNS)))
    start = start_at(foam.loop, foam.q)
    end = march(foam.loop, start, 0, noise, whole)
    state = march(foam.loop, start, 0, noise[:23], parts[:23])
    assert march(foam.loop, state, 23, noise[23:], parts[23:]) == end
    np.testing.assert_array_equal(whole, parts)


def test_press_and_duration_are_exact_to_the_tick(foam):
    record = press(foam)
    contact = int(np.argmax(record["phase"] == 1.0))
    assert len(record) == contact + 200
    assert record.meta["end"] == "done"
    assert len(foam.run(0.123, press=PRESS)) == 123
    assert len(foam.run((contact + 150) * 0.001, press=PRESS)) == contact + 150, (
        "duration ends it in any case"
    )
    assert len(foam.run(0.4)) == 400, "without press it runs on"
    assert len(foam.run(0.001)) == 1
    # What was recorded does not depend on when it ended.
    longer = foam.run(DURATION, press=PRESS + 0.05)
    for name in record.columns:
        np.testing.assert_array_equal(record[name], longer[name][: len(record)])


@pytest.mark.parametrize("length", [0.0, -1.0, 0.0004, np.nan])
def test_a_run_or_press_of_no_tick_is_refused(foam, length):
    with pytest.raises(InputError, match="at least one tick"):
        foam.run(length)
    with pytest.raises(InputError, match="press must be at least one tick"):
        foam.run(1.0, press=length)


def test_without_a_surface_in_reach_there_is_no_contact():
    record = build(quick("foam-hybrid", wall={"x": 0.5})).run(0.5, press=PRESS)
    assert record.meta["end"] == "no contact"
    assert record.meta["why"]
    assert len(record) == 500
    assert not record["force"].any()


def test_a_loop_that_diverges_ends_before_numbers_are_none(monkeypatch):
    """Gains beyond all reason and no limits: the record ends with the last finite row, compiled and plain."""
    wild = quick(
        "foam-hybrid",
        friction={"bristle_damping": (1e9,) * 3, "bristle_stiffness": (0.0,) * 3, "viscous": (1e9,) * 3},
        robot={"torque_limits": (88.0, 9.8, 2.0)},
    )
    bench = build(wild)
    for compiled in (True, False):
        record = bench.run(0.3, press=PRESS, compiled=compiled)
        assert record.meta["end"] == "diverged"
        assert "not a finite number" in record.meta["why"]
        assert 0 < len(record) < 300
        assert all(np.isfinite(column).all() for column in record.columns.values())


def test_the_keyboard_interrupts_and_what_was_done_is_kept(foam):
    class Interrupting:
        """The march of the loop, stopped by the keyboard on its third call."""

        def __init__(self, march):
            self.march, self.calls = march, 0

        def run(self, *arguments):
            self.calls += 1
            if self.calls == 3:
                raise KeyboardInterrupt
            return self.march.run(*arguments)

    times = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "CHUNK", 100)
        patch.setattr(simulation, "compiled_march", Interrupting(simulation.compiled_march))
        record = foam.run(1.0, progress=lambda time, _: times.append(time))
    assert record.meta["end"] == "interrupted"
    assert len(record) == 200
    assert times == pytest.approx([0.1, 0.2])
    for name in record.columns:
        np.testing.assert_array_equal(record[name], foam.run(0.2)[name])


gains = st.floats(0.0, 1e4)


@settings(max_examples=30)
@given(gains, gains, st.floats(0.0, 50.0), st.floats(0.0, 1.0), st.tuples(*[st.floats(0.05, 20.0)] * 3))
def test_no_gain_makes_a_motor_exceed_its_limit(kp, kv, kf, ki, limits):
    experiment = quick(
        "foam-hybrid",
        controller={"kp": kp, "kv": kv, "kf": kf, "ki": ki},
        approach={"kp": kp, "kv": kv},
        robot={"torque_limits": limits},
    )
    record = build(experiment).run(0.3)
    for i, (limit, peak) in enumerate(zip(limits, (88.2, 9.8, 2.0), strict=True), 1):
        assert np.abs(record[f"torque{i}"]).max() <= min(limit, peak)
