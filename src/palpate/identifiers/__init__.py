"""Estimators of the environment's mass, damping and stiffness from a stream of samples."""

from palpate.identifiers.recursive_least_squares import RecursiveLeastSquares

__all__ = ["RecursiveLeastSquares"]
