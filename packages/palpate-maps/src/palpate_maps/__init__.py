"""Maps: the stiffness of a surface at every place from presses at some, its uncertainty, and where to press next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate_maps.next_press import NextPresses
    from palpate_maps.stiffness_map import FieldMap, FieldPrediction, StiffnessMap

__all__ = ["FieldMap", "FieldPrediction", "NextPresses", "StiffnessMap"]

_HOMES = {"next_press": ("NextPresses",), "stiffness_map": ("FieldMap", "FieldPrediction", "StiffnessMap")}
__getattr__ = importer(__name__, _HOMES)
