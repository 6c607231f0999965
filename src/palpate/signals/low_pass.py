"""Low-passes of a force sensor before its sampling, in continuous time."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi, sin

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError

_HIGHEST_ORDER = 10
"""Of a Butterworth filter; sensors and their drivers have one to four."""
_SECTION = re.compile(r"butterworth(\d+):(-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?:hz)?")
_FORM = "butterworth3:120 (order and cut-off in Hz), several joined by '+', or none"


@dataclass(frozen=True)
class LowPass:
    """Butterworth low-passes one after the other.

    Args:
        sections: order and cut-off [Hz] of each; none at all passes everything.
    """

    sections: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        for order, cutoff in self.sections:
            if not 1 <= order <= _HIGHEST_ORDER:
                raise InputError(f"a low-pass has an order of 1 to {_HIGHEST_ORDER}, got {order}")
            if not 0 < cutoff < np.inf:
                raise InputError(f"a low-pass needs a cut-off above 0 Hz, got {cutoff:g}")

    @classmethod
    def parse(cls, text: str) -> LowPass:
        """The low-passes that a text names: `butterworth3:120`, `butterworth3:120+butterworth2:120`, or `none`.

        Raises:
            InputError: another text, an order or a cut-off out of range.
        """
        word = text.strip().lower().replace(" ", "")
        if word == "none":
            return cls()
        found = [_SECTION.fullmatch(section) for section in re.split(r"\+(?=b)", word)]
        if not all(found):
            raise InputError(f"a force filter is given as {_FORM}; got {text!r}")
        return cls(tuple((int(section[1]), float(section[2])) for section in found if section))

    def __str__(self) -> str:
        return "+".join(f"butterworth{order}:{cutoff:.12g}" for order, cutoff in self.sections) or "none"

    @property
    def lag(self) -> float:
        """Delay of slow signals [s]: 1/(w sin(pi/2n)) for order n."""
        return sum(1 / (2 * pi * cutoff * sin(pi / (2 * order))) for order, cutoff in self.sections)

    @property
    def decay(self) -> float:
        """Rate at which the slowest mode of it dies away [1/s]; infinite where there is no low-pass."""
        rates = [2 * pi * cutoff * sin(pi / (2 * order)) for order, cutoff in self.sections]
        return min(rates, default=float("inf"))

    @property
    def roll_off(self) -> int:
        """How many derivatives of a signal come through it without growing with the frequency."""
        return sum(order for order, _ in self.sections)

    @property
    def cutoff(self) -> float:
        """The lowest cut-off [Hz]; infinite where there is no low-pass."""
        return min((cutoff for _, cutoff in self.sections), default=float("inf"))

    def at(self, omega: Array) -> NDArray[np.complex128]:
        """The complex gain at angular frequencies [rad/s], of their shape."""
        gain = np.ones(np.shape(omega), complex)
        for order, cutoff in self.sections:
            s = 1j * omega / (2 * pi * cutoff)
            for k in range(order):
                gain /= s - np.exp(1j * pi * (2 * k + order + 1) / (2 * order))
        return gain
