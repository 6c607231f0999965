"""Which force to ask for, so that a surface shows its stiffness, its damping and its mass."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate_excitation.designs import Design, Remedy, design, remedies
    from palpate_excitation.force_loops import (
        ExcitedLoop,
        HybridLoop,
        KnownBandwidth,
        LinearSurface,
        SurfaceRange,
    )
    from palpate_excitation.problem import Budget, DesignProblem, Sensors

_NAMES = {
    "designs": ("Design", "Remedy", "design", "remedies"),
    "force_loops": ("ExcitedLoop", "HybridLoop", "KnownBandwidth", "LinearSurface", "SurfaceRange"),
    "problem": ("Budget", "DesignProblem", "Sensors"),
}
__all__ = [
    "Budget",
    "Design",
    "DesignProblem",
    "ExcitedLoop",
    "HybridLoop",
    "KnownBandwidth",
    "LinearSurface",
    "Remedy",
    "Sensors",
    "SurfaceRange",
    "design",
    "remedies",
]


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first used: the help of the command imports none."""
    for module, names in _NAMES.items():
        if name in names:
            return getattr(import_module(f"palpate_excitation.{module}"), name)
    raise AttributeError(f"palpate_excitation has no {name!r}; it has {', '.join(__all__)}")
