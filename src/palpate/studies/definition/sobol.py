"""Points of Sobol's sequence, one by one."""

from __future__ import annotations

from typing import Any


class Sobol:
    """Points of Sobol's sequence by their number; cheap when asked for one after the other."""

    def __init__(self, dimensions: int, seed: int):
        self._dimensions, self._seed = dimensions, seed
        self._engine: Any = None
        self._last: tuple[int, list[float]] = (-1, [])

    def point(self, number: int) -> list[float]:
        """The coordinates of a point, each in [0, 1)."""
        if self._last[0] != number:
            self._last = (number, self._drawn(number))
        return self._last[1]

    def _drawn(self, number: int) -> list[float]:
        from scipy.stats import qmc

        if self._engine is None or self._engine.num_generated > number:
            self._engine = qmc.Sobol(self._dimensions, scramble=True, rng=self._seed)
        if self._engine.num_generated < number:
            self._engine.fast_forward(number - self._engine.num_generated)
        point: list[float] = self._engine.random(1)[0].tolist()
        return point
