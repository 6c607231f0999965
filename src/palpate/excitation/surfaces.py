"""The surfaces that an excitation is designed for: a range of stiffness, damping and mass, not one guess."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError

Range = tuple[float, float]


@dataclass(frozen=True)
class Surface:
    """One surface: f = M a + B v + K x.

    Args:
        stiffness: K [N/m].
        damping: B [N s/m].
        mass: M [kg]; 0 for a surface without one.
    """

    stiffness: float
    damping: float
    mass: float = 0.0

    def impedance(self, omega: Array) -> NDArray[np.complexfloating[Any, Any]]:
        """Force per displacement at angular frequencies [N/m], of their shape."""
        return self.stiffness + 1j * omega * self.damping - self.mass * omega**2

    @property
    def values(self) -> tuple[float, float, float]:
        """K, B, M."""
        return self.stiffness, self.damping, self.mass


@dataclass(frozen=True)
class SurfaceRange:
    """All surfaces between the lowest and the highest of each parameter.

    Args:
        stiffness: lowest and highest K [N/m].
        damping: lowest and highest B [N s/m].
        mass: lowest and highest M [kg]; None for surfaces without one, of which no mass is asked.

    Raises:
        InputError: a range that is upside down or not above 0.
    """

    stiffness: Range
    damping: Range
    mass: Range | None = None

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping", "mass"):
            ends = getattr(self, name)
            if ends is not None and not 0 < ends[0] <= ends[1] < np.inf:
                raise InputError(
                    f"{name} must be LOW:HIGH with 0 < LOW <= HIGH, got {ends[0]:g}:{ends[1]:g}; a relative "
                    "precision needs a value above 0"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters to identify: K and B, and M if there is one."""
        return ("K", "B") if self.mass is None else ("K", "B", "M")

    def surfaces(self) -> tuple[Surface, ...]:
        """The middle (of the logarithms) and the corners, each once."""
        ranges = (self.stiffness, self.damping, self.mass or (0.0, 0.0))
        corners = [Surface(*corner) for corner in product(*ranges)]
        middle = Surface(*(sqrt(low * high) for low, high in ranges))
        return tuple(dict.fromkeys([middle, *corners]))
