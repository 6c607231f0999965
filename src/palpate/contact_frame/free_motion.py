"""Rows of a log as vectors, and where of them the tool moves freely."""

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.contacts import contacts_of
from palpate.identification.sampling import channels_of
from palpate.records import Record
from palpate.signals.samples import continuous

Vector = tuple[float, float, float]
FEWEST = 20
"""Rows for a mean that is said of a log: its standard deviation is then a fifth of a reading's, or less."""
_UNIT = 0.1
"""By which a quaternion's length is off at most where its four numbers are rounded to one digit."""


def read_rows(vectors: Array) -> Mask:
    """Rows of vectors, shape (n, k), that hold a reading in each component."""
    return np.isfinite(vectors.sum(axis=1))


def matrices(time: Array, quaternions: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of quaternions (x, y, z, w), shape (n, 4); rows of NaN are bridged.

    Raises:
        InputError: they are not of unit length.
    """
    from scipy.spatial.transform import Rotation

    there = read_rows(quaternions)
    lengths = np.linalg.norm(quaternions[there], axis=1)
    if not len(lengths) or np.abs(lengths - 1).max() > _UNIT:
        worst = lengths[np.argmax(np.abs(lengths - 1))] if len(lengths) else float("nan")
        raise InputError(f"the pose's quaternions must have length 1, got {worst:.3g}; give them as x,y,z,w")
    steady = continuous(quaternions[there])
    if not there.all():
        steady = np.column_stack([np.interp(time, time[there], part) for part in steady.T])
    turned: Array = Rotation.from_quat(steady).as_matrix()
    return turned


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


_ENOUGH = 4000
"""Rows that are looked at, of a longer log evenly: that is a matter of time, not of what is found."""
_PLACES = np.linspace(0.05, 0.95, 37)
"""Of a bend, as shares of the stroke."""
_BENT = CHANCE ** (2.0 / (2 * FEWEST - 3))
"""Share of a straight line's misfit that a bend, one number more, leaves by chance once in a thousand logs of the
fewest independent rows, by Fisher's distribution with 2 degrees of freedom."""
_FLAT = 0.05
"""Of the slope beyond the bend: a spring whose force grows as the penetration to the third power shows 0.14."""


def free_level(force: Array, position: Array) -> float | None:
    """The force [N] of the flat side of a bend; None if there is no bend with one flat side.

    Args:
        force: along the axis in which it changes most [N], shape (n,); NaN where there is no reading.
        position: likewise [m], shape (n,).
    """
    there = np.isfinite(force + position)
    every = slice(None, None, max(1, int(there.sum()) // _ENOUGH))
    force, position = force[there][every], position[there][every]
    low, high = float(position.min()), float(position.max())
    if not high > low:
        return None
    bends = [
        min(
            (_misfit_of_bend(force, side * (position - low - share * (high - low))), side, share)
            for share in _PLACES
        )
        for side in (1.0, -1.0)
    ]
    best, other = sorted(bends)
    if best[0] > _BENT * min(_misfit(force, position), other[0]):
        return None
    _, side, share = best
    flat = side * (position - low - share * (high - low)) < 0
    return float(np.median(force[flat])) if _is_flat(force, position, flat) else None


def _misfit_of_bend(force: Array, beyond: Array) -> float:
    """Misfit of a force that is flat up to a place and straight beyond."""
    return _misfit(force, np.maximum(beyond, 0.0))


def _misfit(force: Array, regressor: Array) -> float:
    """Sum of squares that a straight line leaves."""
    x, f = regressor - regressor.mean(), force - force.mean()
    return float(f @ f - (x @ f) ** 2 / max(float(x @ x), 1e-300))


def _is_flat(force: Array, position: Array, flat: Mask) -> bool:
    """Whether the force does not follow the position on one side, measured by how it does on the other."""
    if min(flat.sum(), (~flat).sum()) < FEWEST or not (np.ptp(position[flat]) and np.ptp(position[~flat])):
        return False
    slopes = [abs(float(np.polyfit(position[side], force[side], 1)[0])) for side in (flat, ~flat)]
    return slopes[0] < _FLAT * slopes[1]


_GUARD = 2.0
"""Times the filters' settling: once before the touch is seen, once after it has left the filters."""


def contact_rows(time: Array, force: Array, place: Array) -> tuple[Mask, Mask]:
    """Rows in contact and free rows, with a guard between them that is neither.

    A probe that never leaves has no free row.

    Args:
        time: of the rows [s], shape (n,).
        force: [N], shape (n, 3); NaN where there is no reading.
        place: of the point that touches [m], shape (n, 3), likewise.
    """
    position, strength = _along_axis(place), _along_axis(force)
    columns = {
        "time": time,
        "position": position,
        "force": strength - (free_level(strength, position) or 0.0),
    }
    channels = channels_of(Record(columns, {"time": "s", "position": "m", "force": "N"}))
    channels, chain, contacts = contacts_of(channels)
    inside, free = np.zeros(len(time), bool), np.full(len(time), not contacts.bonded)
    delay = 0.0 if contacts.bonded else chain.delay
    guard = _GUARD * chain.settling
    for begin, end in contacts.spans:
        first, last = (channels.start + i * channels.dt - delay for i in (begin, end))
        inside |= (time >= first) & (time < last)
        free &= (time < first - guard) | (time > last + guard)
    return inside, free if free.sum() >= FEWEST else np.zeros(len(time), bool)


def rows_between(time: Array, span: tuple[float, float]) -> Mask:
    """Rows in a stretch that is said to be free.

    Raises:
        InputError: there are too few.
    """
    rows = (time >= span[0]) & (time < span[1])
    if rows.sum() < FEWEST:
        raise InputError(
            f"only {int(rows.sum())} rows lie in the free stretch {span[0]:g} to {span[1]:g} s; at least {FEWEST} are"
            f" needed, and the log spans {time[0]:.4g} to {time[-1]:.4g} s"
        )
    return rows


def _along_axis(vectors: Array) -> Array:
    """Vectors, shape (n, 3), along the axis in which they differ most, shape (n,)."""
    there = read_rows(vectors)
    centred = vectors - vectors[there].mean(axis=0)
    _, axes = np.linalg.eigh(centred[there].T @ centred[there])
    along: Array = centred @ axes[:, -1]
    return along
