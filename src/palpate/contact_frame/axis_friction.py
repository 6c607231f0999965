"""Friction of a joint or an axis: Coulomb, viscous, offset and Stribeck, from its force or torque and its motion.

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Indices
from palpate.contact_frame.axis_motion import SlidingBlocks, several_speeds, sliding_blocks
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.records import Record, Result
from palpate.signals.types import NORMAL
from palpate.units import impedance_units

LEVEL_SPREAD = 0.6
"""Prior standard deviation of (Fs - Fc) / Fc, which is positive: published ratios Fs / Fc are 1 to 2."""
MAX_UNEQUAL = 0.1
"""Fraction of a friction at one speed by which unequal speeds may move the offset."""
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
DRAWS = 6000
"""Draws from the joint distribution of parameters, which give the intervals; an end errs by 2 % of the width."""
NUMERICAL_MARGIN = 1.05
"""Factor of a half-width for the error of the draws and for the steps of the noise's grid, about 2 % each."""


NAMES = {
    "Fc": "Coulomb friction",
    "B": "viscous friction",
    "F0": "offset",
    "Fs": "static friction",
    "vs": "Stribeck speed",
    "F": "friction at the usual speed",
}
"""Parameters and their names, in the order of an answer."""


@dataclass(frozen=True, eq=False)
class AxisFriction(Result):
    """Friction of a joint or an axis, identified from a log.

    Args:
        parameters: Fc, B, F0, Fs, vs and F, the friction at the median speed.
        speeds: slowest, median and fastest speed of the fitted rows, without sign.
        directions: how many directions there are, 0 for no motion.
        units: of force and speed.
        rmse: root mean square of the residuals of the block means.
        r2: fraction of their variance that is explained.
        rows: fitted rows.
        notes: doubts about the log, as in a record's meta.
        points: speed, friction without nuisances of each block, shape (n, 2).
        curve: speed, friction and both ends of its interval, shape (m, 4).
    """

    parameters: dict[str, Parameter]
    speeds: tuple[float, float, float]
    directions: int
    units: tuple[str, str]
    rmse: float
    r2: float
    rows: int
    notes: Sequence[Mapping[str, str]] = ()
    points: Array = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    curve: Array = field(default_factory=lambda: np.empty((0, 4)), repr=False)

    @property
    def identified(self) -> bool:
        """True if a parameter is identified."""
        return any(p.verdict is Verdict.IDENTIFIED for p in self.parameters.values())

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        slowest, median, fastest = self.speeds
        return {
            "model": "coulomb-viscous-stribeck",
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "speeds": {
                "slowest": slowest, "median": median, "fastest": fastest, "unit": self.units[1],
                "directions": self.directions,
            },
            "fit": {"r2": self.r2, "rmse": self.rmse, "n": self.rows},
            "warnings": [dict(note) for note in self.notes],
        }  # fmt: skip


def identify_friction(record: Record, tolerance: float = 0.25, lag: float = 0.0) -> AxisFriction:
    """Identify the friction of a joint or an axis from its force or torque and its motion.

    Args:
        record: columns time, force (or torque), and position or velocity or both, in SI units.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a fraction of its value.
        lag: of the force behind the motion [s], if it is known; one of 20 ms and more biases Fc and B.

    Returns:
        The friction along the motion. The sign of the force is that by which the motion loses power.

    Raises:
        InputError: a column is missing, or there are too few rows.
    """
    blocks, units = sliding_blocks(record, lag)
    notes = [dict(note) for note in record.meta.get("notes", ())]
    if blocks is None:
        reason = "the log shows too little motion above the noise of its speed; move the axis back and forth"
        unknown = {name: Parameter.unknown(_unit(name, units), reason) for name in NAMES}
        return AxisFriction(unknown, (0.0, 0.0, 0.0), 0, units, 0.0, 0.0, 0, notes)
    return _identify(blocks, units, tolerance, notes)


class _Terms(NamedTuple):
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


def _terms(blocks: SlidingBlocks, grid: Array) -> _Terms:
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
    return _Terms(names, design / scale, scale, grid)


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


def _all_cells(terms: _Terms, products: _Whitened, spread: _PriorSpread) -> tuple[list[_Cells], list[_Cells]]:
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


def _draw(terms: _Terms, cells: list[_Cells]) -> dict[str, Array]:
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


class _Posterior(NamedTuple):
    """The grid after its refinement.

    Args:
        terms: of the last grid.
        products: likewise.
        cells: without the Stribeck effect, and with it where there are several speeds.
        shows: a Stribeck effect shows.
        spread: of the priors.
    """

    terms: _Terms
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


def _refine(blocks: SlidingBlocks, force: Array, spread: _PriorSpread) -> _Posterior:
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
    return _Posterior(terms, products, plain + effects, shows, spread)


def _identify(
    blocks: SlidingBlocks, units: tuple[str, str], tolerance: float, notes: list[dict[str, str]]
) -> AxisFriction:
    spread, opposed = _first_fit(blocks)
    if opposed:
        text = "the force acts against the motion that it drives, so its sign is turned"
        notes.append({"code": "force-sign-turned", "text": text})
    force = -blocks.force if opposed else blocks.force
    posterior = _refine(blocks, force, spread)
    terms, draws = posterior.terms, _draw(posterior.terms, posterior.cells)
    curvature = _curvature(posterior, blocks.limits[2])
    if curvature:
        notes.append({"code": "model-rejected", "text": curvature})
    parameters = _Judge(blocks.limits, units, tolerance, curvature).parameters(draws, terms, posterior.shows)
    best, i, k = posterior.best
    parts = terms.design[:, best.columns[k]] * best.theta[i, k]
    residual = force - parts.sum(axis=1)
    friction = np.isin(best.columns[k], [*terms.base[1:], *terms.effects])
    mean_square = np.average(residual**2, weights=blocks.count)
    variance = np.average((force - np.average(force, weights=blocks.count)) ** 2, weights=blocks.count)
    return AxisFriction(
        parameters, blocks.limits, len(set(np.sign(blocks.speed))), units, float(np.sqrt(mean_square)),
        float(1.0 - mean_square / max(variance, 1e-300)), int(blocks.count.sum()), notes,
        np.column_stack([blocks.speed, residual + parts[:, friction].sum(axis=1)]), _curve(draws, blocks),
    )  # fmt: skip


def _first_fit(blocks: SlidingBlocks) -> tuple[_PriorSpread, bool]:
    """Spread of the priors by approximate parameters, and whether the force acts against the motion."""
    terms = _terms(blocks, np.empty(0))
    columns = list(range(len(terms.names) + 3))
    theta = np.linalg.lstsq(terms.design[:, columns], blocks.force, rcond=1e-3)[0] / terms.scale[columns]
    by_name = dict(zip(terms.names, theta, strict=False))
    opposed = by_name.get("Fc", 0.0) + blocks.limits[1] * by_name.get("B", 0.0) < 0.0
    changes = max(float(np.std(blocks.force)), 1e-9 * float(abs(blocks.force).max()), 1e-300)
    level = max(abs(float(by_name.get("Fc", changes))), 0.01 * changes)
    return _PriorSpread(changes, LEVEL_SPREAD * level), opposed


def _curvature(posterior: _Posterior, fastest: float) -> str:
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


def _curve(draws: dict[str, Array], blocks: SlidingBlocks) -> Array:
    """Speed, friction and both ends of its interval over the speeds of the log, in each direction."""
    slowest, _, fastest = blocks.limits
    speeds = np.geomspace(slowest, fastest, 40)
    middle, low, high = np.quantile([_at(draws, speed) for speed in speeds], (0.5, 0.025, 0.975), axis=1)
    forth = np.column_stack([speeds, middle, low, high])
    back = -np.column_stack([speeds, middle, high, low])[::-1]
    return np.concatenate([back] * bool((blocks.speed < 0).any()) + [forth] * bool((blocks.speed > 0).any()))


def _at(draws: dict[str, Array], speed: float) -> Array:
    """Friction at a speed, for each draw; without the Coulomb friction where one direction does not show it."""
    level = draws.get("Fc", 0.0) + draws.get("B", 0.0) * speed
    return np.asarray(level + draws["rise"] * np.exp(-((speed / draws["vs"]) ** 2)))


class _Judge(NamedTuple):
    """Verdicts on the parameters.

    Args:
        limits: slowest, median and fastest speed.
        units: of force and speed.
        tolerance: largest half-width of an identified parameter, as a fraction of its value.
        rejected: why the model does not hold; empty if it does.
    """

    limits: tuple[float, float, float]
    units: tuple[str, str]
    tolerance: float
    rejected: str

    def parameters(self, draws: dict[str, Array], terms: _Terms, shows: bool) -> dict[str, Parameter]:
        """All parameters, by name in the order of `NAMES`."""
        one_speed = "B" not in terms.names
        parameters = {name: self._unknown(name, _ONE_DIRECTION) for name in NAMES}
        if not one_speed:
            parameters["B"] = self._judge("B", draws["B"], positive=True)
        if "Fc" not in terms.names:
            return parameters
        parameters["F0"] = self._judge("F0", draws["F0"])
        parameters["F"] = self._judge("F", _at(draws, self.limits[1]), positive=True)
        if one_speed:
            return parameters | self._of_one_speed(draws)
        parameters["Fc"] = self._judge("Fc", draws["Fc"], positive=True)
        parameters |= self._stribeck(draws, terms, shows)
        if self.rejected:
            parameters |= {
                name: parameters[name].without_number(self.rejected, Verdict.REJECTED)
                for name in ("Fc", "B", "Fs", "vs", "F")
            }
        return parameters

    def _stribeck(self, draws: dict[str, Array], terms: _Terms, shows: bool) -> dict[str, Parameter]:
        slowest = f"{self.limits[0]:.3g} {self.units[1]}"
        if not shows:
            reason = f"no Stribeck effect shows at {slowest} and above; move more slowly, too"
            return {name: self._unknown(name, reason) for name in ("Fs", "vs")}
        step = np.log(terms.grid[1] / terms.grid[0])
        draws = {name: values[np.isfinite(draws["vs"])] for name, values in draws.items()}
        within = np.random.default_rng(2).uniform(-0.5, 0.5, len(draws["vs"]))
        speed = self._judge("vs", draws["vs"] * np.exp(step * within), positive=True)
        reason = f"the slowest speed, {slowest}, is above half of vs: Fs would be extrapolated; move more slowly, too"
        reaches = self.limits[0] < 0.5 * float(np.median(draws["vs"]))
        level = draws["Fc"] + draws["rise"]
        static = self._judge("Fs", level, positive=True) if reaches else self._unknown("Fs", reason)
        return {"Fs": static, "vs": speed}

    def _of_one_speed(self, draws: dict[str, Array]) -> dict[str, Parameter]:
        """Bounds by a friction that is passive: neither Coulomb nor viscous friction is below zero."""
        slowest, median, fastest = self.limits
        high = max(float(np.quantile(_at(draws, median), 0.975)), 0.0)
        bounds = {"Fc": (0.0, high), "B": (0.0, high / median), "Fs": None, "vs": None}
        reason = (
            f"the log has one speed of {median:.3g} {self.units[1]} in a direction, where Fc + B v is one number, F;"
            " add strokes at half and at twice the speed"
        )
        parameters = {name: self._unknown(name, reason, ends) for name, ends in bounds.items()}
        # B v of unequal speeds is in the mean of both directions.
        unequal = high / median * (fastest - slowest) / 2
        if unequal > MAX_UNEQUAL * high:
            low, top = (float(end) for end in np.quantile(draws["F0"], (0.025, 0.975)))
            reason = "the speeds of the two directions differ, and viscous friction is in the mean of both"
            parameters["F0"] = self._unknown("F0", reason, (low - unequal, top + unequal))
        return parameters

    def _unknown(self, name: str, reason: str, ci95: tuple[float, float] | None = None) -> Parameter:
        return Parameter(None, None, ci95, _unit(name, self.units), Verdict.NOT_IDENTIFIABLE, reason)

    def _judge(self, name: str, draws: Array, *, positive: bool = False) -> Parameter:
        unit = _unit(name, self.units)
        quantiles = np.quantile(draws, (0.025, 0.5, 0.975))
        value = float(quantiles[1])
        # A Stribeck effect that may be there or not makes one side short: the longer one holds for both.
        half = NUMERICAL_MARGIN * float(np.diff(quantiles).max())
        low, high = value - half, value + half
        parameter = Parameter(
            value, half / NORMAL, (low, high), unit, Verdict.NOT_IDENTIFIABLE, "", {"noise": half}
        )
        bounds = f"95 %: {low:.3g} to {high:.3g} {unit}"
        if positive and high < 0.0:
            reason = f"{bounds}: below zero, which no passive friction is; is another force in the log?"
            return parameter.without_number(reason, Verdict.REJECTED)
        if low <= 0.0 <= high:
            return parameter.without_number(f"{bounds}; zero is within it", ci95=(low, high))
        if half > self.tolerance * abs(value):
            reason = f"{bounds}; wider than {self.tolerance:.0%}: move longer, and at more speeds in both directions"
            return replace(parameter, reason=reason)
        reason = f"known to {100 * half / abs(value):.2g} % (95 %)"
        return replace(parameter, verdict=Verdict.IDENTIFIED, reason=reason)


_ONE_DIRECTION = (
    "the axis moves in one direction, where Coulomb friction and offset are one number; move it back, too"
)


def _unit(name: str, units: tuple[str, str]) -> str:
    """Unit of a parameter, from those of force and speed."""
    force, speed = units
    if name == "B":
        return impedance_units(force, speed.removesuffix("/s"))["B"]
    return speed if name == "vs" else force
