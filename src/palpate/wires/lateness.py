"""How late a loop runs over a wire, and whether that is within what its certificate allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

CLOCKS = 1e-4
"""Rate at which two clocks may run apart [s/s]: twice what quartz does."""
SHARES = (50.0, 99.0, 99.9)


@dataclass(frozen=True)
class Lateness:
    """Age of the readings when their command had gone out, beyond the least that was seen.

    Args:
        ticks: how many there were.
        late: at 50, 99 and 99.9 % and the most [s].
        missed: readings that never came.
        jumps: ticks whose reading was later than the certificate allows.
        allowed: by which it may be [s]; None without a certificate.
    """

    ticks: int
    late: tuple[float, float, float, float]
    missed: int
    jumps: int
    allowed: float | None

    def sentences(self) -> list[str]:
        """Sentences."""
        a, b, c, most = (1e3 * v for v in self.late)
        late = (
            f"late by {a:.3g} ms (50 %), {b:.3g} (99 %), {c:.3g} (99.9 %), {most:.3g} at most, in {self.ticks} ticks;"
            f" {self.missed} readings missed"
        )
        lines = [late]
        if self.allowed is None:
            lines.append(
                "no certificate was given (palpate certify makes one): nothing is proved of this loop"
            )
        elif self.jumps or self.missed:
            lines.append(
                f"the certificate does not cover this run: it allows a reading to be late by"
                f" {1e3 * self.allowed:.3g} ms; {self.jumps} ticks exceeded that, {self.missed} readings were missed"
            )
        else:
            lines.append(f"within the {1e3 * self.allowed:.3g} ms of jitter that the certificate allows")
        return lines

    def to_json(self) -> dict[str, Any]:
        """As plain JSON values."""
        names = ("p50_s", "p99_s", "p99.9_s", "most_s")
        return {
            "ticks": self.ticks,
            **dict(zip(names, self.late, strict=True)),
            "missed": self.missed,
            "jumps": self.jumps,
            "allowed_s": self.allowed,
        }


class Stopwatch:
    """The age of each reading, by two clocks that nobody has set to each other.

    Args:
        tick: nominal [s].
        allowed: jitter of the certificate [s]; None without one.
        most: ticks that there may be.
    """

    def __init__(self, tick: float, allowed: float | None, most: int):
        self._tick, self._allowed = tick, allowed
        self._ages = np.zeros(most)
        self._n, self._missed, self._jumps = 0, 0, 0
        self._offset, self._at = np.inf, 0.0

    def age(self, stamp: float, now: float) -> float:
        """Of a reading of this stamp, beyond the least that was seen [s]."""
        self._offset = min(self._offset + CLOCKS * max(now - self._at, 0.0), now - stamp)
        self._at = now
        return now - stamp - self._offset

    def done(self, stamp: float, now: float, missed: int) -> None:
        """The command of a reading has gone out."""
        age = self.age(stamp, now)
        if self._allowed is not None and age > self._allowed:
            self._jumps += 1
        self._missed += missed
        if self._n < len(self._ages):
            self._ages[self._n] = age
            self._n += 1

    def summary(self) -> Lateness:
        """The measured lateness."""
        ages = self._ages[: self._n] if self._n else np.zeros(1)
        a, b, c = (float(v) for v in np.percentile(ages, SHARES))
        return Lateness(self._n, (a, b, c, float(ages.max())), self._missed, self._jumps, self._allowed)
