"""The law's numbers and its state as flat arrays: what a compiled call from Python takes without boxing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._jit import law
from palpate._vector import Mat3, Vec3
from palpate.force.contact_evidence import Watch
from palpate.force.law import Backstop, Cautious, CautiousState, Follow, Learned, Stage
from palpate.force.onset import Line, Starts
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
        a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], matrix_in(a, 12), vector_in(a, 21),
        vector_in(a, 24), vector_in(a, 27), a[30], a[31], a[32], a[33], a[34], a[35], a[36], a[37],
    )  # fmt: skip


@law
def state_in(a):
    """The state from an array."""
    return CautiousState(
        a[0],
        a[1],
        Watch(a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10]),
        Follow(vector_in(a, 11), a[14], a[15], a[16], a[17]),
        Stage(a[18], a[19], a[20], a[21]),
        Learned(fit_in(a, 22), fit_in(a, 34), a[46], a[47], vector_in(a, 48), vector_in(a, 51)),
        starts_in(a, 54),
        a[91],
        Backstop(a[92], a[93], a[94], a[95], a[96], a[97]),
    )


@law
def starts_in(a, i):
    """Starts from 37 numbers."""
    return Starts(
        a[i], line_in(a, i + 1), line_in(a, i + 7), line_in(a, i + 13), line_in(a, i + 19), line_in(a, i + 25),
        line_in(a, i + 31),
    )  # fmt: skip


@law
def line_in(a, i):
    """A line from six numbers."""
    return Line(a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5])


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
def put_line(a, i, line):
    """Six numbers into an array."""
    a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5] = line.x, line.n, line.u, line.uu, line.f, line.uf


@law
def put_starts(a, i, s):
    """37 numbers into an array."""
    a[i] = s.readings
    put_line(a, i + 1, s.newest)
    put_line(a, i + 7, s.a)
    put_line(a, i + 13, s.b)
    put_line(a, i + 19, s.c)
    put_line(a, i + 25, s.d)
    put_line(a, i + 31, s.oldest)


@law
def put_state(a, s):
    """The state into an array."""
    a[0], a[1] = s.ticks, s.desired
    w, f, k, b = s.watch, s.follow, s.known, s.backstop
    a[2], a[3], a[4], a[5] = w.last, w.mean, w.slow, w.rest
    a[6], a[7], a[8], a[9], a[10] = w.variance, w.tide, w.evidence, w.age, w.gap
    put_vector(a, 11, f.z)
    a[14], a[15], a[16], a[17] = f.x, f.y, f.y0, f.origin
    a[18], a[19], a[20], a[21] = s.stage.phase, s.stage.since, s.stage.quiet, s.stage.firm
    put_fit(a, 22, k.slow)
    put_fit(a, 34, k.fast)
    a[46], a[47] = k.since, k.origin
    put_vector(a, 48, k.found)
    put_vector(a, 51, k.std)
    put_starts(a, 54, s.starts)
    a[91] = s.bound
    a[92], a[93], a[94], a[95], a[96], a[97] = b.care, b.sign, b.peak, b.before, b.swings, b.calm


STATE = 98
"""Numbers of a state."""
LAST, VARIANCE, TIDE, PHASE, SINCE, FOUND, STD, BOUND = 2, 6, 7, 18, 46, 48, 51, 91
"""Where some of them are."""
