"""The force without weight and bias, and the rows in free motion and in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.declared import ContactFrame
from palpate.contact_frame.free_motion.rows import contact_rows, rows_between
from palpate.contact_frame.load import Load, known_load, load_of, no_load, robust_load, turns
from palpate.contact_frame.saturation import saturated_rows
from palpate.contact_frame.signals_in_base import Signals
from palpate.contact_frame.vectors import read_rows

_ROUNDS = 4
"""At most: the weight tells the free rows and they the weight, until neither changes."""


@dataclass(frozen=True)
class Unloaded:
    """The force in the base's axes without weight and bias.

    Args:
        force: [N], shape (n, 3).
        there: rows with a force, shape (n,).
        inside: rows in contact, shape (n,).
        free: rows with a force in which nothing is touched, shape (n,).
        load: the subtracted weight and bias.
    """

    force: Array
    there: Mask
    inside: Mask
    free: Mask
    load: Load


def in_range(signals: Signals, frame: ContactFrame) -> tuple[Signals, Unloaded, list[dict[str, Any]]]:
    """Take off weight and bias, and leave out the readings of a force at the end of its range.

    Returns:
        The signals without these readings, the force, and notes as a record's meta has them.
    """
    freed = _remove_load(signals, frame)
    stuck = saturated_rows(signals.recorded, signals.place, freed.inside)
    if not stuck.any():
        return signals, freed, []
    signals = replace(signals, force=np.where(stuck[:, None], np.nan, signals.force))
    text = f"an axis of the force rests at its extreme value for {int(stuck.sum())} rows; they are left out"
    return signals, _remove_load(signals, frame), [{"code": "saturated", "text": text}]


def _remove_load(signals: Signals, frame: ContactFrame) -> Unloaded:
    there = read_rows(signals.force)
    if frame.free is None:
        load, inside, free = _fit_load(signals, there, frame)
    else:
        free = rows_between(signals.time, frame.free) & there
        load = _load(signals, free, frame)
        inside, _ = _contact(signals, load)
    return Unloaded(load.taken_off(signals.force, signals.rotations), there, inside, free, load)


def _load(signals: Signals, free: Mask, frame: ContactFrame) -> Load:
    """Weight and bias by the free rows; the weight is the payload's where there is one."""
    force, rotations = signals.force[free], signals.rotations[free]
    if frame.payload is not None:
        return known_load(force, rotations, frame.payload)
    return load_of(force, rotations, weighs=not frame.gravity_compensated)


def _fit_load(signals: Signals, there: Mask, frame: ContactFrame) -> tuple[Load, Mask, Mask]:
    """Weight and bias by the free rows; which rows these are, depends on the weight where the tool turns."""
    turned = signals.turned and turns(signals.rotations[there])
    none = there & False
    weighs = not frame.gravity_compensated
    if frame.payload is not None:
        load = _load(signals, none, frame)
    else:
        load = (
            robust_load(signals.force[there], signals.rotations[there], weighs=weighs)
            if turned
            else no_load()
        )
    before = none
    for _ in range(_ROUNDS if turned else 1):
        inside, free = _contact(signals, load)
        free &= there
        if free.any() and np.array_equal(free, before):
            break
        before = free
        if not free.any():
            return _load(signals, none, frame) if frame.payload else no_load(), inside, free
        load = _load(signals, free, frame)
    return load, inside, free


def _contact(signals: Signals, load: Load) -> tuple[Mask, Mask]:
    return contact_rows(signals.time, load.taken_off(signals.force, signals.rotations), signals.place)
