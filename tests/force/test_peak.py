"""The bound of the first peak, against the linear loop with a gain that wanders as it likes."""

import numpy as np
import pytest

from force.gained import gains_of
from palpate.force.peak import answers, peak_bound
from palpate.force.sampled_loop import SampledLoop


@pytest.mark.parametrize("share", [1.0, 1.5])
def test_no_gain_within_the_share_passes_the_bound(share):
    """Touches simulated by superposition, the gain switched between nothing and all at random and by rule."""
    gains = gains_of()
    bound = peak_bound(gains, share) / gains.force
    loop, n = SampledLoop(gains.arm, 0, gains.seen_cap), 160
    answer, arriving, lead = answers(loop, gains.seen_cap, n)
    force = np.append(answer[loop.lines[0] :], np.ones(loop.lines[0]))  # before its readings are on their way
    step, rng, worst = share * gains.alpha * gains.arm.tick / gains.theta, np.random.default_rng(0), 0.0
    for trial in range(400):
        share_of = rng.integers(0, 2, n) if trial % 2 else (np.arange(n) >= rng.integers(0, 20)).astype(float)
        moved, speed = np.zeros(n), rng.uniform(0.0, step)
        for k in range(n):
            read = answer[: k + 1][::-1] @ moved[: k + 1] + speed * arriving[k]
            moved[k] = share_of[k] * step * (1.0 - read)
        true = np.convolve(moved, force)[:n] + speed * lead * force
        worst = max(worst, float(true.max()))
    assert worst < bound
    assert (
        bound < 1.0 + 1.6 * share * gains.alpha
    )  # and it says something: the step alone comes to alpha a lag


def test_a_loop_that_hardly_moves_hardly_overshoots():
    assert peak_bound(gains_of(), 0.05) == pytest.approx(20.0, rel=0.02)
