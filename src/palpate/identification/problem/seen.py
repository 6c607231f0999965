"""Both channels as a front end shows them, at all rows, and which of these are in contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.contacts import Contacts
from palpate.identification.filters.state_variable import white_noise
from palpate.identification.models import Motion
from palpate.identification.prior import Lag
from palpate.identification.sampling import Channels
from palpate.identification.warning_codes import Code

Rows = NDArray[np.intp]

FREE_ROWS = 64
"""Rows of a stretch out of contact below which it tells nothing of the force's noise."""
_FEWEST = 30


@dataclass(frozen=True)
class Seen:
    """Both channels behind a front end.

    Args:
        motion: the position, counted from the surface into it, at the rows in contact.
        origin: position of the surface on the log's own scale [m].
        force: at every row of the front end, shape (n,).
        spans: number of the contact that each row in contact belongs to, shape (m,).
        usable: rows that remember valid readings alone, shape (n,).
        begins: first row behind the touch of each contact.
        memory: rows that a disturbance is remembered for.
        free: the force out of contact, in stretches of rows.
        lag: prior of the force's.
        read: the force before any filter, at the samples of the position; None if it is another's.
        filtered: part of the force's lag that the position was sent through beforehand [s].
        rounding: deviation of a sample of the force by the last digit of the log [N]; 0 behind a sensor, whose readings
            are as white as their noise.
    """

    motion: Motion
    origin: float
    force: Array
    spans: Rows
    usable: Mask
    begins: list[int]
    memory: int
    free: tuple[Array, ...]
    lag: Lag
    read: Array | None = None
    filtered: float = 0.0
    rounding: float = 0.0


def numbered(contacts: list[Rows], channels: Channels) -> tuple[Rows, Rows]:
    """The rows of all contacts, and the number of each one's contact.

    Args:
        contacts: rows of each.
        channels: which say why rows are lost.

    Raises:
        InputError: too few rows in contact.
    """
    rows = np.concatenate(contacts)
    if len(rows) < _FEWEST:
        text = (
            f"only {len(rows)} usable samples in contact; at least {_FEWEST} are needed: log longer or faster"
        )
        lost = [w.text for w in channels.warnings if w.code in (Code.SATURATED, Code.MISSING_SAMPLES)]
        raise InputError(f"{text} ({'; '.join(lost)})" if lost else text)
    return rows, np.repeat(np.arange(len(contacts)), [len(own) for own in contacts])


def ends(channels: Channels, contacts: Contacts) -> list[int]:
    """The sample after the last of each contact by the raw force; at least half of the filtered one.

    A filter shows contact for a while after the probe has gone, but what it shows then is no contact any more.
    """
    if contacts.bonded:
        return [end for _, end in contacts.spans]
    clear = max(contacts.threshold, contacts.resting + 4 * white_noise(channels.force))
    found = []
    for begin, end in contacts.spans:
        above = np.flatnonzero(contacts.force_sign * channels.force[begin:end] > clear)
        middle = begin + (end - begin) // 2
        found.append(max(begin + int(above[-1]) + 1, middle) if len(above) else end)
    return found
