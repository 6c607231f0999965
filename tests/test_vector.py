"""Every operator and function means the same on values, compiled, and on NumPy arrays."""

import inspect
import math

import numpy as np
import pytest

from palpate import _vector
from palpate._jit import kernel, law
from palpate._vector import Mat3, Vec3, atan2, clip, cos, exp, outer, resolve, sign, sin, solve, sqrt, trace

RNG = np.random.default_rng(11)
a_, b_ = RNG.uniform(-2.0, 2.0, (2, 3))
A_, B_ = RNG.uniform(-1.0, 1.0, (2, 3, 3)) + 2.0 * np.eye(3)
K = 0.7

EXACT = (
    "a + b, a - b, a * b, a / b, -a, abs(a), a + k, k + a, a - k, k - a, a * k, k * a, a / k, "
    "A + B, A - B, k * A, A / k, -A, A.T, outer(a, b), "
    "sign(a), clip(a, k), clip(a, abs(b)), sqrt(abs(a)), sign(k), clip(k, 0.5)"
)
ROUNDED = (
    "a @ b, A @ a, A @ B, A.T @ b, trace(A), "
    "exp(a), solve(A, a), resolve(A, a, B), exp(k), sqrt(k), sin(k), cos(k), atan2(k, -k)"
)


@law
def exact(a, b, A, B, k):
    vectors = (a + b, a - b, a * b, a / b, -a, abs(a), a + k, k + a, a - k, k - a, a * k, k * a, a / k)
    matrices = (A + B, A - B, k * A, A / k, -A, A.T, outer(a, b))
    functions = (sign(a), clip(a, k), clip(a, abs(b)), sqrt(abs(a)), sign(k), clip(k, 0.5))
    return vectors, matrices, functions


@law
def rounded(a, b, A, B, k):
    products = (a @ b, A @ a, A @ B, A.T @ b, trace(A))
    functions = (exp(a), solve(A, a), resolve(A, a, B), exp(k), sqrt(k), sin(k), cos(k), atan2(k, -k))
    return products, functions


@kernel
def both(a, b, A, B, k):
    return exact(a, b, A, B, k), rounded(a, b, A, B, k)


def names_and_values(expressions, found):
    names, depth = [""], 0
    for letter in expressions.replace("\n", ""):
        depth += (letter == "(") - (letter == ")")
        if letter == "," and depth == 0:
            names.append("")
        else:
            names[-1] += letter
    values = [value for group in found for value in group]
    assert len(names) == len(values)
    return {name.strip(): np.asarray(value) for name, value in zip(names, values, strict=True)}


def results(function, expressions, index):
    values = Vec3(*a_.tolist()), Vec3(*b_.tolist()), matrix(A_), matrix(B_), K
    plain = names_and_values(expressions, function(*values))
    compiled = names_and_values(expressions, both(*values)[index])
    arrays = names_and_values(expressions, function(a_, b_, A_, B_, K))
    return plain, compiled, arrays


def matrix(A):
    return Mat3(*(Vec3(*row.tolist()) for row in A))


def test_arithmetic_agrees_to_the_last_bit():
    plain, compiled, arrays = results(exact, EXACT, 0)
    for name in plain:
        assert np.array_equal(plain[name], compiled[name]), name
        assert np.array_equal(plain[name], arrays[name]), name


def test_sums_and_functions_agree_to_rounding():
    plain, compiled, arrays = results(rounded, ROUNDED, 1)
    for name in plain:
        np.testing.assert_allclose(compiled[name], plain[name], rtol=1e-15, err_msg=name)
        np.testing.assert_allclose(arrays[name], plain[name], rtol=1e-14, atol=1e-15, err_msg=name)


def test_every_function_of_the_module_is_among_them():
    here = {n: v for n, v in vars(_vector).items() if getattr(v, "__module__", "") == _vector.__name__}
    functions = {n for n, v in here.items() if inspect.isfunction(v)}
    assert functions - {"diagonal", "widen", "linear", "angular"} == {
        n for n in functions if f"{n}(" in EXACT + ROUNDED
    }


def test_numpy_numbers_leave_the_operators_to_the_values():
    a, k = Vec3(1.0, 2.0, 3.0), np.float64(2.0)
    for found in (k + a, a + k, k - a, k * a, a / k, np.float64(1.0) * Mat3(a, a, a)):
        assert isinstance(found, Vec3 | Mat3)
    assert k * a == Vec3(2.0, 4.0, 6.0)


def test_a_batch_is_a_vector_of_arrays():
    many = RNG.uniform(-2.0, 2.0, (3, 4, 5))
    batch = Vec3(*many)
    A = matrix(A_)
    for found, one in (
        (A @ batch, lambda v: A @ v),
        (solve(A, batch), lambda v: solve(A, v)),
        (exp(-(batch * batch)), lambda v: exp(-(v * v))),
        (clip(batch, 0.5), lambda v: clip(v, 0.5)),
        (sign(batch), sign),
    ):
        alone = Vec3(*(float(x) for x in many[:, 1, 2]))
        np.testing.assert_allclose([x[1, 2] for x in found], one(alone), rtol=1e-14)


@pytest.mark.parametrize("value", [0.0, -0.0, 1e-300, -1e-300, math.inf, -math.inf])
def test_sign_and_clip_at_the_edges(value):
    assert sign(value) == np.sign(value)
    assert clip(value, 1.0) == np.clip(value, -1.0, 1.0)
    assert sign(Vec3(value, 0.0, 1.0)).x == np.sign(value)
