"""The regression problem: position and force behind the same front end, at the rows in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.identification.contacts import Contacts
from palpate.identification.filters.bandwidth import highest_motion
from palpate.identification.models import Motion
from palpate.identification.prior import Lag
from palpate.identification.problem.touch import Touch

MOST_ROWS = 1 << 16
"""Rows that are fitted at most, in pieces spread over the log: more average noise alone, which limits nothing then."""
_PIECE = 1 << 14


@dataclass(frozen=True)
class Problem:
    """Data that the models are fitted to.

    Args:
        motion: the position, at the rows in contact.
        force: at these rows, shape (m,).
        spans: number of the contact that each belongs to, shape (m,).
        lag: prior.
        free: the force out of contact behind the same front end, in stretches of rows.
        touch: the rows with those shortly before each touch; None if no touch is in the log.
        approach: the same with as many rows before a touch as the contact has, where there are so many.
        origin: position of the surface on the log's own scale [m].
        contacts: as found.
        counted: the force is counted from where it rests out of contact, and the rows begin before the touches.
        read: the force before any filter, at the samples of the motion's position, shape (n,); None if it is another's.
        rounding: deviation of a sample of the force by the last digit of the log [N].
        filtered: part of the force's lag that the position was sent through beforehand, so that `lag` is the rest [s].
    """

    motion: Motion
    force: Array
    spans: NDArray[np.intp]
    lag: Lag
    free: tuple[Array, ...]
    touch: Touch | None
    approach: Touch | None
    origin: float
    contacts: Contacts
    counted: bool = False
    read: Array | None = None
    rounding: float = 0.0
    filtered: float = 0.0

    @property
    def time(self) -> Array:
        """Of each row [s], shape (m,)."""
        return self.motion.chain.times(self.motion.rows)

    @cached_property
    def band(self) -> float:
        """The frequency below which the probe moved [Hz]; infinite if all contacts are too short."""
        return highest_motion(self.motion)

    @property
    def resting(self) -> float:
        """Zero of the force: its mean out of contact, for rows that hold the touches [N]."""
        return self.contacts.resting if self.counted else 0.0

    @property
    def free_noise(self) -> float | None:
        """Deviation of the force out of contact; None if too little of the log is."""
        if not self.free:
            return None
        return float(1.4826 * np.median(np.abs(np.concatenate([f - np.median(f) for f in self.free]))))

    @property
    def with_touches(self) -> Problem | None:
        """The same over the rows from before each touch, the force counted from where it rests; None if unknown."""
        return self._at(self.touch)

    @property
    def with_approach(self) -> Problem | None:
        """The same over the rows from as long before each touch as the contact lasts; None without a touch."""
        return self._at(self.approach)

    def _at(self, touch: Touch | None) -> Problem | None:
        if touch is None:
            return None
        motion = replace(self.motion, rows=touch.rows, _kept={})
        return replace(
            self, motion=motion, force=touch.force, spans=touch.spans, touch=None, approach=None, counted=True
        )

    @property
    def in_contact(self) -> Mask:
        """Samples of the position between the first and the last row of a contact, shape (n,)."""
        found = np.zeros(len(self.motion.position), bool)
        instants = self.motion.instants
        for number in np.unique(self.spans):
            own = instants[self.spans == number]
            found[int(own[0]) : int(np.ceil(own[-1])) + 1] = True
        return found


def reduced(problem: Problem) -> Problem:
    """The same with so many rows at most, in evenly spaced unbroken pieces."""
    rows = problem.motion.rows
    if len(rows) <= MOST_ROWS:
        return problem
    kept = _pieces(len(rows))
    motion = replace(problem.motion, rows=rows[kept], _kept={})
    fewer = replace(problem, motion=motion, force=problem.force[kept], spans=problem.spans[kept])
    return replace(fewer, touch=_fewer(problem.touch), approach=_fewer(problem.approach))


def _fewer(touch: Touch | None) -> Touch | None:
    if touch is None or len(touch.rows) <= MOST_ROWS:
        return touch
    kept = _pieces(len(touch.rows))
    return Touch(touch.rows[kept], touch.spans[kept], touch.force[kept])


def _pieces(count: int) -> Mask:
    pieces = -(-count // _PIECE)
    every = -(-pieces // (MOST_ROWS // _PIECE))
    kept: Mask = (np.arange(count) // _PIECE) % every == 0
    return kept
