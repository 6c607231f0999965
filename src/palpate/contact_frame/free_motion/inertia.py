"""By which mass does a force follow the acceleration while nothing is touched?

A tool of mass m adds -m a to what it exerts on its sensor. A driver that takes this off leaves nothing; one that takes
it off with the wrong sign leaves +m a, which in contact no log of second order tells from a lag and a damping.

No acceleration is measured. With a smooth function phi that vanishes at both ends of a window, partial integration
gives int phi a = int phi'' p (the modulating functions of Shinbrot, 1957), so that the position itself serves. Sums
over rows and second differences obey the same rule exactly. The window is the one that tells the mass best.
"""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask

_WINDOWS = np.geomspace(0.04, 2.0, 9)
"""Lengths that are tried [s]."""
_ROWS = 12
"""Fewest rows of a window: of a motion of one period a window, a second difference over n rows lacks (pi/(n - 1))^2/3
of the acceleration, here 3 %."""
BLOCKS = 20
"""Parts of the log, each of which is left out once."""
CHANCE = 1e-3
"""How probable a doubt may be by chance alone."""


def free_inertia(time: Array, force: Array, place: Array, free: Mask) -> tuple[float, float] | None:
    """The mass m of f = -m a, and its standard deviation [kg]; None if the log does not determine it.

    Args:
        time: of the rows [s], shape (n,).
        force: that the tool exerts on its sensor, in the base, without weight and bias [N], shape (n, 3); NaN without a
            reading. Of a contact that is the reaction.
        place: of the tool's centre of mass, in the base [m], shape (n, 3), likewise.
        free: rows in which nothing is touched, shape (n,).
    """
    there = np.isfinite(force).all(axis=1) & np.isfinite(place).all(axis=1) & free
    dt = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not dt > 0.0:
        return None
    found = [_by_window(force, place, there, dt, round(length / dt)) for length in _WINDOWS]
    told = [one for one in found if one is not None and np.isfinite(one[1])]
    if not told:
        return None
    best = min(range(len(told)), key=lambda i: told[i][1])
    # A least deviation is also one that fell out too small: its neighbours' say how large it is.
    return told[best][0], max(std for _, std in told[max(best - 1, 0) : best + 2])


def wrong_sign(inertia: tuple[float, float] | None) -> bool:
    """Whether a force follows the acceleration against the sense in which a tool's mass makes it."""
    from scipy.special import stdtrit

    return inertia is not None and inertia[0] < -float(stdtrit(BLOCKS - 1, 1 - CHANCE)) * inertia[1]


def wrong_sign_of(inertia: tuple[float, float]) -> str:
    """Text of the warning."""
    return (
        f"in free motion the force follows the acceleration as a mass of {inertia[0]:.3g} kg (std {inertia[1]:.2g})"
        " would: the tool's inertia is compensated with the wrong sign, or twice"
    )


def _by_window(force: Array, place: Array, there: Mask, dt: float, n: int) -> tuple[float, float] | None:
    """Windows of n rows that overlap by half, all of whose rows are there."""
    if n < _ROWS or len(force) < n:
        return None
    s = np.linspace(-1.0, 1.0, n)
    phi = s * (1.0 - s**2) ** 3  # odd, so that a bias that is left in the force does not matter
    bend = np.diff(np.r_[0.0, phi, 0.0], 2) / dt**2
    starts = np.arange(0, len(force) - n + 1, max(n // 2, 1))
    whole = np.r_[0, np.cumsum(there)]
    starts = starts[whole[starts + n] - whole[starts] == n]
    if len(starts) < BLOCKS:
        return None
    y = np.array([phi @ force[i : i + n] for i in starts])
    z = np.array([bend @ place[i : i + n] for i in starts])
    return _slope(y, z, _noise(place[there]) * float(bend @ bend))


def _slope(y: Array, z: Array, noise: float) -> tuple[float, float] | None:
    """-y over z by least squares, less what noise of the position adds; std by leaving blocks out."""
    blocks = np.array_split(np.arange(len(y)), BLOCKS)
    top = np.array([np.sum(y[b] * z[b]) for b in blocks])
    bottom = np.array([np.sum(z[b] ** 2) - 3.0 * noise * len(b) for b in blocks])
    if not bottom.sum() > 3.0 * noise * len(y):  # the motion has to stand out of the noise
        return None
    left = -(top.sum() - top) / (bottom.sum() - bottom)
    spread = np.sum((left - left.mean()) ** 2)
    return float(-top.sum() / bottom.sum()), float(np.sqrt((BLOCKS - 1) / BLOCKS * spread))


def _noise(place: Array) -> float:
    """Variance of a reading of the position, of an axis [m^2], by third differences."""
    if len(place) < 5:
        return 0.0
    return float(np.mean(np.diff(place, 3, axis=0) ** 2)) / 20.0
