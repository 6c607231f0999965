"""Encoders quantise to the nearest count."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.instruments import Encoder

ARM = Encoder(Vec3(614400, 409600, 2000), Vec3(0.1, -0.2, 0.3))


@kernel
def compiled(encoder, angle):
    return encoder.read(angle)


@given(st.floats(-10.0, 10.0), st.floats(-1.0, 1.0), st.sampled_from([614400, 409600, 2000]))
def test_the_error_is_half_a_count_at_most(angle, offset, counts):
    encoder = Encoder(counts, offset)
    assert abs(encoder.read(angle) - angle) <= 0.5 * encoder.resolution + 1e-12


def test_three_joints_are_three_encoders():
    angles = Vec3(0.7, -1.3, 2.9)
    apart = [
        Encoder(counts, offset).read(q)
        for counts, offset, q in zip(ARM.counts, ARM.offset, angles, strict=True)
    ]
    np.testing.assert_array_equal(ARM.read(angles), apart)
    np.testing.assert_array_equal(compiled(ARM, angles), apart)
    np.testing.assert_allclose(ARM.resolution, 2 * math.pi / np.array([614400, 409600, 2000]))


@pytest.mark.parametrize("counts", [0.0, -2000.0, Vec3(1.0, 0.0, 1.0)])
def test_counts_must_be_positive(counts):
    with pytest.raises(InputError, match="encoder counts must be above 0"):
        Encoder(counts)
