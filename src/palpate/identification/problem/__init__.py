"""The regression problem: both channels behind one front end, the rows in contact, and those about each touch."""

from palpate.identification.problem.building import problem_of
from palpate.identification.problem.problem import Problem, reduced

__all__ = ["Problem", "problem_of", "reduced"]
