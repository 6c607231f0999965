"""Which force to ask for, so that a surface shows its stiffness, its damping and its mass."""

from palpate.excitation.budget import Budget
from palpate.excitation.design import Design, design
from palpate.excitation.force_loops import ForceLoop, HybridLoop, KnownBandwidth
from palpate.excitation.problem import Problem
from palpate.excitation.remedies import Remedy, remedies
from palpate.excitation.sensors import Sensors
from palpate.excitation.surfaces import Surface, SurfaceRange

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
