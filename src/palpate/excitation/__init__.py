"""Which force to ask for, so that a surface shows its stiffness, its damping and its mass."""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.excitation.designs import Design, Remedy, design, remedies
    from palpate.excitation.force_loops import (
        ExcitedLoop,
        HybridLoop,
        KnownBandwidth,
        LinearSurface,
        SurfaceRange,
    )
    from palpate.excitation.problem import Budget, DesignProblem
    from palpate.excitation.report import experiment
    from palpate.excitation.sensors import ForceChain, Sensors

__all__ = [
    "Budget",
    "Design",
    "DesignProblem",
    "ExcitedLoop",
    "ForceChain",
    "HybridLoop",
    "KnownBandwidth",
    "LinearSurface",
    "Remedy",
    "Sensors",
    "SurfaceRange",
    "design",
    "experiment",
    "remedies",
]

_HOMES = {
    "report": ("experiment",),
    "designs": ("Design", "Remedy", "design", "remedies"),
    "force_loops": ("ExcitedLoop", "HybridLoop", "KnownBandwidth", "LinearSurface", "SurfaceRange"),
    "problem": ("Budget", "DesignProblem"),
    "sensors": ("ForceChain", "Sensors"),
}
__getattr__ = importer(__name__, _HOMES)
