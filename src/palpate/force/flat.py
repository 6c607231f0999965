"""The law's numbers and its state as flat arrays: what a compiled call from Python takes without boxing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._jit import law
from palpate._vector import Mat3, Vec3
from palpate.force.law import Backstop, Bound, Cautious, CautiousState, Follow, Learned, Stage, Watch
from palpate.force.regression import Fit


def flattened(tree: Any) -> NDArray[np.float64]:
    """Every number of nested tuples, in their order, shape (n,)."""
    return np.array(list(_leaves(tree)))


def _leaves(tree: Any) -> Iterator[float]:
    for branch in tree:
        if isinstance(branch, tuple):
            yield from _leaves(branch)
        else:
            yield float(branch)


@law
def vector_in(a, i):
    """Three numbers from the i-th on."""
    return Vec3(a[i], a[i + 1], a[i + 2])


@law
def matrix_in(a, i):
    """Nine numbers from the i-th on."""
    return Mat3(vector_in(a, i), vector_in(a, i + 3), vector_in(a, i + 6))


@law
def law_in(a):
    """The law's numbers from an array."""
    return Cautious(
        a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], matrix_in(a, 11), vector_in(a, 20),
        vector_in(a, 23), vector_in(a, 26), a[29], a[30], a[31], a[32], a[33], a[34], a[35], a[36],
    )  # fmt: skip


@law
def state_in(a):
    """The state from an array."""
    return CautiousState(
        a[0],
        a[1],
        a[2],
        Watch(a[3], a[4], a[5], a[6], a[7]),
        Follow(vector_in(a, 8), a[11], a[12], a[13], a[14]),
        Stage(a[15], a[16], a[17]),
        Learned(fit_in(a, 18), fit_in(a, 30), a[42], a[43], vector_in(a, 44), vector_in(a, 47)),
        Bound(a[50], a[51]),
        Backstop(a[52], a[53], a[54], a[55], a[56], a[57]),
    )


@law
def fit_in(a, i):
    """A fit from twelve numbers."""
    return Fit(matrix_in(a, i), vector_in(a, i + 9))


@law
def put_vector(a, i, v):
    """Three numbers into an array."""
    a[i], a[i + 1], a[i + 2] = v.x, v.y, v.z


@law
def put_fit(a, i, fit):
    """Twelve numbers into an array."""
    put_vector(a, i, fit.N.r1)
    put_vector(a, i + 3, fit.N.r2)
    put_vector(a, i + 6, fit.N.r3)
    put_vector(a, i + 9, fit.r)


@law
def put_state(a, s):
    """The state into an array."""
    a[0], a[1], a[2] = s.ticks, s.desired, s.smooth
    w, f, k, b = s.watch, s.follow, s.known, s.backstop
    a[3], a[4], a[5], a[6], a[7] = w.last, w.mean, w.slow, w.variance, w.age
    put_vector(a, 8, f.z)
    a[11], a[12], a[13], a[14] = f.x, f.y, f.y0, f.origin
    a[15], a[16], a[17] = s.stage.phase, s.stage.since, s.stage.quiet
    put_fit(a, 18, k.slow)
    put_fit(a, 30, k.fast)
    a[42], a[43] = k.since, k.origin
    put_vector(a, 44, k.found)
    put_vector(a, 47, k.std)
    a[50], a[51] = s.bound.stiffness, s.bound.tau
    a[52], a[53], a[54], a[55], a[56], a[57] = b.care, b.sign, b.peak, b.before, b.swings, b.calm


STATE = 58
"""Numbers of a state."""
