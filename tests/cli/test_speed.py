"""The speed that is printed is the speed that was measured."""

from itertools import count

import pytest

from palpate.bench import build, load, speed
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import CONTACT
from palpate.bench.tables import with_values


def test_the_figures_follow_from_a_clock_and_the_ticks_that_were_run(monkeypatch):
    """A clock that goes on by a second each time it is looked at; every tick is counted."""
    marched = []

    class Compiled:
        def run(self, waiting, loop, state, k, noise, out):
            assert out.shape == (len(noise), len(COLUMNS))
            marched.append(len(noise))
            return state

    clock = count()
    monkeypatch.setattr(speed.time, "perf_counter", lambda: float(next(clock)))
    monkeypatch.setattr(speed, "compiled_march", Compiled())
    monkeypatch.setattr(speed.os, "sched_getaffinity", lambda _: {0}, raising=False)
    found = speed.measure()
    a_run = speed.TICKS * speed.CHUNKS
    # One to warm up, some alone, some side by side.
    assert sum(marched) == (1 + 2 * speed.REPEATS) * a_run
    assert found["ns_per_tick"] == pytest.approx(1e9 / a_run)
    assert found["cores"] == 1
    # The clock goes on by one from before a run to after it, beside others or not.
    assert found["ticks_per_s"] == pytest.approx(a_run)


def test_what_is_measured_presses_and_learns():
    bench = build(with_values(load(speed.EXPERIMENT), speed.PRESSING))
    record = bench.run(1.0)
    assert (record["phase"] == CONTACT).mean() > 0.5
    assert record["adapted2"][-1] != record["adapted2"][0]  # a norm of the network's weights
