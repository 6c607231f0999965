"""Maps: the stiffness of a surface at every place from presses at some, its uncertainty, and where to press next."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate_maps.next_press import NextPresses
    from palpate_maps.stiffness_map import FieldMap, FieldPrediction, StiffnessMap

__all__ = ["FieldMap", "FieldPrediction", "NextPresses", "StiffnessMap"]


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first used: the help of the command imports none."""
    if name not in __all__:
        raise AttributeError(f"palpate_maps has no {name!r}; it has {', '.join(__all__)}")
    return getattr(
        import_module(f"palpate_maps.{'next_press' if name == 'NextPresses' else 'stiffness_map'}"), name
    )
