"""Compliance and mass between position sensor and surface, removed from the identified parameters.

An arm of stiffness k in series with a surface of impedance Z is seen as Z k / (Z + k), and as Z k / (Z + k + m s^2)
where a tip of mass m swings between the two. Both channels pass through the same filters first, and the surface is
found from what they say together: nothing is subtracted from a position that the force's lag and noise would come with.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.estimators.answer import Answer
from palpate.identification.estimators.fit import Fit
from palpate.identification.result import DynamicStiffness, Press, Tangent
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.types import NORMAL

Linear = TypeVar("Linear", Answer, Fit)
"""Parameters with their covariance."""


def check(apparent: float, series: float) -> None:
    """Two springs in series are softer than either.

    Raises:
        InputError: the log is as stiff as what is said to be in series with the surface.
    """
    if abs(apparent) >= series:
        raise InputError(
            f"the series stiffness of {series:.4g} N/m is softer than the log's own {abs(apparent):.4g} N/m, but two"
            " springs in series are softer than either: check its value and unit (N/m), or leave it out"
        )


def without_series(found: Linear, series: float, series_std: float) -> Linear:
    """Parameters of the surface from those of both, to the second order of the frequency.

    With Z = K + B s + M s^2 seen as K_a + B_a s + M_a s^2: K = K_a k/(k - K_a), B = B_a r^2, M = M_a r^2 + B_a^2 r^3/k,
    r = k/(k - K_a). The covariance goes through the derivatives of these.
    """
    place = _places(found.names)
    check(found.theta[place["K"]], series)
    new, jacobian = _linearise(found.theta, place, series)
    moved = _seen_through(found.theta, place, series + series_std) - new
    return found.through(jacobian, new).with_cause("series stiffness", moved)


def without_swing(found: Linear, share: float, share_std: float, band: float) -> Linear:
    """Parameters of the surface where a tip of mass m swings on the arm's k: its Z/(1 + m s^2/k) was identified.

    To the second order of the frequency M is M_a + K m/k, K and B are as they were. The next orders make B_a and M_a
    too large by m omega^2/k of each at most, which is their half-width by this cause.

    Args:
        found: with the stiffness in series taken out.
        share: m/k [s^2].
        share_std: standard deviation of that [s^2].
        band: frequency below which the probe moved [Hz].
    """
    jacobian, missed = _swinging(found.names, share), _swinging(found.names, share_std)
    moved = missed @ found.theta - found.theta
    most = min(share * (2 * np.pi * band) ** 2, 1.0) / NORMAL
    beyond = most * found.theta * np.isin(found.names, ("B", "M"))
    return found.through(jacobian, jacobian @ found.theta).with_cause("tip's mass", np.hypot(moved, beyond))


def _swinging(names: tuple[str, ...], share: float) -> Array:
    """M + K share, and all else as it is, shape (p, p)."""
    place, matrix = _places(names), np.eye(len(names))
    if {"K", "M"} <= place.keys():
        matrix[place["M"], place["K"]] = share
    return matrix


def with_payload(found: Answer, std: float) -> Answer:
    """An answer whose mass errs by as much as that of a payload, which was taken out of the force [kg]."""
    return found.with_cause("tool's inertia", np.where(np.array(found.names) == "M", std, 0.0))


def _places(names: tuple[str, ...]) -> dict[str, int]:
    return {name: names.index(name) for name in ("K", "B", "M") if name in names}


def _linearise(theta: Array, place: dict[str, int], series: float) -> tuple[Array, Array]:
    """The surface's parameters and their derivatives by those of both, shapes (p,) and (p, p)."""
    new = _seen_through(theta, place, series)
    jacobian = np.eye(len(theta))
    for i in place.values():
        step = 1e-6 * max(abs(theta[i]), 1e-9)
        moved = theta.copy()
        moved[i] += step
        jacobian[:, i] = (_seen_through(moved, place, series) - new) / step
    return new, jacobian


def _seen_through(theta: Array, place: dict[str, int], series: float) -> Array:
    new = theta.copy()
    stiffness = theta[place["K"]]
    r = series / (series - stiffness)
    new[place["K"]] = stiffness * r
    if "B" in place:
        new[place["B"]] = theta[place["B"]] * r**2
    if "M" in place:
        damping = theta[place["B"]] if "B" in place else 0.0
        new[place["M"]] = theta[place["M"]] * r**2 + damping**2 * r**3 / series
    return new


def spectrum_without_series(
    spectrum: tuple[DynamicStiffness, ...], series: float, series_std: float
) -> tuple[DynamicStiffness, ...]:
    """Dynamic stiffness of the surface, Z k / (k - Z), with k's own deviation in the half-widths."""
    found = []
    for octave in spectrum:
        seen = complex(octave.storage, octave.loss)
        own = seen * series / (series - seen)
        gain = abs(series / (series - seen)) ** 2
        by_series = Contribution(series_std * abs(own / series) ** 2)
        storage, loss = octave.in_phase.through(own.real, gain), octave.in_quadrature.through(own.imag, gain)
        found.append(
            replace(
                octave,
                in_phase=storage.with_cause("series stiffness", by_series),
                in_quadrature=loss.with_cause("series stiffness", by_series),
            )
        )
    return tuple(found)


def spectrum_without_swing(
    spectrum: tuple[DynamicStiffness, ...], share: float, share_std: float
) -> tuple[DynamicStiffness, ...]:
    """Dynamic stiffness Z (1 + m s^2/k) of the surface, the deviation of m/k in its half-widths."""
    found = []
    for octave in spectrum:
        squared = (2.0 * np.pi * octave.frequency) ** 2
        gain, more = 1.0 - squared * share, squared * share_std
        storage, loss = (
            part.through(gain * part.value, gain).with_cause(
                "tip's mass", Contribution(more * abs(part.value))
            )
            for part in (octave.in_phase, octave.in_quadrature)
        )
        found.append(replace(octave, in_phase=storage, in_quadrature=loss))
    return tuple(found)


def slope_without_series(own: Measurement, series: float, series_std: float) -> Measurement:
    """The surface's slope from that of both.

    Args:
        own: slope that the log shows [N/m].
        series: stiffness in series [N/m].
        series_std: standard deviation of that [N/m].
    """
    check(own.value, series)
    gain = series / (series - own.value)
    value = gain * own.value
    by_series = Contribution(series_std * (value / series) ** 2)
    return own.through(value, gain**2).with_cause("series stiffness", by_series)


def slopes_without_series(found: Slopes, series: float, series_std: float) -> Slopes:
    """The same of the slopes of some loadings."""
    own = slope_without_series(found.stiffness, series, series_std)
    gain = (own.value / found.stiffness.value) ** 2
    return replace(found, stiffness=own, again=None if found.again is None else gain * found.again)


def press_without_series(press: Press, series: float, series_std: float) -> Press:
    """The press over the depth of the surface alone."""
    tangent = [
        Tangent(t.force, slope_without_series(t.slope, series, series_std))
        for t in press.tangent
        if t.stiffness < series
    ]
    curves = []
    for curve in (press.loading, press.unloading):
        own = curve.copy()
        if own.size:
            own[0] -= (own[1] - own[1][0]) / series
        curves.append(own)
    return replace(press, tangent=tuple(tangent), loading=curves[0], unloading=curves[1])
