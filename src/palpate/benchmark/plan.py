"""Desired force of the test: a touch from free motion, a step up and down, and a sum of sines."""

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

TOUCH, STEP, PERIOD, PERIODS = 4.0, 3.0, 2.0, 4
"""Durations of the touch with its approach and of each step, period of the sines [s]; number of periods."""
STEP_HEIGHT = 0.25
"""Height of a step over the desired force."""
LINES = (1, 2, 3, 5, 7, 11, 15, 21, 29, 41)
"""Frequencies of the sum, in units of 1/PERIOD: 0.5 to 20.5 Hz."""
LINE = 0.03
"""Amplitude of each sine, of the desired force."""
SWAY, SWAYS = 0.5, 3
"""Frequency of the surface's own motion [Hz], and periods of it that count."""
SWAY_FORCE = 0.25
"""Amplitude of the force that the surface's motion would cause on a tip that rests, of the desired force."""

LAYER = 0.75
"""Force at which the hardest surface of the test is met behind each other one, of the desired force."""
CABLE = 0.1
"""Force of a cable on the tool just before it lets go, at the surface, of the desired force."""


@dataclass(frozen=True)
class ForcePlan:
    """The test for one force and one rate.

    Args:
        force: F_d [N].
        rate: of the loop [Hz].

    Raises:
        InputError: a force or a rate that is not above 0.
    """

    force: float
    rate: float

    def __post_init__(self) -> None:
        for name, value in (("force", self.force), ("rate", self.rate)):
            if not 0.0 < value < np.inf:
                raise InputError(f"the {name} of the test must be above 0, got {value:g}")

    def ticks(self, seconds: float) -> int:
        """Ticks in a time."""
        return round(seconds * self.rate)

    @property
    def starts(self) -> tuple[int, int, int, int]:
        """First ticks of the step up, of the step down, of the sum of sines, and the end."""
        up = self.ticks(TOUCH)
        down = up + self.ticks(STEP)
        sines = up + 2 * self.ticks(STEP)
        return up, down, sines, sines + PERIODS * self.ticks(PERIOD)

    def desired_force(self) -> Array:
        """F_d at each tick [N], shape (n,)."""
        up, down, sines, end = self.starts
        force = np.full(end, self.force)
        force[up:down] *= 1.0 + STEP_HEIGHT
        force[sines:] += self.sines()
        return force

    def sines(self) -> Array:
        """The sum of sines [N], with Schroeder's phases, shape (PERIODS * period,)."""
        period = self.ticks(PERIOD)
        turn = 2.0 * np.pi * np.arange(PERIODS * period) / period
        phases = -np.pi * np.arange(len(LINES)) ** 2 / len(LINES)
        return LINE * self.force * sum(np.sin(k * turn + p) for k, p in zip(LINES, phases, strict=True))

    def steady(self) -> Array:
        """F_d while the surface moves [N], shape (n,)."""
        return np.full(self.ticks(TOUCH + SWAYS / SWAY), self.force)
