"""Estimators of the environment's mass, damping and stiffness from a stream of samples.

| the surface | use | because |
|---|---|---|
| stays as it is | `RecursiveLeastSquares` | nothing is forgotten: the batch solution, at any moment |
| changes slowly, always moved on | its `forgetting=Exponential(0.999)` | simple; 1 / (1 - keep) samples of memory |
| changes slowly, often left alone | its `forgetting=SIFt(0.999)` | only what is excited is forgotten |
| may become another at any moment | `RestartingLeastSquares` | notices, dates the change, starts again from there |
| has no model | `NeuralProbe` | the thesis' way; its answers carry no interval |

All take a regressor and a force with `update` or `update_many`, and answer with `estimate()`: theta, its covariance,
and the verdict that each parameter deserves. Whoever has a position and a force, not a regressor, puts a
`ContactIdentifier` before any of them.
"""

from palpate.identifiers.contact_identifier import ContactIdentifier
from palpate.identifiers.estimator import Exponential, IdentifierTable, SIFt
from palpate.identifiers.neural_probe import NeuralProbe, Probed, Setting, watch
from palpate.identifiers.recursive_least_squares import LeastSquaresIdentifier, RecursiveLeastSquares
from palpate.identifiers.restarting import RestartingIdentifier, RestartingLeastSquares
from palpate.signals.types import Estimate

__all__ = [
    "ContactIdentifier",
    "Estimate",
    "Exponential",
    "IdentifierTable",
    "LeastSquaresIdentifier",
    "NeuralProbe",
    "Probed",
    "RecursiveLeastSquares",
    "RestartingIdentifier",
    "RestartingLeastSquares",
    "SIFt",
    "Setting",
    "watch",
]
