"""Predicted uncertainty of a surface under an excitation, before the robot moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.excitation.spectra import covariance
from palpate.excitation.surfaces import Surface
from palpate.references.waves import Chirp, Multisine

Wave = Multisine | Chirp

ALL = ("K", "B", "M")
POWER_KNOWN = 0.3
"""Relative error of the position noise's power within the band of a fit, which is told from above that band."""


@dataclass(frozen=True)
class Prediction:
    """Of one surface.

    Args:
        surface: which.
        names: of the parameters that are identified.
        information: about them (of their logarithms) and the lag, of a second, shape (n, n).
        prior: information of the same parameters, shape (n, n).
        rounding: covariance by the rounding of the position, which repeats with the motion, shape (n, n).
        pull: share by which that rounding pulls each towards zero, shape (n,).
        force: lowest and highest force on the surface [N].
        travel: of the tip, from end to end [m].
    """

    surface: Surface
    names: tuple[str, ...]
    information: Array
    prior: Array
    rounding: Array
    pull: Array
    force: tuple[float, float]
    travel: float

    def half_widths(self, seconds: float) -> dict[str, float]:
        """95 % half-width of each parameter, as a share of its value, after so many seconds.

        A pull towards zero is corrected as well as the power of the rounding is known. No time makes that better, nor
        the rounding itself.
        """
        C = covariance(seconds * self.information, self.prior)
        C = C + self.rounding + np.diag((POWER_KNOWN * self.pull) ** 2)
        return {name: 1.96 * float(np.sqrt(C[i, i])) for i, name in enumerate(self.names)}


@dataclass(frozen=True)
class Made:
    """A wave about the mean force, and its predicted information.

    Args:
        wave: added to the mean force [N].
        predictions: one a surface.
        gap: by how much its spectrum may at most miss the best there is, as a share of the criterion.
    """

    wave: Wave
    predictions: tuple[Prediction, ...]
    gap: float

    def worst(self, seconds: float) -> dict[str, float]:
        """The largest half-width of each parameter on any surface, as a share of its value."""
        widths = [prediction.half_widths(seconds) for prediction in self.predictions]
        return {name: max(found[name] for found in widths) for name in self.predictions[0].names}

    def excess(self, seconds: float, precision: Mapping[str, float]) -> float:
        """The largest half-width per that asked for, of any parameter on any surface: at most 1 is good enough."""
        widths = self.worst(seconds)
        return max(widths[name] / asked for name, asked in precision.items())
