"""Which force to ask for, so that a surface shows its stiffness, its damping and its mass."""

from typing import TYPE_CHECKING

from palpate.lazy import importer

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

_HOMES = {
    "designs": ("Design", "Remedy", "design", "remedies"),
    "force_loops": ("ExcitedLoop", "HybridLoop", "KnownBandwidth", "LinearSurface", "SurfaceRange"),
    "problem": ("Budget", "DesignProblem", "Sensors"),
}
__getattr__ = importer(__name__, _HOMES)
