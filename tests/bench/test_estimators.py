"""Three estimators side by side: when each listens, and what noise alone may not do."""

import numpy as np

from bench.quick import quick
from palpate._vector import ZERO3, Vec3
from palpate.bench import build
from palpate.bench.force_input import ConditionedSignals
from palpate.signals.types import Sense

ESTIMATORS = build(quick("foam-hybrid")).loop.estimators
X = 0.465


def signals(x, force):
    sense = Sense(ZERO3, ZERO3, Vec3(x, 0.0, 0.0), ZERO3, Vec3(force, 0.0, 0.0))
    return ConditionedSignals(sense, 0.0, 0.0, 0.0, force)


def after(state, samples, pressing=False):
    for x, force in samples:
        state = ESTIMATORS.step(state, signals(x, force), pressing, X)
    return state


def wiggle(n, force, seed=0):
    random = np.random.default_rng(seed)
    return [(X + 1e-4 * random.standard_normal(), force + 0.1 * random.standard_normal()) for _ in range(n)]


def test_in_the_air_none_listens():
    state = after(ESTIMATORS.start_at(X), wiggle(50, 0.0))
    assert state.listening == 0.0
    for estimator in (state.thesis, state.raw, state.matched):
        assert estimator.weight == 0.0


def test_the_matched_one_listens_from_the_touch_the_others_from_the_switch():
    state = after(ESTIMATORS.start_at(X), wiggle(10, 3.0))
    assert state.listening == 1.0
    assert state.matched.weight == 9.0  # the first is its own mean: centred, it is zero and teaches nothing
    assert state.thesis.weight == state.raw.weight == 0.0
    state = after(state, wiggle(5, 6.0), pressing=True)
    assert state.matched.weight == 14.0
    assert state.thesis.weight == state.raw.weight == 5.0


def test_what_noise_took_for_a_touch_is_forgotten_at_the_next():
    """One lucky sample above the threshold, long before the surface: the fit must not remember the air."""
    fresh = after(ESTIMATORS.start_at(X), wiggle(30, 0.0))
    fooled = after(fresh, [(X, 2.5), *wiggle(20, 0.5), (X, -0.1)])
    assert fooled.listening == 0.0
    assert fooled.matched.weight > 0.0
    once_more = after(fooled, [(X, 2.5)])
    assert once_more.matched.weight == 0.0
    assert once_more.centring.weight == 1.0


def test_a_false_touch_does_not_change_the_result():
    """The same press twice, once with a threshold in the noise: K and its interval hold."""
    results = []
    for touch in (2.0, 0.5):
        record = build(quick("foam-hybrid", identification={"touch": touch})).run(3.0, seed=3, press=2.0)
        results.append((record["K_matched"][-1], record["K_matched_std"][-1]))
    (K, std), (fooled, fooled_std) = results
    assert abs(fooled - K) < 3 * max(std, fooled_std)
    assert fooled_std < 2 * std
