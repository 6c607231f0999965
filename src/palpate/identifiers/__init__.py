"""Estimators of the environment's mass, damping and stiffness from a stream of samples."""

from palpate.identifiers.neural_probe import NeuralProbe, Probed
from palpate.identifiers.recursive_least_squares import RecursiveLeastSquares
from palpate.identifiers.watching import watch

__all__ = ["NeuralProbe", "Probed", "RecursiveLeastSquares", "watch"]
