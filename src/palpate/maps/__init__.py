"""Maps: the stiffness of a surface at every place from presses at some, its uncertainty, and where to press next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.maps.stiffness_map import NextPresses, StiffnessMap, StiffnessPrediction

__all__ = ["NextPresses", "StiffnessMap", "StiffnessPrediction"]

_HOMES = {"stiffness_map": ("NextPresses", "StiffnessMap", "StiffnessPrediction")}
__getattr__ = importer(__name__, _HOMES)
