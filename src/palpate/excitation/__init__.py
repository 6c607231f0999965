"""Which force to ask for, so that a surface shows its stiffness, its damping and its mass."""

from palpate.excitation.design import Design, Remedy, design, remedies
from palpate.excitation.force_loops import ForceLoop, HybridLoop, KnownBandwidth, Surface, SurfaceRange
from palpate.excitation.problem import Budget, Problem, Sensors

__all__ = [
    "Budget",
    "Design",
    "ForceLoop",
    "HybridLoop",
    "KnownBandwidth",
    "Problem",
    "Remedy",
    "Sensors",
    "Surface",
    "SurfaceRange",
    "design",
    "remedies",
]
