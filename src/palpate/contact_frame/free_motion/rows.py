"""In which rows of a log nothing is touched."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.free_motion.level import free_level
from palpate.contact_frame.vectors import FEWEST, read_rows
from palpate.errors import InputError
from palpate.identification.contacts import contacts_of
from palpate.identification.sampling import channels_of
from palpate.records import Record

_GUARD = 2.0
"""Times the filters' settling: once before the touch is seen, once after it has left the filters."""


def contact_rows(time: Array, force: Array, place: Array) -> tuple[Mask, Mask]:
    """Mask in contact and free rows, with a guard between them that is neither.

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
    """Mask in a stretch that is said to be free.

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
