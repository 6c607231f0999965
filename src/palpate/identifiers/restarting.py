"""Recursive least squares that notices when the surface changes, and starts again from there."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from palpate._jit import part
from palpate.errors import InputError
from palpate.identifiers.estimator import NAMES, VAGUE, Forgetting, IdentifierTable, check_start, policy_of
from palpate.identifiers.kernels.change_detection import COUNTERS, EXTRA, counters, looked_back, notice
from palpate.identifiers.kernels.least_squares import known_first, length, statistics_at
from palpate.identifiers.recursive_least_squares import LeastSquaresEstimator, absorb
from palpate.signals.types import Positive


@part
class RestartingUpdate(NamedTuple):
    """The update of `RestartingLeastSquares`.

    Args:
        forgetting: a policy of `forgetting`, between changes.
        rows: samples that it looks back over.
        evidence: log-likelihood ratio from which the surface has changed.
    """

    forgetting: Any
    rows: float
    evidence: float

    def absorb(self, state, phi, y, size):
        """Takes a sample in; False where it is none."""
        n = size.n
        s = statistics_at(n)
        before = (state[s], state[s + 1], state[s + 2])
        e, a = absorb(state[: length(n)], phi, y, self.forgetting, size)
        if not a > 0.0:
            return False
        noise = notice(state, n, phi, y, e, a, before, self.rows)
        if noise > 0.0:
            looked_back(state, self, noise, size)
        return True


class RestartingLeastSquares(LeastSquaresEstimator):
    """Estimates theta in ``force = regressor . theta`` on a surface that may become another at any moment.

    When to use it: a probe that slides from foam onto metal, a grasp that closes on something else. Where the force
    stops being what the estimate foretells, the last samples are fitted anew, and if that is far likelier the
    estimate starts again, from the first sample of the new surface that can be told from the old. Between changes it
    is `RecursiveLeastSquares`. Its covariance is the new estimate's own: wide after a change, as it should be. A
    sample whose regressor is exactly zero teaches nothing, neither of theta nor of the noise.

    Args:
        theta: initial estimate, shape (n,); also the one that it starts again from.
        covariance: initial P, shape (n, n), symmetric and positive definite; vague, for a surface not met before.
        forgetting: what is forgotten between changes: a factor in (0, 1] or one of the policies of `forgetting`.
        memory: samples that it looks back over; a change that shows later than so is dated at the latest there.
        evidence: log-likelihood ratio from which it takes the surface to have changed.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: shapes that do not fit, numbers out of range.
    """

    def __init__(
        self,
        theta: ArrayLike,
        covariance: ArrayLike,
        forgetting: float | Forgetting = 1.0,
        memory: int = 480,
        evidence: float = 20.0,
        names: tuple[str, ...] | None = None,
    ):
        start, P = check_start(theta, covariance)
        n = len(start)
        if memory != int(memory) or not memory > n:
            raise InputError(f"memory must be a whole number of samples above {n}, got {memory}")
        if not evidence > 0.0:
            raise InputError(f"evidence must be above 0, got {evidence}")
        self.forgetting = policy_of(forgetting)
        initial = [start, np.linalg.cholesky(P).ravel(), np.zeros(COUNTERS + int(memory) * (n + EXTRA))]
        state = np.concatenate([known_first(start, P), *initial])
        super().__init__(state, n, RestartingUpdate(self.forgetting, float(memory), float(evidence)), names)

    def _worth(self, weight: float) -> float:
        return min(weight, float(self.since))

    @property
    def changes(self) -> int:
        """How many times the surface was taken to have changed."""
        return int(self._state[counters(self._n) + 3])

    @property
    def since(self) -> int:
        """How many samples the estimate rests on: those since the last change, or all."""
        return int(self._state[counters(self._n) + 4])


class RestartingIdentifier(IdentifierTable, tag="restarting-least-squares"):
    """Least squares that notice when the surface becomes another one."""

    memory: Annotated[int, Meta(ge=4, le=100_000)] = 480
    """Samples that it looks back over."""
    evidence: Positive = 20.0
    """Log-likelihood ratio from which the surface has changed."""

    def build(self, tick: float) -> RestartingLeastSquares:
        """The estimator at its start."""
        P = np.diag(np.square(VAGUE))
        return RestartingLeastSquares(np.zeros(3), P, 1.0, self.memory, self.evidence, NAMES)
