"""A cover of surfaces by cells in each of which the loop is proved stable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.force.boundary import radius
from palpate.force.cells import Box, Prover
from palpate.force.lyapunov import common, common_beside, single, weight_of


@dataclass(frozen=True)
class Cell:
    """A box and the norm in which every tick contracts."""

    box: Box
    L: Array

    def proved(self, prover: Prover) -> bool:
        """Whether it is so, rounding accounted for."""
        worst, rounding = prover.contraction(self.box, self.L)
        return worst + rounding < 1.0


def _of(prover: Prover, box: Box, L: Array | None) -> Cell | None:
    cell = None if L is None else Cell(box, L)
    return cell if cell is not None and cell.proved(prover) else None


def _corners(prover: Prover, box: Box) -> list[Array]:
    roomy = prover if prover.exact else replace(prover, wider=ROOM, _known={}, _loops={})
    return roomy.matrices(box)


ROOM = 1.3
"""By which an inner loop's box is widened while a norm is searched."""
MOST = 2000
"""Cells after which a piece is given up: a certificate of more is not checked in a second."""
CUTS, FEWER = 24, 5
"""After which a piece is given up; fewer where each costs a long search and helps little."""
PATIENCE = 10
"""Boxes of a torque arm between two long searches of a norm: each costs some twenty short ones.
Measured by benchmarks/force/falsify.py --arms fr3: with none it takes 906 cells instead of 194 and nearly three times
as long, with one in every box 134 cells and over twice as long."""


class Search:
    """Cells that prove boxes; what a long search found tells the short ones after it in which weight to look."""

    def __init__(self, prover: Prover):
        self.prover = prover
        self._weight: Array | None = None
        self._boxes = 0

    def cover(self, box: Box) -> tuple[list[Cell], list[Box]]:
        """Cells that prove the box; and, where it cannot be proved, the first piece that is not after so many cuts."""
        prover = self.prover
        cells: list[Cell] = []
        waiting = [(box, FEWER if prover.fading or box.low == box.high else CUTS)]
        while waiting:
            here, cuts = waiting.pop()
            cell, L = self._cell(here)
            if cell is not None:
                cells.append(cell)
            elif cuts == 0 or len(cells) == MOST:
                return cells, [here]
            else:
                waiting.extend((half, cuts - 1) for half in _halves(prover, here, L))
        return cells, []

    def _cell(self, box: Box) -> tuple[Cell | None, Array | None]:
        """The box with a norm that proves it, if one was found; and a norm of its middle, if there is one."""
        prover = self.prover
        if prover.fading:
            return _of(prover, box, common_beside(_corners(prover, box), prover.equilibrium(box))), None
        middle = _middle(prover, box)
        L = single(middle, self._weight)
        cell = _of(prover, box, L)
        if cell is not None or not self._patient(box):
            return cell, L
        corners = _corners(prover, box)
        if len(corners) == 1 or max(map(radius, corners)) >= 1.0:
            return None, L
        found = common(corners, middle)
        if found is not None:
            self._weight = weight_of(found, middle)
        return _of(prover, box, found), L

    def _patient(self, box: Box) -> bool:
        """Whether a long search is due: always where it finds what the short one does not."""
        self._boxes += 1
        if (
            self.prover.loop.arm.kind != "position"
            and len(self.prover.laws(box)) == 1
            and self._boxes < PATIENCE
        ):
            return False
        self._boxes = 0
        return True


def _halves(prover: Prover, box: Box, L: Array | None) -> tuple[Box, Box]:
    """The box cut across what makes more of a difference, in a norm of its middle."""
    if box.least == box.most or box.low == box.high or L is None or prover.fading:
        return box.halves(prover.theta, damping=box.low == box.high or prover.fading == "surface")
    back = np.linalg.inv(L.T)
    bound, time = box.middle(prover.theta)
    across = [replace(box, least=time, most=time), replace(box, low=bound, high=bound)]
    spans = [prover.matrices(thin) for thin in across]  # the two ends of each, all laws beside each other
    n = len(prover.laws(box))
    differences = [
        max(float(np.linalg.norm(L.T @ (a - b) @ back, 2)) for a, b in zip(M[:n], M[n:], strict=False))
        for M in spans
    ]
    return box.halves(prover.theta, damping=differences[1] > differences[0])


def _middle(prover: Prover, box: Box) -> Array:
    bound, time = box.middle(prover.theta)
    K = bound / (1.0 + time / prover.theta)
    laws = prover.laws(box)
    matrices = [loop.phi(K, time * K, law, loss) for loop in prover.loops(box.part) for law, loss in laws]
    return np.asarray(sum(matrices) / len(matrices))
