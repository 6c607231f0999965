"""The linear model of bench and control law: eigenvalues, margins, and where it is stable."""

from palpate_studies.analysis.boundaries import stable_intervals, stable_stiffness
from palpate_studies.analysis.linear_loop import LinearLoop, Mode
from palpate_studies.analysis.linear_model import linearise
from palpate_studies.analysis.margins import LoopMargins, growth_with, loop_gain, margins

__all__ = [
    "LinearLoop",
    "LoopMargins",
    "Mode",
    "growth_with",
    "linearise",
    "loop_gain",
    "margins",
    "stable_intervals",
    "stable_stiffness",
]
