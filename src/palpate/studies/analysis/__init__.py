"""The linear model of bench and control law: eigenvalues, margins, and where it is stable."""

from palpate.studies.analysis.boundaries import sign_changes, stable_intervals, stable_stiffness
from palpate.studies.analysis.linear_loop import LinearLoop, Mode
from palpate.studies.analysis.linear_model import linearise
from palpate.studies.analysis.margins import LoopMargins, growth_with, loop_gain, margins

__all__ = [
    "LinearLoop",
    "LoopMargins",
    "Mode",
    "growth_with",
    "linearise",
    "loop_gain",
    "margins",
    "sign_changes",
    "stable_intervals",
    "stable_stiffness",
]
