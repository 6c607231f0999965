"""The force without what the sensor shows in the air, and the rows in which it is in the air and in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.contact_frame.declared import ContactFrame
from palpate.contact_frame.free_motion import contact_rows, rows_between
from palpate.contact_frame.load import Load, load_of, no_load, robust_load, turns
from palpate.contact_frame.saturation import saturated_rows
from palpate.contact_frame.signals_in_base import Signals
from palpate.contact_frame.vectors import read_rows

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

_ROUNDS = 4


@dataclass(frozen=True)
class Unloaded:
    """The force in the base's axes without weight and bias.

    Args:
        force: [N], shape (n, 3).
        there: rows with a force, shape (n,).
        inside: rows in contact, shape (n,).
        free: rows with a force in which nothing is touched, shape (n,).
        load: what was taken off.
    """

    force: Array
    there: Rows
    inside: Rows
    free: Rows
    load: Load


def in_range(signals: Signals, frame: ContactFrame) -> tuple[Signals, Unloaded, list[dict[str, Any]]]:
    """Take off weight and bias, and leave out the readings of a force at the end of its range.

    Returns:
        The signals without these readings, the force, and notes as a record's meta has them.
    """
    freed = _unloaded(signals, frame)
    stuck = saturated_rows(signals.recorded, signals.place, freed.inside)
    if not stuck.any():
        return signals, freed, []
    signals = replace(signals, force=np.where(stuck[:, None], np.nan, signals.force))
    text = f"an axis of the force rests at its extreme value for {int(stuck.sum())} rows; they are left out"
    return signals, _unloaded(signals, frame), [{"code": "saturated", "text": text}]


def _unloaded(signals: Signals, frame: ContactFrame) -> Unloaded:
    weighs = not frame.gravity_compensated
    there = read_rows(signals.force)
    if frame.free is None:
        load, inside, free = _found(signals, there, weighs)
    else:
        free = rows_between(signals.time, frame.free) & there
        load = load_of(signals.force[free], signals.rotations[free], weighs=weighs)
        inside, _ = _contact(signals, load)
    return Unloaded(load.taken_off(signals.force, signals.rotations), there, inside, free, load)


def _found(signals: Signals, there: Rows, weighs: bool) -> tuple[Load, Rows, Rows]:
    """Weight and bias by the free rows; which rows these are, depends on the weight where the tool turns."""
    turned = signals.turned and turns(signals.rotations[there])
    load = robust_load(signals.force[there], signals.rotations[there], weighs=weighs) if turned else no_load()
    for _ in range(_ROUNDS if turned else 1):
        inside, free = _contact(signals, load)
        free &= there
        if not free.any():
            return no_load(), inside, free
        load = load_of(signals.force[free], signals.rotations[free], weighs=weighs)
    return load, inside, free


def _contact(signals: Signals, load: Load) -> tuple[Rows, Rows]:
    return contact_rows(signals.time, load.taken_off(signals.force, signals.rotations), signals.place)
