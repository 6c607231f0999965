"""Converters quantise and saturate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.instruments import Converter

FORCE = Converter(16, 200.0)
TORQUE = Converter(12, Vec3(88.2, 9.8, 2.0))


@kernel
def convert(converter, u):
    return converter.convert(u)


@given(st.floats(-199.9, 199.9))
def test_the_error_is_half_a_code_at_most(force):
    assert abs(FORCE.convert(force) - force) <= 0.5 * FORCE.resolution * (1 + 1e-9)


@given(st.floats(-1e6, 1e6))
def test_it_is_odd_bounded_and_compiled_alike(force):
    value = FORCE.convert(force)
    assert value == -FORCE.convert(-force) == convert(FORCE, force)
    assert abs(value) <= 200.0 - FORCE.resolution


@given(st.floats(1e-3, 1e3), st.floats(-1e4, 1e4))
def test_no_code_beyond_a_limit_is_sent_and_the_nearest_within_it_is(limit, force):
    value = FORCE.convert_within(force, limit)
    assert abs(value) <= limit
    if abs(FORCE.convert(force)) <= limit:
        assert value == FORCE.convert(force)
    else:
        assert abs(value) > limit - FORCE.resolution * (1 + 1e-9) or abs(value) == 200.0 - FORCE.resolution


def test_three_channels_each_have_their_own_scale():
    torque = Vec3(100.0, 3.3, -0.001)
    apart = [Converter(12, scale).convert(u) for scale, u in zip(TORQUE.full_scale, torque, strict=True)]
    np.testing.assert_array_equal(TORQUE.convert(torque), apart)
    np.testing.assert_array_equal(convert(TORQUE, torque), apart)
    assert TORQUE.convert(torque).x == pytest.approx(88.2 * 2047 / 2048)


@pytest.mark.parametrize(
    ("bits", "scale", "words"),
    [
        (1, 200.0, "bits must be between 2 and 32, got 1"),
        (16, 0.0, "full scale must be above 0"),
        (40, 1.0, "bits"),
    ],
)
def test_bad_parameters_are_refused(bits, scale, words):
    with pytest.raises(InputError, match=words):
        Converter(bits, scale)
