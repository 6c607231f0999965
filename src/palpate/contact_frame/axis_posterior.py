"""Estimate of an axis' friction: the grid of noises and Stribeck speeds, and draws from what the log leaves open.

The force along the motion, over a stretch that slides without a reversal, is

    F = F0 + s (Fc + (Fs - Fc) exp(-(v / vs)^2)) + B v + M a + c1 x + c2 x^2 + e,    s = sign(v)

with the inertia M a, the terms of the position (gravity, a spring) and what remains of the last reversal (presliding)
as nuisances where the log shows them. All but vs is linear. The noise e is white and, beside it, correlated over a time
that the log shows (an Ornstein-Uhlenbeck process: drift, hum, cogging). vs, that time and the noise's ratio are
integrated over a grid by their marginal likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning,
2006, section 5.4), so that what they leave open is in every interval.

Rows about a reversal are left out: there the bodies stick, and a lag of the force is largest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Indices
from palpate.contact_frame.axis_motion import SlidingBlocks, several_speeds

LEVEL_SPREAD = 0.6
"""Prior standard deviation of (Fs - Fc) / Fc, which is positive: published ratios Fs / Fc are 1 to 2."""
STRIBECK_SPEEDS = 9
"""Stribeck speeds of the grid, in equal ratios from half of the slowest speed (2 % of the effect are left) to half
of the fastest."""
REFINEMENTS = 3
"""Times that this grid is refined about its likely part; each brings its steps down to a fourth."""
UNLIKELY = 7.0
"""Logarithm of the ratio to the largest likelihood from which on a cell is left out: one in a thousand."""
STRIBECK_EVIDENCE = 3.0
"""Logarithm of the ratio of likelihoods with and without a Stribeck effect from which on it shows (20 to 1)."""
CURVED_EVIDENCE = 10.0
"""The same for a curvature of the friction over the speed, by which the model is rejected..."""
CURVED_FRACTION = 0.1
"""... where the curvature is as large a fraction of the friction at the fastest speed."""
NUISANCES = 5
"""Columns of nuisances."""
NOISE_TIMES = 10
"""Correlation times of the noise's grid, in equal ratios from a block to ten times the log."""
NOISE_POWERS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)
"""Variance of the change of the correlated noise over a block, over that of the white noise of a block's mean."""
DRAWS = 60_000
"""Draws from the joint distribution of parameters, which give the intervals; an end errs by 0.6 % of a half-width
(sqrt(0.025 0.975 / n) over the normal density there)."""


class Terms(NamedTuple):
    """Columns of the linear model, divided by their root mean squares.

    Args:
        names: of the parameters, which come first: F0, Fc where both directions are there, B where two speeds are.
        design: parameters, nuisances (acceleration, position, its square, two transients), Stribeck effects,
            curvature, shape (n, p).
        scale: root mean square of each column, shape (p,).
        grid: Stribeck speeds, shape (k,); empty where one speed shows none.
    """

    names: list[str]
    design: Array
    scale: Array
    grid: Array

    @property
    def base(self) -> list[int]:
        """Columns of the parameters."""
        return list(range(len(self.names)))

    @property
    def nuisances(self) -> list[list[int]]:
        """Choices of nuisances: inertia or none, terms of the position or none, a transient or none."""
        first = len(self.names)
        inertias: list[list[int]] = [[], [first]]
        positions: list[list[int]] = [[], [first + 1, first + 2]]
        transients: list[list[int]] = [[], [first + 3], [first + 4]]
        return [a + b + c for a in inertias for b in positions for c in transients]

    @property
    def effects(self) -> list[int]:
        """Columns of the Stribeck effects."""
        first = len(self.names) + NUISANCES
        return list(range(first, first + len(self.grid)))


def _terms(blocks: SlidingBlocks, grid: Array) -> Terms:
    """Columns of the linear model, for Stribeck speeds of shape (k,)."""
    speed, sign = blocks.speed, np.sign(blocks.speed)
    names, columns = ["F0"], [np.ones(len(speed))]
    if len(set(sign)) == 2:
        names, columns = [*names, "Fc"], [*columns, sign]
    if several_speeds(speed):
        names, columns = [*names, "B"], [*columns, speed]
    else:
        grid = np.empty(0)
    rows = blocks.rows[0]
    # Noise of the speed flattens exp(-(v / vs)^2): a narrower and higher one has that mean.
    narrow = np.maximum(grid**2 - 2.0 * blocks.noise**2, 0.25 * grid**2)
    high = np.sqrt(1.0 + 2.0 * blocks.noise**2 / narrow)
    effects = [
        blocks.mean(h * np.sign(rows) * np.exp(-(rows**2) / n)) for h, n in zip(high, narrow, strict=True)
    ]
    nuisances = [blocks.acceleration, blocks.position, blocks.position**2, *blocks.transients.T]
    design = np.column_stack([*columns, *nuisances, *effects, blocks.mean(np.sign(rows) * rows**2)])
    scale = np.maximum(np.sqrt(np.mean(design**2, axis=0)), 1e-300)
    return Terms(names, design / scale, scale, grid)


class _PriorSpread(NamedTuple):
    """Prior standard deviations: of the root mean square of a nuisance, and of Fs - Fc."""

    nuisance: float
    rise: float


class _Noise(NamedTuple):
    """Covariances of the noise: correlation time [s], and variance of the correlated over that of the white part."""

    memory: Array
    power: Array


def _noise_grid(blocks: SlidingBlocks) -> _Noise:
    """The grid of covariances; the first is that of white noise."""
    step, length = float(np.median(np.diff(blocks.time))), float(np.ptp(blocks.time))
    memory = np.repeat(np.geomspace(step, 10.0 * length, NOISE_TIMES), len(NOISE_POWERS))
    # A slow noise is seen by its change between blocks: the grid is of that, not of its variance.
    power = np.tile(NOISE_POWERS, NOISE_TIMES) / np.minimum(1.0, 2.0 * step / memory)
    return _Noise(np.append(step, memory), np.append(0.0, power))


class _Whitened(NamedTuple):
    """Products of columns and force under each covariance.

    Args:
        gram: of columns and force, the force last, shape (c, p + 1, p + 1).
        log_det: logarithm of each covariance's determinant, shape (c,).
        blocks: how many there are.
    """

    gram: Array
    log_det: Array
    blocks: int


def _whiten(blocks: SlidingBlocks, noise: _Noise, design: Array, force: Array) -> _Whitened:
    """Whiten columns and force by a Kalman filter of the correlated noise, for all covariances together."""
    columns = np.column_stack([design, force])
    white = blocks.count.mean() / blocks.count
    state = np.zeros((len(noise.power), columns.shape[1]))
    variance, log_det = noise.power.copy(), np.zeros(len(noise.power))
    innovations = np.empty((len(columns), *state.shape))
    for k, row in enumerate(columns):
        if k:
            keep = np.exp(-(blocks.time[k] - blocks.time[k - 1]) / noise.memory)
            state *= keep[:, None]
            variance = noise.power + keep**2 * (variance - noise.power)
        total = variance + white[k]
        residual = row - state
        state += (variance / total)[:, None] * residual
        variance = variance * white[k] / total
        innovations[k] = residual / np.sqrt(total)[:, None]
        log_det += np.log(total)
    gram = np.einsum("ncp,ncq->cpq", innovations, innovations, optimize=True)
    return _Whitened(gram, log_det, len(force))


class _Cells(NamedTuple):
    """Fits of one choice of columns, for each covariance c and each Stribeck speed k.

    Args:
        columns: that are fitted, for each Stribeck speed, whose effect is the last, shape (k, m).
        likelihood: logarithm of the marginal likelihood, shape (c, k).
        theta: coefficients, shape (c, k, m).
        cov: covariance of these over the noise's variance, shape (c, k, m, m).
        rss: squared residuals over that, shape (c, k).
        freedom: degrees of freedom.
        stribeck: the last column is an effect.
    """

    columns: Indices
    likelihood: Array
    theta: Array
    cov: Array
    rss: Array
    freedom: int
    stribeck: bool


def _fit(products: _Whitened, columns: Indices, variances: Array, *, stribeck: bool = False) -> _Cells:
    """Fit columns by least squares, some with a normal prior about zero.

    Args:
        products: of columns and force.
        columns: fitted, those without a prior first, shape (k, m).
        variances: of the priors of the last coefficients, shape (k, r).
        stribeck: the last coefficient is that of a Stribeck effect, which is positive.
    """
    from scipy.special import log_ndtr

    normal = products.gram[:, columns[:, :, None], columns[:, None, :]]
    right = products.gram[:, columns, -1]
    whole = products.gram[:, -1:, -1]
    diagonal = np.arange(columns.shape[1])
    # A column that is zero, or a sum of others, has no number and spoils none.
    normal[..., diagonal, diagonal] += 1e-9 * products.gram[:, None, None, 0, 0]
    bare = whole - np.einsum("ckm,ckm->ck", np.linalg.solve(normal, right[..., None])[..., 0], right)
    bare_freedom = products.blocks - columns.shape[1]
    precisions = (np.maximum(bare, 1e-300) / bare_freedom)[..., None] / variances
    with_prior = diagonal[len(diagonal) - variances.shape[1] :]
    normal[..., with_prior, with_prior] += precisions
    cov = np.asarray(np.linalg.inv(normal))
    theta = (cov @ right[..., None])[..., 0]
    rss = np.maximum(whole - np.einsum("ckm,ckm->ck", theta, right), 1e-300)
    freedom = products.blocks - len(diagonal) + len(with_prior)
    determinants = np.linalg.slogdet(normal)[1] - np.log(precisions).sum(axis=-1)
    likelihood = -0.5 * (products.log_det[:, None] + determinants + freedom * np.log(rss))
    if stribeck:
        std = np.sqrt(cov[..., -1, -1] * rss / freedom)
        likelihood += np.log(2.0) + log_ndtr(theta[..., -1] / std)
    return _Cells(columns, likelihood, theta, cov, rss, freedom, stribeck)


def _all_cells(terms: Terms, products: _Whitened, spread: _PriorSpread) -> tuple[list[_Cells], list[_Cells]]:
    """Cells without and with a Stribeck effect, of each choice of nuisances."""
    plain, effects = [], []
    rises = (spread.rise * terms.scale[terms.effects]) ** 2
    for nuisances in terms.nuisances:
        columns = np.array([terms.base + nuisances])
        variances = np.full((1, len(nuisances)), spread.nuisance**2)
        plain.append(_fit(products, columns, variances))
        if terms.effects:
            count = len(terms.effects)
            columns = np.column_stack([np.repeat(columns, count, axis=0), np.array(terms.effects)])
            variances = np.column_stack([np.repeat(variances, count, axis=0), rises])
            effects.append(_fit(products, columns, variances, stribeck=True))
    return plain, effects


def _evidence(cells: list[_Cells]) -> float:
    """Logarithm of the mean marginal likelihood."""
    values = np.concatenate([c.likelihood.ravel() for c in cells])
    return float(values.max() + np.log(np.mean(np.exp(values - values.max()))))


def _likely(plain: list[_Cells], effects: list[_Cells]) -> tuple[Indices, Indices]:
    """Indices of the covariances and of the Stribeck speeds that are not unlikely."""
    least = max(c.likelihood.max() for c in plain + effects) - UNLIKELY
    covariances = np.any([(c.likelihood > least).any(axis=1) for c in plain + effects], axis=0)
    least = max(c.likelihood.max() for c in effects) - UNLIKELY
    speeds = np.any([(c.likelihood > least).any(axis=0) for c in effects], axis=0)
    return np.flatnonzero(covariances), np.flatnonzero(speeds)


def draw_parameters(terms: Terms, cells: list[_Cells]) -> dict[str, Array]:
    """Draws from the joint distribution: parameters by name, Fs - Fc as `rise`, and vs, each of shape (d,)."""
    from scipy.special import ndtr, ndtri

    random = np.random.default_rng(1)
    likelihood = np.concatenate([c.likelihood.ravel() for c in cells])
    weights = np.exp(likelihood - likelihood.max())
    counts = random.multinomial(DRAWS, weights / weights.sum())
    drawn: dict[str, list[Array]] = {name: [] for name in (*terms.names, "rise", "vs")}
    places = [(c, i, k) for c in cells for i, k in np.ndindex(*c.likelihood.shape)]
    for (fit, i, k), many in zip(places, counts, strict=True):
        if not many:
            continue
        middle, cov = fit.theta[i, k], fit.cov[i, k]
        std = np.sqrt(fit.rss[i, k] / random.chisquare(fit.freedom, many))
        theta = middle + std[:, None] * (
            random.standard_normal((many, len(middle))) @ np.linalg.cholesky(cov).T
        )
        rise, speed = np.zeros(many), np.full(many, np.inf)
        if fit.stribeck:
            # The effect is positive: draw it from its truncated distribution, and move the others along with it.
            spread = std * np.sqrt(cov[-1, -1])
            uniform = np.maximum(random.random(many) * ndtr(middle[-1] / spread), 1e-300)
            effect = np.maximum(middle[-1] - spread * ndtri(uniform), 0.0)
            theta += np.outer(effect - theta[:, -1], cov[-1] / cov[-1, -1])
            rise, speed = effect / terms.scale[fit.columns[k, -1]], np.full(many, terms.grid[k])
        for index, name in enumerate(terms.names):
            drawn[name].append(theta[:, index] / terms.scale[index])
        drawn["rise"].append(rise)
        drawn["vs"].append(speed)
    return {name: np.concatenate(parts) for name, parts in drawn.items()}


class Posterior(NamedTuple):
    """The grid after its refinement.

    Args:
        terms: of the last grid.
        products: likewise.
        cells: without the Stribeck effect, and with it where there are several speeds.
        shows: a Stribeck effect shows.
        spread: of the priors.
    """

    terms: Terms
    products: _Whitened
    cells: list[_Cells]
    shows: bool
    spread: _PriorSpread

    @property
    def best(self) -> tuple[_Cells, int, int]:
        """The most likely cell: the fit of its columns, its covariance and its Stribeck speed."""
        best = max(self.cells, key=lambda c: float(c.likelihood.max()))
        i, k = np.unravel_index(int(np.argmax(best.likelihood)), best.likelihood.shape)
        return best, int(i), int(k)


def refine_grid(blocks: SlidingBlocks, force: Array, spread: _PriorSpread) -> Posterior:
    """Fit the grid, and refine its Stribeck speeds about the likely ones."""
    slowest, _, fastest = blocks.limits
    grid = np.geomspace(0.5 * slowest, 0.5 * fastest, STRIBECK_SPEEDS)
    noise, shows = _noise_grid(blocks), False
    for attempt in range(REFINEMENTS + 1):
        terms = _terms(blocks, grid)
        products = _whiten(blocks, noise, terms.design, force)
        plain, effects = _all_cells(terms, products, spread)
        if not effects:
            break
        if attempt == 0:
            shows = _evidence(effects) - _evidence(plain) > STRIBECK_EVIDENCE
        if attempt < REFINEMENTS:
            covariances, speeds = _likely(plain, effects)
            noise = _Noise(*(values[covariances] for values in noise))
            low, high = grid[max(speeds[0] - 1, 0)], grid[min(speeds[-1] + 1, len(grid) - 1)]
            grid = np.geomspace(float(low), float(high), STRIBECK_SPEEDS)
        # Each Stribeck speed has its share of the prior: as much as all of them has the friction without the effect.
        share = np.log(grid[1] / grid[0]) / np.log(fastest / slowest)
        effects = [c._replace(likelihood=c.likelihood + np.log(share)) for c in effects]
    return Posterior(terms, products, plain + effects, shows, spread)


def fit_roughly(blocks: SlidingBlocks) -> tuple[_PriorSpread, bool]:
    """Spread of the priors by approximate parameters, and whether the force acts against the motion."""
    terms = _terms(blocks, np.empty(0))
    columns = list(range(len(terms.names) + 3))
    theta = np.linalg.lstsq(terms.design[:, columns], blocks.force, rcond=1e-3)[0] / terms.scale[columns]
    by_name = dict(zip(terms.names, theta, strict=False))
    opposed = by_name.get("Fc", 0.0) + blocks.limits[1] * by_name.get("B", 0.0) < 0.0
    changes = max(float(np.std(blocks.force)), 1e-9 * float(abs(blocks.force).max()), 1e-300)
    level = max(abs(float(by_name.get("Fc", changes))), 0.01 * changes)
    return _PriorSpread(changes, LEVEL_SPREAD * level), opposed


def describe_curvature(posterior: Posterior, fastest: float) -> str:
    """A sentence where the friction is certainly no straight line over the speed; else an empty text."""
    terms, products = posterior.terms, posterior.products
    if "B" not in terms.names or "Fc" not in terms.names:
        return ""
    best, i, k = posterior.best
    columns = best.columns[k : k + 1]
    # The Stribeck effect stays the last column: what it explains is no curvature.
    place = columns.shape[1] - best.stribeck
    columns = np.insert(columns, place, len(terms.scale) - 1, axis=1)
    # The curvature is a nuisance of its own, with as wide a prior as the others.
    variances = np.full((1, columns.shape[1] - len(terms.base)), posterior.spread.nuisance**2)
    if best.stribeck:
        variances[0, -1] = (posterior.spread.rise * terms.scale[columns[0, -1]]) ** 2
    bent = _fit(products, columns, variances, stribeck=best.stribeck)
    theta = bent.theta[i, 0] / terms.scale[columns[0]]
    curve = theta[place] * fastest**2
    friction = theta[1] + theta[2] * fastest + curve
    gain = bent.likelihood[i, 0] - best.likelihood[i, k]
    if gain < CURVED_EVIDENCE or abs(curve) < CURVED_FRACTION * abs(friction):
        return ""
    slope = theta[2] + 2.0 * theta[place] * fastest
    return (
        f"the friction is no straight line over the speed: its slope is {theta[2]:.3g} at slow speeds and {slope:.3g}"
        f" at {fastest:.3g}; fit a narrower range of speeds with --start and --end"
    )
