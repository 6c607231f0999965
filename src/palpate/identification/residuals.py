"""Are residuals white? What a model that describes a log leaves behind a white sensor is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array

_LAGS = 20
_DOUBTED = 1e-3
_FORETOLD = 1e-3
"""Share of the residuals' power that those before them foretell; a large log shows even a colour of no account."""


@dataclass(frozen=True)
class Whiteness:
    """Outcome of a portmanteau test.

    Args:
        statistic: Q of Ljung and Box.
        lags: how many autocorrelations it sums.
        p: probability of one as large if the residuals are white.
        foretold: share of their power that those before them foretell, to first order.
    """

    statistic: float
    lags: int
    p: float
    foretold: float = 1.0

    @property
    def white(self) -> bool:
        """Whether whiteness is not refuted at one in a thousand, or by next to nothing."""
        return self.p >= _DOUBTED or self.foretold < _FORETOLD


def whiteness(residuals: Array, lags: int = _LAGS) -> Whiteness:
    """Test evenly spaced residuals, shape (n,), by the first autocorrelations (Ljung and Box, 1978)."""
    from scipy.special import chdtrc

    n = len(residuals)
    lags = max(min(lags, n // 5), 1)
    e = residuals - residuals.mean()
    power = float(e @ e)
    if power == 0:
        return Whiteness(0.0, lags, 1.0)
    r = np.array([e[k:] @ e[:-k] for k in range(1, lags + 1)]) / power
    q = float(n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return Whiteness(q, lags, float(chdtrc(lags, q)), float(r @ r))
