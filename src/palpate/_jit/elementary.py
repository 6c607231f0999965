"""Elementary functions that are the same to the last bit in Python, compiled and in C: arithmetic alone."""

from math import floor, inf, nan

from palpate._jit.cache import law

_HALVINGS = (512.0, 256.0, 128.0, 64.0, 32.0, 16.0, 8.0, 4.0, 2.0, 1.0)
"""Powers of two of which every exponent of a number is the sum, with one over."""
_POWERS = tuple(2.0**e for e in _HALVINGS)
_ROOT = 2.0**0.5
_LN2_HIGH = 0.693147180369123816490
"""ln 2 in 33 bits, so that a multiple of it by an exponent is exact; the rest is `_LN2_LOW`."""
_LN2_LOW = 1.90821492927058770002e-10
_SERIES = tuple(2.0 / (2 * k + 3) for k in range(11))
"""Coefficients of 2 artanh(s)/s - 2 in s^2; the next would be below the last bit for s up to 0.172."""


@law
def log(x):
    """ln x, to a unit in the last place; -inf of 0, and NaN of what is below or is no number."""
    if not x > 0.0:
        return -inf if x == 0.0 else nan
    if x == inf:
        return inf
    rest, exponent = x, 0.0
    for i in range(10):
        if rest >= _POWERS[i]:
            rest, exponent = rest / _POWERS[i], exponent + _HALVINGS[i]
    while rest < 1.0:
        rest, exponent = 2.0 * rest, exponent - 1.0
    if rest > _ROOT:
        rest, exponent = 0.5 * rest, exponent + 1.0
    f = rest - 1.0
    s = f / (2.0 + f)
    z = s * s
    tail = 0.0
    for i in range(11):
        tail = z * (_SERIES[10 - i] + tail)
    return exponent * _LN2_HIGH + (f - (s * (f - tail) - exponent * _LN2_LOW))


_REMAINDER = (
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)
"""Coefficients in r^2 of r (e^r + 1)/(e^r - 1) - 2 for |r| <= ln 2/2, by Remez (fdlibm, e_exp.c)."""
_HIGHEST, _LOWEST = 709.782712893384, -745.1332191019411
"""Largest x with a finite e^x, and smallest with one that is not 0."""
_FAR = 2.0**64.0
"""Of powers of two that are beyond the sum of `_HALVINGS`, or near it."""


@law
def exp(x):
    """e^x, to a unit in the last place; inf above the largest number, and NaN of what is no number."""
    if not x <= _HIGHEST:
        return inf if x > 0.0 else nan
    if x < _LOWEST:
        return 0.0
    exponent = float(floor(x / (_LN2_HIGH + _LN2_LOW) + 0.5))
    high, low = x - exponent * _LN2_HIGH, exponent * _LN2_LOW
    r = high - low
    z = r * r
    tail = 0.0
    for i in range(5):
        tail = z * (_REMAINDER[4 - i] + tail)
    c = r - tail
    power = 1.0 - ((low - r * c / (2.0 - c)) - high)
    if abs(exponent) > 900.0:
        power, exponent = (
            (_FAR * power, exponent - 64.0) if exponent > 0.0 else (power / _FAR, exponent + 64.0)
        )
    for i in range(10):
        if exponent >= _HALVINGS[i]:
            power, exponent = power * _POWERS[i], exponent - _HALVINGS[i]
        elif -exponent >= _HALVINGS[i]:
            power, exponent = power / _POWERS[i], exponent + _HALVINGS[i]
    return power
