"""A cover of surfaces by cells in each of which the loop is proved stable."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from palpate.arrays import Array
from palpate.force.boundary import radius
from palpate.force.cells import Box, Prover
from palpate.force.claims import ProvedCell
from palpate.force.lyapunov import common, common_beside, single, weight_of


def _prove(prover: Prover, box: Box, L: Array | None) -> ProvedCell | None:
    """The box with this norm, if every tick contracts in it, rounding accounted for."""
    if L is None:
        return None
    worst, rounding = prover.contraction(box, L)
    return ProvedCell.of(box, L) if worst + rounding < 1.0 else None


def _corners(prover: Prover, box: Box) -> list[Array]:
    roomy = prover if prover.exact else replace(prover, wider=BOX_MARGIN)
    return roomy.matrices(box)


BOX_MARGIN = 1.3
"""Factor by which an inner loop's box is widened while a norm is searched."""
MAX_CELLS = 2000
"""Maximum number of cells: a certificate of more is not checked in a second."""
MAX_CUTS, MAX_CUTS_OF_ONE_NORM = 24, 5
"""Maximum number of cuts of a box; fewer where each costs a long search and helps little."""
DAMPING_WIDTH = 0.5
"""Width of the damping times over that of the bounds, both in logarithms, above which the times are cut: of 1/16 to 1
this takes the fewest cells on the shipped arms."""
PATIENCE = 10
"""Boxes of a torque arm between two long searches of a norm: each costs some twenty short ones.
Measured by benchmarks/force/falsify.py --arms fr3: with none it takes 2057 cells instead of 242 and six times as long,
with one in every box 195 cells and three times as long."""


class Search:
    """Cells that prove boxes; what a long search found tells the short ones after it in which weight to look."""

    def __init__(self, prover: Prover):
        self.prover = prover
        self._weight: Array | None = None
        self._boxes = 0

    def cover(self, box: Box) -> tuple[list[ProvedCell], list[Box]]:
        """Cells that prove the box; and, where it cannot be proved, the first piece that is not after so many cuts."""
        prover = self.prover
        cells: list[ProvedCell] = []
        waiting = [(box, MAX_CUTS_OF_ONE_NORM if prover.fading or box.low == box.high else MAX_CUTS)]
        while waiting:
            here, cuts = waiting.pop()
            cell = self._cell(here)
            if cell is not None:
                cells.append(cell)
            elif cuts == 0 or len(cells) == MAX_CELLS:
                return cells, [here]
            else:
                waiting.extend((half, cuts - 1) for half in _halves(prover, here))
        return cells, []

    def _cell(self, box: Box) -> ProvedCell | None:
        """The box with a norm that proves it, if one was found."""
        prover = self.prover
        if prover.fading:
            return _prove(prover, box, common_beside(_corners(prover, box), prover.equilibrium(box)))
        middle = _middle(prover, box)
        cell = _prove(prover, box, single(middle, self._weight))
        if cell is not None or not self._patient(box):
            return cell
        corners = _corners(prover, box)
        if len(corners) == 1 or max(map(radius, corners)) >= 1.0:
            return None
        norm = common(corners, middle)
        if norm is not None:
            self._weight = weight_of(norm, middle)
        return _prove(prover, box, norm)

    def _patient(self, box: Box) -> bool:
        """True if a long search is due: always where it finds norms that the short one does not."""
        self._boxes += 1
        if (
            self.prover.loop.arm.kind != "position"
            and len(self.prover.laws(box)) == 1
            and self._boxes < PATIENCE
        ):
            return False
        self._boxes = 0
        return True


def _halves(prover: Prover, box: Box) -> tuple[Box, Box]:
    """The box cut across its damping times, or across its bounds."""
    if prover.fading == "surface" or box.low == box.high:
        return box.halves(prover.theta, damping=True)
    times = log((box.most + prover.theta) / (box.least + prover.theta))
    return box.halves(prover.theta, damping=times > DAMPING_WIDTH * log(box.high / box.low))


def _middle(prover: Prover, box: Box) -> Array:
    bound, time = box.middle(prover.theta)
    K = bound / (1.0 + time / prover.theta)
    laws = prover.laws(box)
    matrices = [loop.phi(K, time * K, law, loss) for loop in prover.loops(box.part) for law, loss in laws]
    return np.asarray(sum(matrices) / len(matrices))
