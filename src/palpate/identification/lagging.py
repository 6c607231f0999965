"""What a log says about the lag between its channels, when nobody has calibrated it.

If the force is read T later than the position, a fit without T finds B - K T for the damping and M - B T + K T^2 / 2
for the mass. So a lag is told from damping only by what happens at higher frequencies; slow or narrow motion
does not show it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.fit import Fit, fit, profile
from palpate.identification.models import KELVIN_VOIGT, Model, Motion
from palpate.identification.prior import Lag

Array = NDArray[np.float64]

_LONGEST = 0.25
_SHARE = 1 / 50
_WALK = (-1.0, -0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
_WALK_UP_TO = 50_000
_FLAT = 1e-3
"""Share of the rms misfit that no log tells two lags apart by: the model's own error is larger."""
_PARABOLAS = 3


def unknown_lag(motion: Motion, rate: float, mass: tuple[float, float] | None = None) -> Lag:
    """How large a lag may be that nobody has said anything about: two readings, or a fiftieth of the contact.

    Args:
        motion: of the log.
        rate: fresh readings per second [1/s].
        mass: what is known of it.
    """
    std = float(np.clip(motion.duration * _SHARE, 2 / rate, max(_LONGEST, 2 / rate)))
    return Lag(0.0, std, known=False, mass=mass)


def freed(fixed: Fit, motion: Motion, force: Array, lag: Lag) -> Fit:
    """The same model with the lag looked for in the log; the fit given, if the log cannot tell the lag."""
    if lag.known:
        return fixed
    free = fit(fixed.model, motion, force, _start(fixed, motion, force, lag), free_lag=True)
    told = free.std("lag") < 0.5 * lag.std and abs(free.lag - lag.value) < 2.9 * lag.std
    return free if told else fixed


def _start(fixed: Fit, motion: Motion, force: Array, lag: Lag) -> Lag:
    """Where to look for the lag: the misfit may have several valleys, so a coarse walk comes first."""
    if len(motion.position) > _WALK_UP_TO:
        return lag
    steps = [lag.value + share * lag.std for share in _WALK]
    fits = [profile(fixed, motion, force, step) for step in steps]
    return Lag(steps[int(np.argmin(fits))], lag.std, known=False)


def _elastic(motion: Motion, _knobs: dict[str, float], lag: float) -> list[Array]:
    """f = a curve of x alone: what is left of a passive contact when loading and unloading coincide."""
    powers = [motion.power(n, lag) for n in (2, 3)]
    return [motion.moved(0, lag), *powers, motion.ones]


ELASTIC = Model("elastic", ("K", "K2", "K3", "offset"), _elastic)


def closing_lag(motion: Motion, force: Array, start: float, spans: NDArray[np.intp]) -> tuple[float, float]:
    """The lag that makes loading and unloading coincide, and its standard deviation [s].

    A passive contact gives back less than it takes, so the true lag is this one or longer. The deviation is that over
    the contacts where there are several, for they share the noise's slow part and the model's error.

    Args:
        motion: of the log.
        force: filtered, at the motion's rows, shape (n,).
        start: first guess, -B/K of a fit without a lag [s].
        spans: number of the contact that each row belongs to, shape (n,).
    """
    start = float(np.clip(start, -motion.duration, motion.duration))  # a K of nearly nothing makes it endless
    whole = fit(
        ELASTIC, motion, force, Lag(start, max(abs(start), 2 * motion.chain.dt), False), free_lag=True
    )
    lags = []
    for number in np.unique(spans):
        inside = spans == number
        if inside.sum() < 60 or len(np.unique(spans)) < 3:
            continue
        part = Motion(motion.chain, motion.position, motion.rows[inside], motion.bonded)
        known = Lag(whole.lag, max(abs(whole.lag), 2 * motion.chain.dt), False)
        lags.append(fit(ELASTIC, part, force[inside], known, free_lag=True).lag)
    spread = float(np.std(lags, ddof=1)) if len(lags) >= 3 else 0.0
    return whole.lag, max(spread, whole.std("lag"))


def flat_between(motion: Motion, force: Array, lag: float, std: float) -> tuple[float, float]:
    """Between which lags [s] the misfit of a spring and a damper stays within a thousandth of its least.

    A longer lag with more damping is nearly the same force, so the misfit runs through a wide valley, taken here for a
    parabola as wide as what is flat of it.

    Args:
        motion: of the log.
        force: filtered, at the motion's rows, shape (n,).
        lag: near the valley's bottom [s].
        std: how far from it the valley is asked [s].
    """
    plain = fit(KELVIN_VOIGT, motion, force, Lag(lag))
    bottom, half = lag, max(2 * std, motion.chain.dt)
    for _ in range(_PARABOLAS):
        if max(abs(bottom), half) > motion.duration:  # flat over more than the log can tell
            break
        bottom, half = _parabola(plain, motion, force, bottom, half)
    return bottom - half, bottom + half


def _parabola(plain: Fit, motion: Motion, force: Array, middle: float, step: float) -> tuple[float, float]:
    """Bottom of the parabola through three misfits, and how far from it the misfit has grown by a thousandth [s]."""
    before, here, after = (np.sqrt(profile(plain, motion, force, middle + k * step)) for k in (-1, 0, 1))
    bend = (before - 2 * here + after) / step**2
    if bend <= 0:
        return middle, float("inf")
    slope = (after - before) / (2 * step)
    least = here - slope**2 / (2 * bend)
    return float(middle - slope / bend), float(np.sqrt(2 * _FLAT * max(least, 0.0) / bend))
