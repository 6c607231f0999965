"""The peak of the sensitivity, on which the law's use of a bound of the stiffness alone rests."""

from __future__ import annotations

import pytest

from force.gained import gains_of
from palpate.force.gains import ALPHA
from palpate.force.lag import MAX_RELIEF, MAX_SENSITIVITY, relief_of, sensitivity
from palpate.force.sampled_loop import SampledLoop
from palpate.force.stiffness_bound import least_for

RATIOS = (0.0, 0.1, 0.3, 0.7, 1.0, 2.0, 6.0)
"""B/K over theta."""


@pytest.mark.parametrize(("name", "most"), [("ur5e", 1.56), ("fr3", MAX_SENSITIVITY)])
@pytest.mark.parametrize("K", [300.0, 2e4, 4e5])
def test_damping_is_lead_so_that_a_bound_of_the_stiffness_is_enough(name, most, K):
    gains = gains_of(name)
    felt = gains.arm.seen(K) if gains.arm.kind == "position" else K
    for ratio in RATIOS:
        bound = max(felt, least_for(gains.cautious(), felt * (1.0 + ratio)))
        peak = sensitivity(SampledLoop(gains.arm), gains.gain_at(bound), felt, ratio * gains.theta * felt)
        assert peak < most + 0.01


def test_it_is_infinite_where_the_loop_grows():
    gains = gains_of("ur5e")
    assert sensitivity(SampledLoop(gains.arm), 5.0 * gains.gain_at(1e4), 1e4) == float("inf")


def test_a_gain_with_relief_stays_within_what_is_proved():
    gains = gains_of("fr3")
    assert relief_of(gains_of("ur5e").arm, gains.theta, ALPHA) == 0.0
    assert 0.0 < gains.relief <= MAX_RELIEF
    for K in (10.0, 1e4, 1e6):
        seen = 1.0 / (gains.compliance + 1.0 / K)
        assert gains.gain_at(K) * gains.theta * seen / gains.alpha <= 1.0 / (1.0 - MAX_RELIEF)
