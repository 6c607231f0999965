"""Estimates from block sums: the fit, its uncertainty by all causes, and a test of the model.

- Noise of the position pulls least squares towards zero. Its part of the information is taken out (Soderstrom,
  Errors-in-Variables Methods in System Identification, 2018, ch. 7); the interval holds how well it is known.
- The covariance is that of leaving one block out at a time (the jackknife; Shao and Wu, 1989): noise of any colour that
  a block outlasts, and a block that says something else than the others, widen it by themselves.
- The scores of regressors that the model lacks, and of the parameters over time, are tested block against block
  (Hotelling's T^2; Andrews, 1993, for a change at an instant that is not known).
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from palpate.arrays import Array
from palpate.identifiers.kernels import block_sums as sums

FALSE_ALARM = 1e-3
"""Probability at which a test rejects a model that holds, each time one looks."""
UNEXPLAINED = 1 / 3
"""Share of the force's power beyond which a fit identifies nothing."""
_IN_BAND = 0.3
"""Relative error of the position noise's power within the band of a fit, told from above it: `compensation` has the
same for a log."""
_DROWNED = 0.9
"""Share of the information that is the noise's, at most; beyond, a direction is as good as unknown."""
_FEWEST = 6
"""Blocks that make a covariance."""
_TRIMMED = 0.15
"""Of the blocks, at each end, no change is looked for (Andrews, 1993)."""
_LOOKS = 10.0
"""Independent instants among those at which a change is looked for."""
_STUDENT = 2.4
"""Of so many degrees of freedom f, Student's interval of 95 % is f / (f - 2.4) times Gauss', squared."""


@dataclass(frozen=True)
class BlockFit:
    """A fit from block sums.

    Args:
        theta: M, B, K and offset, compensated for noise of the position, shape (4,).
        step: what the compensation added, shape (4,).
        covariance: of theta, with everything of this file, shape (4, 4).
        open: the part of it that is not noise of the force: position noise and disagreement with a richer model,
            shape (4, 4).
        samples: that it is of.
        rejected: why the model is not believed; empty if nothing speaks against it.
    """

    theta: Array
    step: Array
    covariance: Array
    open: Array
    samples: float
    rejected: str


def block_fit(blocks: Array, weights: Array, deviations: Array, lag_std: float) -> BlockFit | None:
    """The fit of blocks of `block_sums`, shape (b, WIDTH); None where they are too few to say how far it holds.

    Args:
        blocks: the newest last.
        weights: by which a, v and x are read from the position, shape (3, taps).
        deviations: of M, B, K and offset before anything is known, shape (4,).
        lag_std: standard deviation of the lag between force and position [s].
    """
    blocks = blocks[blocks[:, sums.WEIGHT] > 0]
    if len(blocks) < _FEWEST:
        return None
    n, A, b = _equations(blocks)
    prior = np.diag(deviations**-2.0)
    noise = n.sum() * noise_spread(blocks, weights)
    less, step, doubt = _compensation(A.sum(axis=0)[:4, :4] + prior, b.sum(axis=0)[:4], noise, deviations)
    A[:, :4, :4] -= n[:, None, None] / n.sum() * less
    information = A.sum(axis=0)[:4, :4] + prior
    theta = _solved(information, b.sum(axis=0)[:4])
    shares = np.sum(A, axis=0) - A, np.sum(b, axis=0) - b
    short = _solved(shares[0][:, :4, :4] + prior, shares[1][:, :4])
    moved = _against_a_richer(A, b, shares, prior, theta, short)
    left = _solved(information, _solved(information, prior).T)
    late = lag_std * _solved(information, A.sum(axis=0)[:4, :5] @ _by_lag(theta))
    opened = doubt + np.diag(moved**2) + np.outer(late, late)
    covariance = _jackknife(short - theta) + left + opened
    rejected = _refusal(blocks, n, A, b, theta, prior, lag_std)
    return BlockFit(theta, step, covariance, opened, float(n.sum()), rejected)


def _by_lag(theta: Array) -> Array:
    """How the force changes with its lag, by a, v, x, 1 and the rate of a, shape (5,)."""
    return np.array([theta[1], theta[2], 0.0, 0.0, theta[0]])


def noise_spread(blocks: Array, weights: Array) -> Array:
    """Covariance of what noise of the position makes of a, v, x and 1 in one sample, shape (4, 4).

    Two kinds of noise count: white noise of the position, and jumps of it, white noise of its increments, as a slow
    motion through a coarse encoder makes them. The power of the sixth differences and the product of neighbours tell
    both. Half of the jumps' power is counted: an error never leaves its count, so towards the low frequencies of a
    motion it falls below what it is above.
    """
    power, product, count = blocks[:, [sums.NOISE_POWER, sums.NOISE_PRODUCT, sums.NOISE_COUNT]].sum(axis=0)
    spread = np.zeros((4, 4))
    if not count > 0:
        return spread
    # Sums of products of the binomial weights of sixth differences of both kinds, at no distance and at one.
    white, jump = np.linalg.solve([[924.0, 252.0], [-792.0, -210.0]], [power / count, product / count])
    if white < 0:
        white, jump = 0.0, power / count / 252.0
    elif jump < 0:
        white, jump = power / count / 924.0, 0.0
    steps = np.cumsum(weights, axis=1)
    steps[2] = 0.0
    of_jumps = steps @ steps.T
    of_jumps[0, 2] = of_jumps[2, 0] = -of_jumps[1, 1]
    spread[:3, :3] = white * weights @ weights.T + 0.5 * jump * of_jumps
    return spread


def _equations(blocks: Array) -> tuple[Array, Array, Array]:
    """Samples (b,), information (b, c, c) and right-hand sides (b, c) of the blocks."""
    at = sums.MOMENTS + sums.COLUMNS
    A = np.zeros((len(blocks), sums.COLUMNS, sums.COLUMNS))
    rows, columns = np.triu_indices(sums.COLUMNS)
    A[:, rows, columns] = A[:, columns, rows] = blocks[:, at:]
    return blocks[:, sums.WEIGHT], A, blocks[:, sums.MOMENTS : at]


def _scale(A: Array) -> Array:
    scale = np.sqrt(np.einsum("...ii->...i", A))
    return np.where(scale > 0, scale, 1.0)


def _solved(A: Array, b: Array) -> Array:
    """A^-1 b of columns of very different size; b of shape (..., n) or (n, n)."""
    scale = _scale(A)
    scaled = A / (scale[..., :, None] * scale[..., None, :]) + 1e-13 * np.eye(A.shape[-1])
    if A.ndim == 2 and b.ndim == 2:
        return np.linalg.solve(scaled, b / scale[:, None]) / scale[:, None]
    return np.linalg.solve(scaled, (b / scale)[..., None])[..., 0] / scale


def _compensation(A: Array, b: Array, noise: Array, deviations: Array) -> tuple[Array, Array, Array]:
    """The information that is the noise's, what taking it out moves theta by, and the covariance that it leaves open.

    In each direction of the parameters with its own share s of noise: least squares give 1 - s of what is true. Where
    that is not told, the direction keeps the deviation it had before anything was known.
    """
    scale = _scale(A)
    root = np.linalg.cholesky(A / np.outer(scale, scale) + 1e-13 * np.eye(len(A)))
    inner = np.linalg.solve(root, np.linalg.solve(root, noise / np.outer(scale, scale)).T)
    share, ways = np.linalg.eigh((inner + inner.T) / 2)
    told = (1 + _IN_BAND) * share < _DROWNED
    share = np.where(told, share, 0.0)
    back, out = np.linalg.solve(root.T, ways) / scale[:, None], scale[:, None] * (root @ ways)
    pull = back.T @ b
    step = pull * (1 / (1 - share) - 1)
    further = pull * (1 / (1 - (1 + _IN_BAND) * share) - 1 / (1 - share))
    doubt = np.where(told, further, np.linalg.norm(out.T * deviations, axis=1))
    return (out * share) @ out.T, back @ step, (back * doubt**2) @ back.T


def _jackknife(moves: Array) -> Array:
    """Covariance from what leaving each block out moves, shape (b, k) to (k, k)."""
    free = len(moves) - 1
    return free / len(moves) * free / (free - _STUDENT) * moves.T @ moves


def _against_a_richer(
    A: Array, b: Array, shares: tuple[Array, Array], prior: Array, theta: Array, short: Array
) -> Array:
    """Change of theta by the extra regressors, beyond the effect of noise (Hausman, 1978), shape (4,).

    Noise lets the two differ by 1.96 of the deviation that the jackknife gives their difference.
    """
    used = [0, 1, 2, 3, *range(sums.EXTRA, sums.COLUMNS)]
    wide = np.zeros((len(used), len(used)))
    wide[:4, :4] = prior
    # An extra regressor that the rest make up must not be used to tear them apart.
    wide[range(4, len(used)), range(4, len(used))] = 1e-6 * np.diag(A.sum(axis=0))[sums.EXTRA :]
    moved = _solved(A.sum(axis=0)[np.ix_(used, used)] + wide, b.sum(axis=0)[used])[:4] - theta
    each = _solved(shares[0][:, used][:, :, used] + wide, shares[1][:, used])[:, :4] - short
    noise = np.sqrt(np.diag(_jackknife(each - moved)))
    return np.maximum(np.abs(moved) - 1.96 * noise, 0.0)


def _refusal(blocks: Array, n: Array, A: Array, b: Array, theta: Array, prior: Array, lag_std: float) -> str:
    """Why the model is not believed, or nothing."""
    total, at = A.sum(axis=0), b.sum(axis=0)
    power = blocks[:, sums.SQUARES].sum()
    around = power - at[3] ** 2 / n.sum()
    unexplained = power - 2 * theta @ at[:4] + theta @ total[:4, :4] @ theta
    if around > 0 and unexplained > UNEXPLAINED * around:
        return f"{100 * unexplained / around:.0f} % of the force is not explained"
    scores = b - A[:, :, :4] @ theta
    if _changed(scores[:, :4]):
        return "the surface is another than it was: a change was found"
    # What an error of the lag makes of the force is taken out of the scores with what the parameters do.
    own = 5 if lag_std > 0 else 4
    inner = total[:own, :own].copy()
    inner[:4, :4] += prior
    gain = np.linalg.lstsq(
        inner / np.outer(_scale(inner), _scale(inner)), total[:own, sums.EXTRA :] / _scale(inner)[:, None]
    )[0]
    extra = scores[:, sums.EXTRA :] - scores[:, :own] @ (gain / _scale(inner)[:, None])
    if _pulled(extra):
        return "the force does what no mass, damping and stiffness make of the position"
    return ""


def _changed(scores: Array) -> bool:
    """Whether the parameters became others at some instant between the blocks (Andrews, 1993).

    The scores before an instant against those after it, the spread about the mean of each side: a change would make
    the spread about one mean for all as large as itself.
    """
    count, k = scores.shape
    first = max(int(np.ceil(_TRIMMED * count)), 2)
    sizes = np.arange(first, count - first + 1)
    if not len(sizes) or not (scale := _scale(scores.T @ scores)).all():
        return False
    x = scores / scale
    before = np.cumsum(x, axis=0)[sizes - 1]
    after = x.sum(axis=0) - before
    outer = np.einsum("mi,mj->mij", before, before) / sizes[:, None, None]
    outer += np.einsum("mi,mj->mij", after, after) / (count - sizes)[:, None, None]
    spread = (x.T @ x - outer + 1e-12 * np.eye(k)) / (count - 2)
    apart = before / sizes[:, None] - after / (count - sizes)[:, None]
    square = np.einsum("mi,mi->m", apart, np.linalg.solve(spread, apart[..., None])[..., 0])
    return _improbable(float(np.max(sizes * (count - sizes) / count * square)), k, count - 1, _LOOKS)


def _pulled(scores: Array) -> bool:
    """Whether scores have another mean than zero, for blocks that know nothing of one another."""
    count, k = scores.shape
    if not (scale := _scale(scores.T @ scores)).all():
        return False
    x = scores / scale
    mean = x.mean(axis=0)
    spread = (x.T @ x - count * np.outer(mean, mean) + 1e-12 * np.eye(k)) / (count - 1)
    return _improbable(float(count * mean @ np.linalg.solve(spread, mean)), k, count, 1.0)


def _improbable(square: float, k: int, count: int, looks: float) -> bool:
    """Whether Hotelling's T^2 (1931) of k scores in `count` blocks is too large, the largest of so many looks."""
    if count < 2 * k + 2:
        return False
    f = square * (count - k) / (k * (count - 1))
    return _normal_of_f(f, k, count - k) > NormalDist().inv_cdf(1 - FALSE_ALARM / looks)


def _normal_of_f(f: float, k: int, free: int) -> float:
    """The standard normal number as improbable as an F of k and `free` degrees of freedom (Paulson, 1942)."""
    u, w = 2 / (9 * k), 2 / (9 * free)
    root = float(np.cbrt(f))
    return ((1 - w) * root - (1 - u)) / float(np.sqrt(w * root**2 + u))
