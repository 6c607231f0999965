"""Free motion in a log of wrench and pose: its rows, its force level, and the inertia that it shows."""

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.contacts import contacts_of
from palpate.identification.free_motion import find_free_motion
from palpate.identification.sampling import channels_of
from palpate.records import Record
from palpate.signals.samples import outer_range

MIN_ROWS = 20
"""Rows for a mean that is said of a log: its standard deviation is then a fifth of a reading's, or less."""


def finite_rows(vectors: Array) -> Mask:
    """Rows of vectors, shape (n, k), that hold a reading in each component."""
    return np.isfinite(vectors.sum(axis=1))


_WINDOWS = np.geomspace(0.04, 2.0, 9)
"""Lengths that are tried [s]."""
_MIN_WINDOW_ROWS = 12
"""Fewest rows of a window: of a motion of one period a window, a second difference over n rows lacks (pi/(n - 1))^2/3
of the acceleration, here 3 %."""
BLOCKS = 20
"""Parts of the log for the jackknife."""
FALSE_ALARM_RATE = 1e-3
"""Probability of a false warning by chance alone."""


def free_inertia(time: Array, force: Array, position: Array, free: Mask) -> tuple[float, float] | None:
    """The mass m of f = -m a, and its standard deviation [kg]; None if the log does not determine it.

    Args:
        time: of the rows [s], shape (n,).
        force: that the tool exerts on its sensor, in the base, without weight and bias [N], shape (n, 3); NaN without a
            reading. Of a contact that is the reaction.
        position: of the tool's centre of mass, in the base [m], shape (n, 3), likewise.
        free: rows in which nothing is touched, shape (n,).
    """
    usable = np.isfinite(force).all(axis=1) & np.isfinite(position).all(axis=1) & free
    dt = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not dt > 0.0:
        return None
    fits = [_fit_windows(force, position, usable, dt, round(length / dt)) for length in _WINDOWS]
    valid = [fit for fit in fits if fit is not None and np.isfinite(fit[1])]
    if not valid:
        return None
    best = min(range(len(valid)), key=lambda i: valid[i][1])
    # The smallest standard deviation may be too small by chance; those of the neighbouring windows bound it.
    return valid[best][0], max(std for _, std in valid[max(best - 1, 0) : best + 2])


def has_wrong_sign(inertia: tuple[float, float] | None) -> bool:
    """True if a force follows the acceleration against the sense in which a tool's mass makes it."""
    from scipy.special import stdtrit

    return inertia is not None and inertia[0] < -float(stdtrit(BLOCKS - 1, 1 - FALSE_ALARM_RATE)) * inertia[1]


def wrong_sign_text(inertia: tuple[float, float]) -> str:
    """Text of the warning."""
    return (
        f"in free motion the force follows the acceleration as a mass of {inertia[0]:.3g} kg (std {inertia[1]:.2g})"
        " would: the tool's inertia is compensated with the wrong sign, or twice"
    )


def _fit_windows(
    force: Array, position: Array, usable: Mask, dt: float, n: int
) -> tuple[float, float] | None:
    """Windows of n rows that overlap by half, all of whose rows are there."""
    if n < _MIN_WINDOW_ROWS or len(force) < n:
        return None
    s = np.linspace(-1.0, 1.0, n)
    phi = s * (1.0 - s**2) ** 3  # odd, so that a bias that is left in the force does not matter
    bend = np.diff(np.r_[0.0, phi, 0.0], 2) / dt**2
    starts = np.arange(0, len(force) - n + 1, max(n // 2, 1))
    usable_rows = np.r_[0, np.cumsum(usable)]
    starts = starts[usable_rows[starts + n] - usable_rows[starts] == n]
    if len(starts) < BLOCKS:
        return None
    y = np.array([phi @ force[i : i + n] for i in starts])
    z = np.array([bend @ position[i : i + n] for i in starts])
    return _slope(y, z, _position_noise(position[usable]) * float(bend @ bend))


def _slope(y: Array, z: Array, noise: float) -> tuple[float, float] | None:
    """-y over z by least squares, less what noise of the position adds; std by leaving blocks out."""
    blocks = np.array_split(np.arange(len(y)), BLOCKS)
    top = np.array([np.sum(y[b] * z[b]) for b in blocks])
    bottom = np.array([np.sum(z[b] ** 2) - 3.0 * noise * len(b) for b in blocks])
    if not bottom.sum() > 3.0 * noise * len(y):  # the motion has to stand out of the noise
        return None
    jackknifed = -(top.sum() - top) / (bottom.sum() - bottom)
    spread = np.sum((jackknifed - jackknifed.mean()) ** 2)
    return float(-top.sum() / bottom.sum()), float(np.sqrt((BLOCKS - 1) / BLOCKS * spread))


def _position_noise(position: Array) -> float:
    """Variance of a reading of the position, of an axis [m^2], by third differences."""
    if len(position) < 5:
        return 0.0
    return float(np.mean(np.diff(position, 3, axis=0) ** 2)) / 20.0


def free_level(force: Array, position: Array) -> float | None:
    """The force of free motion [N], at one end of the position's range; None if the log shows none.

    Args:
        force: along the axis in which it changes most [N], shape (n,); NaN where there is no reading.
        position: likewise [m], shape (n,).
    """
    finite = np.isfinite(force + position)
    force = force[finite]
    motion = find_free_motion(force, position[finite], outer_range(force))
    return motion.rest if motion else None


_GUARD_SETTLINGS = 2.0
"""Times the filters' settling: once before the touch is seen, once after it has left the filters."""


def contact_rows(time: Array, force: Array, position: Array) -> tuple[Mask, Mask]:
    """Rows in contact and free rows, with a guard between them that is neither.

    A probe that never leaves has no free row.

    Args:
        time: of the rows [s], shape (n,).
        force: [N], shape (n, 3); NaN where there is no reading.
        position: of the point that touches [m], shape (n, 3), likewise.
    """
    depth = _along_axis(position)
    strength = _along_axis(force)
    columns = {
        "time": time,
        "position": depth,
        "force": strength - (free_level(strength, depth) or 0.0),
    }
    channels = channels_of(Record(columns, {"time": "s", "position": "m", "force": "N"}))
    channels, chain, contacts = contacts_of(channels)
    inside = np.zeros(len(time), bool)
    free = np.full(len(time), not contacts.bonded)
    delay = 0.0 if contacts.bonded else chain.delay
    guard = _GUARD_SETTLINGS * chain.settling
    for begin, end in contacts.spans:
        first, last = (channels.start + i * channels.dt - delay for i in (begin, end))
        inside |= (time >= first) & (time < last)
        free &= (time < first - guard) | (time > last + guard)
    return inside, free if free.sum() >= MIN_ROWS else np.zeros(len(time), bool)


def rows_between(time: Array, span: tuple[float, float]) -> Mask:
    """Rows in a stretch that is said to be free.

    Raises:
        InputError: there are too few.
    """
    rows = (time >= span[0]) & (time < span[1])
    if rows.sum() < MIN_ROWS:
        raise InputError(
            f"only {int(rows.sum())} rows lie in the free stretch {span[0]:g} to {span[1]:g} s; at least {MIN_ROWS} are"
            f" needed, and the log spans {time[0]:.4g} to {time[-1]:.4g} s"
        )
    return rows


def _along_axis(vectors: Array) -> Array:
    """Vectors, shape (n, 3), along the axis in which they differ most, shape (n,)."""
    finite = finite_rows(vectors)
    centred = vectors - vectors[finite].mean(axis=0)
    _, axes = np.linalg.eigh(centred[finite].T @ centred[finite])
    along: Array = centred @ axes[:, -1]
    return along
