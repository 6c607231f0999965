"""Rounding to steps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.signals.samples import quantise, whole

reasonable = st.floats(-1e12, 1e12)


@given(reasonable)
def test_whole_rounds_to_the_nearest_and_ties_to_even(u):
    assert whole(u) == round(u)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e3))
def test_the_error_is_half_a_step_at_most(u, step):
    assert abs(quantise(u, step) - u) <= 0.5 * step * (1 + 1e-9) + 1e-9


@kernel
def compiled(u, step):
    return quantise(u, step)


def test_numbers_vectors_arrays_and_compiled_agree():
    values = np.array([-2.5, -0.3, 1.26])
    vector = quantise(Vec3(*values), 0.1)
    np.testing.assert_array_equal(vector, quantise(values, 0.1))
    np.testing.assert_array_equal(vector, [quantise(u, 0.1) for u in values])
    np.testing.assert_array_equal(vector, compiled(Vec3(*values), 0.1))
    np.testing.assert_allclose(vector, [-2.5, -0.3, 1.3])
