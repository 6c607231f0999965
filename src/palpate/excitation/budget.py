"""Limits of an excitation for the robot and the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from palpate.errors import InputError

_ROUNDS = 40
_CAUTION = 0.7  # the power of each correction: a whole one would overshoot where friction gives way
_CLOSE = 1e-3
"""To the budget, as a share of it."""


@dataclass(frozen=True)
class Budget:
    """Limits of the desired force, and of the force that the surface will feel.

    Args:
        mean: about which the force varies [N].
        peak: highest force [N].
        least: lowest force, so that contact is kept [N].
        lowest, highest: frequencies in use [Hz].
        rate: fastest change of the desired force [N/s].
        drive: largest departure of the desired force from its mean [N]; as for the force on the surface when None.
            A loop that is slow lets little of the desired force through, so more may be asked for than shall arrive.

    Raises:
        InputError: limits that leave nothing.
    """

    mean: float
    peak: float
    least: float = 2.0
    lowest: float = 0.5
    highest: float = 40.0
    rate: float = inf
    drive: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.least < self.mean < self.peak < inf:
            raise InputError(
                f"the force must obey 0 <= least < mean < peak, got least {self.least:g} N, mean {self.mean:g} N, "
                f"peak {self.peak:g} N"
            )
        if not 0 < self.lowest < self.highest < inf:
            raise InputError(
                f"the frequencies must obey 0 < lowest < highest, got {self.lowest:g} and {self.highest:g} Hz"
            )
        if self.drive is not None and not 0 < self.drive < inf:
            raise InputError(
                f"the desired force must depart from its mean by more than 0 N, got {self.drive:g}"
            )
        if not self.rate > 0:
            raise InputError(f"the force's rate of change must be above 0 N/s, got {self.rate:g}")

    @property
    def swing(self) -> float:
        """How far the force on the surface may depart from its mean [N]."""
        return min(self.peak - self.mean, self.mean - self.least)

    @property
    def desired_swing(self) -> float:
        """How far the desired force may depart from its mean [N]."""
        return self.swing if self.drive is None else self.drive

    def share(self, peak: float, slope: float) -> float:
        """Factor of a desired force that uses up its budget.

        Args:
            peak: how far it departs from its mean [N].
            slope: its fastest change [N/s].
        """
        return min(self.desired_swing / peak, self.rate / slope)


def used_up(share: Callable[[float], float], strength: float) -> float:
    """The strength at which an excitation uses up its budget.

    Args:
        share: of the budget over what a strength takes of it; friction makes that grow faster than the strength.
        strength: to start from.
    """
    for _ in range(_ROUNDS):
        left = share(strength)
        strength *= left**_CAUTION
        if abs(left - 1) < _CLOSE:
            break
    return strength
