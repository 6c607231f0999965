"""Regression by octave of frequency: what the batch and the stream share.

In each octave every column goes through Hann blocks of four periods, half overlapping, of which the lines 3, 4 and 5
are kept. The noise has a level of its own in each octave, estimated from what the regression leaves there.
"""

import numpy as np

from palpate.arrays import Array, Indices, Mask

LINES = (3, 4, 5)
"""Lines of a block that are one octave."""
OVERLAP = 0.75
"""Independent blocks for each of half-overlapping Hann blocks of a coherent motion: 1/(1 + 2/6) (Welch 1967)."""
TIED = 35 / 18
"""Power of white noise along a sine's own lines, over that of a line: Hann's window ties neighbouring lines, so that
three of them are worth about one and a half (n sum w^4 / (sum w^2)^2)."""
MIN_MOTION = 10.0
"""Power of a column over that of the position's noise in it, below which an octave is left out: its parameter would be
off by a tenth."""
HIDDEN_SHARE = 0.5
"""Fraction of the unexplained amplitude of an octave that may lie along a parameter's own column: of a force in an
unknown phase, in phase and in quadrature, half of the power is along either. `make trust` measures the coverage that
follows."""
_WINDOW = 0.02
"""Probability over the highest below which a hypothesis is left out (Occam's window, Madigan and Raftery 1994)."""


def weigh_hypotheses(evidence: Array) -> tuple[Mask, Array]:
    """Hypotheses that are likely enough, shape (h,), and the weights of these, which add up to one.

    The evidence is the logarithm of each one's probability but for a constant, shape (h,).
    """
    probability = np.exp(evidence - evidence.max())
    plausible = probability > _WINDOW
    return plausible, probability[plausible] / probability[plausible].sum()


def stretch_shares(force_power: Array, lines: Array) -> tuple[Array, Array]:
    """Weight of each stretch of time in an octave's noise level, and the lines that the weighted mean is worth.

    Stretches count by the power of their force: what is left while the tip rests says nothing of what is left while it
    moves. Power and lines have the shape (stretches, octaves); the lines are returned as (octaves,).
    """
    power = np.where(lines > 0, np.maximum(force_power, 0.0), 0.0)
    fraction = power / np.maximum(power.sum(axis=0), 1e-300)
    spread = np.sum(fraction**2 / np.maximum(lines, 1.0), axis=0)
    return fraction, np.where(spread > 0, 1 / np.maximum(spread, 1e-300), 0.0)


def pool_levels(residual: Array, free: Array, downwards: Indices, borrowed: float, floor: Array) -> Array:
    """Variance of a line in each octave, shape (octaves,), by the sum of squares that is left and its freedom.

    From the highest octave downwards each borrows so many lines from the one above: its own few may be fitted by
    chance. No variance is below the floor.
    """
    noise = floor.copy()
    above = 0.0
    for octave in downwards:
        lent = borrowed if above else 0.0
        above = (residual[octave] + lent * above) / max(free[octave] + lent, 1.0)
        above = noise[octave] = max(above, float(floor[octave]))
    return noise


def hidden_variance(
    products: Array, covariance: Array, lines: Array, noise: Array, sensor: Array, threshold: Array
) -> Array:
    """Variance of each parameter by a force that lies along the parameters' columns, shape (p,).

    The force is as large as the residual beyond the sensor's noise, where the excess is larger than chance would show.

    Args:
        products: of the columns by octave, shape (octaves, p, p).
        covariance: of the parameters, shape (p, p).
        lines: of each octave, shape (octaves,).
        noise: variance of a line by all that is left, shape (octaves,).
        sensor: variance of a line by the sensor alone, shape (octaves,).
        threshold: relative excess that chance would show, shape (octaves,).
    """
    beyond = noise - sensor
    beyond = np.where(beyond > threshold * sensor, beyond, 0.0)
    gain = np.einsum("ki,oij,kj->ok", covariance, products, covariance)
    weight = np.where(lines > 0, lines * (beyond / noise) / noise, 0.0)
    return np.asarray(HIDDEN_SHARE**2 * np.maximum(weight @ gain, 0.0))
