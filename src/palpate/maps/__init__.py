"""Stiffness maps of surfaces: an interval at every place, and where to press next."""

from palpate.maps.next_press import NextPresses
from palpate.maps.stiffness_map import FieldMap, Prediction, StiffnessMap

__all__ = ["FieldMap", "NextPresses", "Prediction", "StiffnessMap"]
