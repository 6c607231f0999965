"""The unknowns of the thesis' laboratory: for each its physical range, its prior, and why."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Literal

Prior = Literal["even", "log-even", "one of", "any seed"]


@dataclass(frozen=True)
class Unknown:
    """One of them.

    Args:
        name: field of `Laboratory`.
        unit: of its values; "" for a number without.
        prior: how likely values are beforehand: even, even in the logarithm, or one of a few, each as likely.
        low, high: range; the first and the last where it is one of a few.
        reason: of the range.
        choices: where it is one of a few.
    """

    name: str
    unit: str
    prior: Prior
    low: float
    high: float
    reason: str
    choices: tuple[float, ...] = ()

    def at(self, share: float) -> float:
        """The value below which this share of the prior lies, 0 to 1."""
        if self.prior == "log-even":
            return math.exp((1.0 - share) * math.log(self.low) + share * math.log(self.high))
        if self.prior == "even":
            return (1.0 - share) * self.low + share * self.high
        values = self.choices or tuple(range(int(self.low), int(self.high) + 1))
        return float(values[min(int(share * len(values)), len(values) - 1)])

    def holds(self, value: float) -> bool:
        """Whether a value lies in the range."""
        if self.choices:
            return value in self.choices
        return self.low <= value <= self.high

    @property
    def redrawn(self) -> bool:
        """Whether neighbours mean nothing, so that a search draws it anew."""
        return self.prior in {"one of", "any seed"}


LINEAR, RELAXING, STIFFENING = 0.0, 1.0, 2.0
"""Laws of the foam."""
LAWS = {LINEAR: "spring and damper", RELAXING: "relaxes", STIFFENING: "stiffens with depth"}
LISTING = -1.0
"""The controller's initial weights are those of the listing."""


def _unknown(name: str, row: Mapping[str, Any]) -> Unknown:
    choices = tuple(row.get("choices", ()))
    low, high = row.get("range", (*choices[:1], *choices[-1:]))
    return Unknown(name, row.get("unit", ""), row["prior"], low, high, row["reason"], choices)


_ROWS = tomllib.loads((resources.files("palpate_laboratory") / "unknowns.toml").read_text("utf-8"))
UNKNOWNS = tuple(_unknown(name, row) for name, row in _ROWS.items())
BY_NAME = {unknown.name: unknown for unknown in UNKNOWNS}
