"""A cover of surfaces by cells in each of which the loop is proved stable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.force.boundary import radius
from palpate.force.cells import Box, Prover
from palpate.force.lyapunov import common, single

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cell:
    """A box and the norm in which every tick contracts."""

    box: Box
    L: Array

    def proved(self, prover: Prover) -> bool:
        """Whether it is so, rounding accounted for."""
        worst, rounding = prover.contraction(self.box, self.L)
        return worst + rounding < 1.0


def proved_cell(prover: Prover, box: Box) -> Cell | None:
    """The box with a norm that proves it; None if none was found."""
    corners = prover.matrices(box)
    if max(map(radius, corners)) >= 1.0:
        return None
    middle = _middle(prover, box)
    if not prover.affine or len(corners) == 1:
        L = single(middle)
        if L is not None and Cell(box, L).proved(prover):
            return Cell(box, L)
        if not prover.affine and len(prover.laws(box)) == 1:
            return None
    L = common(corners, middle)
    return Cell(box, L) if L is not None and Cell(box, L).proved(prover) else None


def covered(prover: Prover, box: Box, depth: int = 14) -> tuple[list[Cell], list[Box]]:
    """Cells that prove the box; and, where it cannot be proved, the first piece that is not after so many cuts."""
    cells: list[Cell] = []
    waiting = [(box, depth)]
    while waiting:
        here, cuts = waiting.pop()
        cell = proved_cell(prover, here)
        if cell is not None:
            cells.append(cell)
        elif cuts == 0:
            return cells, [here]
        else:
            waiting.extend((half, cuts - 1) for half in here.halves(prover.theta))
    return cells, []


def _middle(prover: Prover, box: Box) -> Array:
    bound = float(np.sqrt(box.low * box.high))
    time = float(np.sqrt((box.least + prover.theta) * (box.most + prover.theta)) - prover.theta)
    K = bound / (1.0 + time / prover.theta)
    matrices = [prover.loop.phi(K, time * K, law, loss) for law, loss in prover.laws(box)]
    return np.asarray(sum(matrices) / len(matrices))
