"""Random calls of each streaming class: hostile types, shapes and orders, copies and pickles between them.

No foreign exception, no result that is not finite, and nothing compiles. A signal would end the process.
"""

from __future__ import annotations

import copy
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from force.gained import gains_of
from force.test_sliding import tuned
from palpate.errors import InputError
from palpate.force import ForceLoop, SlidingLoop
from palpate.identifiers import (
    ContactIdentifier,
    NeuralProbe,
    RecursiveLeastSquares,
    RestartingLeastSquares,
)
from palpate.identifiers.neural_probe import SETTINGS
from palpate.networks.perceptron import Perceptron
from test_typed_edge import NO_NUMBERS, NO_VECTORS, NUMBERS, vectors

CALLS = 50
"""Calls of one object."""
SIZES = (0.0, -0.0, 1.0, -1.0, 1e-320, 1e-9, 1e3, -1e12, 1e150, -1e300, 1e308, np.nan, np.inf, -np.inf)
VALUES = [*SIZES, *NUMBERS, *vectors()] * 2 + [*NO_NUMBERS, *NO_VECTORS]
VALUES += [np.full(3, size) for size in SIZES] + [np.outer(np.ones(n), np.arange(3.0)) for n in (0, 1, 4)]
VALUES += [
    np.arange(12.0).reshape(4, 3).T,
    np.zeros((0,)),
    np.ones(3) > 0.0,
    [[1, 2, 3]],
    np.ma.ones(3),
    memoryview(b"abc"),
]


def learn(net, inputs, error):
    """What the network learns from one error."""
    net.forward(inputs)
    net.learn(error)


ESTIMATOR = ((lambda one, *a: one.update(*a), 2), (lambda one, *a: one.update_many(*a), 2))
CASES = {
    "least squares": (lambda: RecursiveLeastSquares(np.zeros(3), np.eye(3)), ESTIMATOR, ("covariance",)),
    "restarting": (lambda: RestartingLeastSquares(np.zeros(3), np.eye(3)), ESTIMATOR, ("covariance", "changes")),
    "neural": (lambda: NeuralProbe(SETTINGS["foam"]), (*ESTIMATOR, (NeuralProbe.force, 1)), ()),
    "contact": (
        lambda: ContactIdentifier("butterworth3:120", 1000.0, 0.004), (*ESTIMATOR, (lambda one: one.skip(), 0)),
        ("contacts", "samples", "in_contact"),
    ),
    "force loop": (
        lambda: ForceLoop(gains_of()),
        ((ForceLoop.update, 2), (ForceLoop.update, 3), (ForceLoop.limit_speed, 1), (ForceLoop.reset, 0),
         (lambda one, v: setattr(one, "desired", v), 1), (lambda one, v: setattr(one, "state", v), 1)),
        ("state", "noise", "bias", "drift", "desired"),
    ),
    "sliding loop": (
        lambda: SlidingLoop(tuned()),
        ((SlidingLoop.update, 3), (SlidingLoop.update, 4), (SlidingLoop.limit_speed, 1), (SlidingLoop.reset, 0),
         (lambda one, v: setattr(one, "desired", v), 1)),
        ("state", "normal", "normal_cone95", "bound"),
    ),
    "perceptron": (
        lambda: Perceptron.random((3, 4, 3), 1.0, 1e-3), ((learn, 2), (Perceptron.forward, 1), (Perceptron.learn, 1)),
        ("output", "hidden_weights"),
    ),
}  # fmt: skip


def compiled_versions():
    """Compiled versions of all kernels that were called so far."""
    from palpate._jit import Kernel

    modules = [module for name, module in sys.modules.items() if name.startswith("palpate.")]
    kernels = {id(k): k for module in modules for k in vars(module).values() if isinstance(k, Kernel)}
    return sum(len(k._dispatcher.overloads) for k in kernels.values() if k._dispatcher is not None)


def call_at_random(name, choices):
    """Call an object's methods, and look at its results after each call."""
    make, methods, results = CASES[name]
    one, before = make(), compiled_versions()
    for method, renewed, *numbers in choices:
        one = copy.deepcopy(one) if renewed == 0 else pickle.loads(pickle.dumps(one)) if renewed == 1 else one
        call, count = methods[method % len(methods)]
        try:
            returned = call(one, *(VALUES[n % len(VALUES)] for n in numbers[:count]))
        except InputError as error:
            returned = None if len(str(error).splitlines()) == 1 else np.nan
        shown = [returned, *(attrgetter(result)(one) for result in results)]
        if hasattr(one, "estimate") and callable(one.estimate):
            shown.append(one.estimate().theta)
        for value in shown:
            assert value is None or np.isfinite(value).all(), (name, numbers)
    assert compiled_versions() == before


@pytest.mark.parametrize("examples", [10, pytest.param(2000, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", CASES)
def test_any_calls_give_finite_numbers_or_one_line(name, examples):
    number = st.integers(0, 10_000)
    call = st.tuples(
        number, st.integers(0, 30), *[number] * 4
    )  # method, whether it is copied before, arguments
    chosen = st.lists(call, min_size=CALLS, max_size=CALLS)
    bounded = settings(max_examples=examples, deadline=None, phases=[Phase.generate])
    given(chosen)(bounded(lambda choices: call_at_random(name, choices)))()


@pytest.mark.parametrize("name", CASES)
def test_two_threads_that_share_an_object_leave_it_finite(name):
    """In whatever order their calls come, each gives a result or one line."""
    make, methods, results = CASES[name]
    one = make()

    def call_often(seed):
        rng = np.random.default_rng(seed)
        for _ in range(3000):
            call, count = methods[rng.integers(len(methods))]
            with suppress(InputError):
                call(one, *(VALUES[rng.integers(len(VALUES))] for _ in range(count)))

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(call_often, (1, 2)))
    for result in results:
        value = attrgetter(result)(one)
        assert value is None or np.isfinite(value).all()
