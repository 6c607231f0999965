"""What one tick costs, against as much bare arithmetic as its laws write down.

The yardstick is one compiled loop over plain numbers, as in C: so many sums, products, divisions, sines and
exponentials a step of the physics as are counted by running a tick on numbers that count. The compiler does some of the
tick's only once (the same sine for two laws), so that the ratio may well be below 1; it should not grow.
"""

import math
from types import SimpleNamespace
from typing import ClassVar

import numba
import numpy as np
from stopwatch import best

from palpate import _vector
from palpate.bench import build, load, march, start_at
from palpate.bench.row import COLUMNS
from palpate.bench.tick import compiled_march

TICKS = 20_000


class Counted(float):
    """A number that counts what is done with it."""

    tally: ClassVar = {"+-*": 0, "/": 0, "sin": 0, "exp": 0}


def _counting(name: str, kind: str) -> None:
    plain = getattr(float, name)

    def operation(self, *others):
        result = plain(self, *others)
        if result is NotImplemented:
            return result
        Counted.tally[kind] += 1
        return Counted(result)

    setattr(Counted, name, operation)


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul"):
    _counting(f"__{_name}__", "+-*")
for _name in ("truediv", "rtruediv"):
    _counting(f"__{_name}__", "/")


def _function(name, kind):
    def counting(*arguments):
        Counted.tally[kind] += 1
        return Counted(getattr(math, name)(*arguments))

    return counting


COUNTING_MATH = SimpleNamespace(
    sin=_function("sin", "sin"),
    cos=_function("cos", "sin"),
    exp=_function("exp", "exp"),
    sqrt=_function("sqrt", "/"),
    atan2=_function("atan2", "sin"),
)


def counted(value):
    """The same nested tuples with every number counted."""
    if isinstance(value, tuple):
        return (
            type(value)._make(map(counted, value))
            if hasattr(value, "_fields")
            else tuple(map(counted, value))
        )
    return Counted(value) if type(value) is float else value


def counts(bench) -> dict[str, int]:
    """Arithmetic operations of one step of the physics, with its share of the tick's."""
    loop, state = counted(bench.loop), counted(start_at(bench.loop, bench.q))
    Counted.tally.update(dict.fromkeys(Counted.tally, 0))
    _vector.math = COUNTING_MATH
    try:
        march(loop, state, 0, [Counted(0.1)], np.empty((1, len(COLUMNS))))
    finally:
        _vector.math = math
    return {kind: round(n / bench.loop.steps) for kind, n in Counted.tally.items()}


@numba.njit
def yardstick(steps, sums, divisions, sines, exponentials, x):
    """So many operations a step, in four chains that do not wait for each other."""
    a, b, c, d = x, x + 0.1, x + 0.2, x + 0.3
    for _ in range(steps):
        for _ in range(sums // 8):
            a = a * 0.999 + 0.1
            b = b * 0.998 + 0.1
            c = c * 0.997 + 0.1
            d = d * 0.996 + 0.1
        for _ in range(divisions // 4):
            a = 1.0 / (a + 1.0)
            b = 1.0 / (b + 1.0)
            c = 1.0 / (c + 1.0)
            d = 1.0 / (d + 1.0)
        for i in range(sines):
            a += math.sin(b + i)
        for i in range(exponentials):
            c += math.exp(-(d + i))
        a, c = a * 0.1, c * 0.1
    return a + b + c + d


def main() -> None:
    bench = build(load("foam-hybrid"))
    noise = np.random.default_rng(0).standard_normal(TICKS)
    out = np.empty((TICKS, len(COLUMNS)))
    n, steps = counts(bench), bench.loop.steps
    tick = best(lambda: compiled_march(bench.loop, start_at(bench.loop, bench.q), 0, noise, out)) / TICKS
    bare = best(lambda: yardstick(TICKS * steps, *n.values(), 0.1)) / TICKS
    told = f"{n['+-*']} sums and products, {n['/']} divisions, {n['sin']} sines, {n['exp']} exponentials"
    print(f"a step of the physics, with its share of the tick: {told}")
    print(f"one tick of {steps} steps: {1e6 * tick:.2f} us, {1e-3 / tick:.0f} times real time")
    print(f"as much bare arithmetic: {1e6 * bare:.2f} us; ratio {tick / bare:.2f}")


if __name__ == "__main__":
    main()
