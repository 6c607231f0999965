"""The typed edge of compiled code: nothing but numbers of the right shape gets through."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from force.gained import gains_of
from force.test_sliding import tuned
from palpate._jit import BoundKernel, kernel
from palpate._jit.typed_edge import cast_array, cast_number
from palpate.errors import InputError
from palpate.force import ForceLoop, SlidingLoop
from palpate.identifiers import ContactIdentifier, NeuralProbe, RecursiveLeastSquares, RestartingLeastSquares
from palpate.identifiers.neural_probe import SETTINGS

NUMBERS = (
    1,
    True,
    2.0,
    np.float32(1),
    np.int8(1),
    np.uint64(1),
    np.bool_(1),
    np.float16(1),
    np.longdouble(1),
)
NUMBERS += (np.array(1.0), np.array(1, np.int16), Fraction(1, 2))
NO_NUMBERS = ("3", b"3", None, object(), 1j, np.complex128(1), np.ones(1), [1.0], 10**400, np.str_("3"), {})
NO_VECTORS = (
    None, "abc", 1.0, [], [1.0, 2.0], [[1.0, 2.0, 3.0]], [1.0, None, 2.0], [1.0, [2.0], 3.0], ["1", "2", "3"],
    np.ones((3, 1)), np.ones((3, 3)), np.ones((1, 3)), np.ones(3, complex), np.array([1.0, None, 2.0]), np.ones((3, 5)),
    {},
)  # fmt: skip
ESTIMATORS = {
    "least squares": lambda: RecursiveLeastSquares(np.zeros(3), np.eye(3)),
    "restarting": lambda: RestartingLeastSquares(np.zeros(3), np.eye(3)),
    "neural": lambda: NeuralProbe(SETTINGS["foam"]),
}


def vectors():
    """Three numbers in every form that an array of real numbers has."""
    fixed = np.array([1.0, 2.0, 3.0])
    fixed.flags.writeable = False
    unaligned = np.zeros(25, np.uint8)[1:].view(np.float64)
    yield from ([1, 2, 3], (1.0, 2.0, 3.0), fixed, unaligned, np.arange(6.0)[::2], np.arange(3.0)[::-1])
    for kind in (">f8", "f4", "f2", "i1", "u8", bool, np.longdouble):
        yield np.ones(3, kind)


@pytest.mark.parametrize("value", NUMBERS, ids=repr)
def test_a_number_of_any_type_is_a_float(value):
    cast = cast_number("a number", value)
    assert type(cast) is float
    assert cast == float(value)


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: repr(value)[:20])
def test_what_is_no_real_number_is_refused_by_its_name(value):
    with pytest.raises(InputError, match=r"^force must be a real number") as refused:
        cast_number("force", value)
    assert "\n" not in str(refused.value)


def test_arrays_of_any_type_are_cast_and_any_other_shape_is_refused():
    for vector in vectors():
        cast = cast_array("regressor", vector, (3,))
        assert cast.dtype == np.float64
        assert cast.flags.aligned
        np.testing.assert_array_equal(cast, vector)
    for vector in NO_VECTORS:
        with pytest.raises(InputError, match=r"^regressor must "):
            cast_array("regressor", vector, (3,))
    assert cast_array("regressors", np.ones((4, 3), int), (None, 3)).shape == (4, 3)


@pytest.mark.parametrize("make", ESTIMATORS.values(), ids=ESTIMATORS)
def test_an_estimator_takes_a_regressor_of_its_shape_alone(make):
    for vector in NO_VECTORS:
        one = make()
        with pytest.raises(InputError):
            one.update(vector, 1.0)
        with pytest.raises(InputError):
            one.update_many([vector], [1.0])
        assert np.array_equal(one.estimate().theta, make().estimate().theta)
    for force in NO_NUMBERS:
        with pytest.raises(InputError):
            make().update([1.0, 2.0, 3.0], force)


def test_loops_refuse_what_is_no_number():
    force, slide = ForceLoop(gains_of()), SlidingLoop(tuned())
    contact = ContactIdentifier("butterworth3:120", 1000.0, 0.004)
    before = force.state
    for value in NO_NUMBERS:
        for call in (
            lambda v: force.update(v, 0.0), lambda v: force.update(0.0, v), lambda v: force.update(0.0, 0.0, v),
            lambda v: setattr(force, "desired", v), lambda v: setattr(slide, "desired", v),
            lambda v: slide.update([0.0] * 3, [0.0] * 3, [0.0] * 3, v), lambda v: slide.update(v, *[[0.0] * 3] * 2),
            lambda v: contact.update(v, 0.0), lambda v: contact.update(0.0, v), force.limit_speed, slide.limit_speed,
        ):  # fmt: skip
            with pytest.raises(InputError):
                call(value)
    assert force.state == before


def test_a_bound_kernel_stays_safe_with_arrays_of_other_dimensions():
    @kernel
    def total(values):
        return values.sum()

    bound = BoundKernel(total)
    assert bound(np.ones(3)) == bound(np.ones(3)) == 3.0
    assert bound(np.ones((2, 2))) == 4.0
    assert bound(np.arange(6.0)[::2]) == 6.0
    assert bound(np.arange(3)) == 3
