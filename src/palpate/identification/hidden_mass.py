"""How large a mass a lag found in the log may hide, and what the other parameters would be with it.

To second order, a lag of the force that is T longer adds K T to the damping and B T to the mass. So a contact without
a mass at one lag and the same contact with a mass at a longer lag give nearly the same force; a log tells them apart
only by what happens at higher frequencies. The lag may be stretched until the misfit says no (a profile likelihood).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.identification.choosing import Question
from palpate.identification.estimators.fit import Fit, fit, profile
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS
from palpate.identification.prior import Lag

_TOLD = 0.5
_HALVINGS = 6


@dataclass(frozen=True)
class HiddenMass:
    """The model with the largest mass that describes the log as well as the one without.

    Args:
        mass: at most hidden [kg].
        shifts: how far K [N/m], B [N s/m] and the lag [s] are from those of the model without a mass.
    """

    mass: float
    shifts: dict[str, float]


def hidden_mass(plain: Fit, question: Question) -> HiddenMass | None:
    """What may hide behind the lag of a fit without a mass; None if its lag is calibrated or not told by the log."""
    lag = question.lag
    if plain.model is not KELVIN_VOIGT or lag.known or plain.std("lag") >= _TOLD * lag.std:
        return None
    stretched = plain.lag + _stretch(plain, question)
    far = fit(KELVIN_VOIGT_MASS, question.motion, question.force, Lag(stretched))
    if far["M"] <= 0:
        return None
    return HiddenMass(far["M"], {name: far[name] - plain[name] for name in ("K", "B", "lag")})


def _stretch(plain: Fit, question: Question) -> float:
    """How much longer the lag may be before the model with a mass misses the log by more than chance [s]."""
    motion, force = question.motion, question.force
    with_mass = fit(KELVIN_VOIGT_MASS, motion, force, Lag(plain.lag))
    best = plain.rmse**2 * len(force)
    allowed = 1 + plain.t**2 / plain.noise.effective

    def holds(longer: float) -> bool:
        nonlocal best
        misfit = profile(with_mass, motion, force, plain.lag + longer)
        best = min(best, misfit)
        return misfit <= allowed * best

    most = 3 * question.lag.std
    good, bad = 0.0, min(max(2 * plain.std("lag"), 0.02 / motion.chain.rate), most)
    while holds(bad):
        good, bad = bad, 2 * bad
        if bad > most:
            return good
    for _ in range(_HALVINGS):
        middle = (good + bad) / 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return bad


def before_position(fitted: Fit) -> bool:
    """Whether the force seems to be read before the position by more than chance: no force sensor does that."""
    return bool(np.isfinite(fitted.std("lag")) and fitted.lag + 3 * fitted.std("lag") < 0)
