"""Rounding to steps, for every converter and encoder."""

from palpate._jit import law

# Adding this to a double leaves no bits below one: the sum is rounded to a whole number, ties to even. It
# works on numbers, vectors and arrays alike, up to 2^51 steps.
_WHOLE = 1.5 * 2.0**52


@law
def whole(u):
    """u to the nearest whole number."""
    return u + _WHOLE - _WHOLE


@law
def quantise(u, step):
    """u to the nearest multiple of step (mid-tread: zero is a level)."""
    return whole(u / step) * step
