"""A state as a vector and back."""

import numpy as np

from palpate.bench import build, load, start_at
from palpate.studies.analysis.linear_loop import LoopMotion, leaves, rebuilt, vector
from palpate.studies.analysis.linear_model import at_equilibrium, pressing


def test_there_and_back():
    bench = build(load("foam-neural"))
    state = start_at(bench.loop, bench.q)
    numbers = vector(state)
    names = [name for name, _ in leaves(state)]
    assert len(names) == len(set(names)) == len(numbers)
    again = rebuilt(state, iter((2.0 * numbers).tolist()))
    assert type(again.plant.q) is type(state.plant.q)
    np.testing.assert_array_equal(vector(again), 2.0 * numbers)
    np.testing.assert_array_equal(vector(state), numbers)


def test_only_the_controller_that_acts_moves():
    for name, size in (("foam-pi", 3), ("foam-impedance", 1)):
        bench = build(load(name))
        motion = LoopMotion(*pressing(at_equilibrium(bench.loop, 20.0, friction=False), 20.0, 1.0))
        assert sum(n.startswith("controller") for n in motion.names) == size
