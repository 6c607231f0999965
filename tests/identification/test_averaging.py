"""Averaging over which other forces are there: its evidence against the density itself, and what follows from it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from identification.test_budget import NOISE, flat_columns, stiffer_about
from identification.test_by_octave import DT, ROWS, level, system
from palpate.identification.averaging import average_members, members, octave_spread
from palpate.identification.octaves import MAX_TERM_RATIO, PERIODS, System, solve

COUNT = 60


def rows_of(other, noise, seed=0, collinear=0.99):
    """Columns of a spring and of a force that goes nearly as it does, their sum of sizes 5 and `other`, and noise."""
    rng = np.random.default_rng(seed)
    spring, own = rng.normal(size=(2, COUNT))
    column = collinear * spring + np.sqrt(1 - collinear**2) * own
    return np.column_stack([spring, column]), 5 * spring + other * column + rng.normal(0, noise, COUNT)


def asked_of(columns, force):
    """Their normal equations in one octave, a row a line; the weak prior of the largest size on both."""
    rows = np.column_stack([columns, force])
    products = (rows.T @ rows)[None]
    power = np.diag(products[0])
    weight = power[:-1] / (MAX_TERM_RATIO**2 * power[-1])
    lines = np.array([float(len(rows))])
    return System(products, lines, (products[None], lines[None]), np.zeros(columns.shape[1]), weight)


def test_the_evidence_is_the_density_of_the_log_under_each_prior():
    """Of a force that has noise, and columns times what their priors draw, as a Gaussian of all rows together."""
    columns, force = rows_of(0.3, 0.5)
    asked = asked_of(columns, force)
    found = members(asked, np.array([0.25]), np.array([0.25]), [[1]])
    covs = [0.25 * np.eye(COUNT) + columns / own.system.prior_weight @ columns.T for own in found]
    density = np.array([multivariate_normal(np.zeros(COUNT), cov).logpdf(force) for cov in covs])
    share = np.exp(density - density.max())
    assert len(found) > 1
    assert [own.weight for own in found] == pytest.approx(share / share.sum(), rel=1e-5)


def test_what_is_left_beyond_the_noise_is_less_evidence():
    """The same misfit, of a sensor ten times quieter: no chance, so that all sizes stay likely."""
    columns, force = rows_of(0.0, 0.1)
    asked, noise = asked_of(columns, force), np.array([1e-2])
    by_chance, by_model = (members(asked, noise, noise * share, [[1]]) for share in (1.0, 1e-2))
    assert average_members(by_model).cov[0, 0] > 1.5 * average_members(by_chance).cov[0, 0]


@pytest.mark.parametrize("collinear", [0.0, 0.9, 0.99])
def test_intervals_hold_a_spring_beside_a_force_of_any_size(collinear):
    """Of 400 logs whose other force is nought, or anything between a thousandth and the whole of the spring's."""
    rng = np.random.default_rng(7)
    held = 0
    for seed in range(400):
        size = 0.0 if seed % 2 else 5 * 10 ** rng.uniform(-3, 0)
        columns, force = rows_of(size, 0.1, seed, collinear)
        noise = np.array([0.01])
        found = average_members(members(asked_of(columns, force), noise, noise, [[1]]))
        held += abs(found.theta[0] - 5.0) < 1.96 * np.sqrt(found.cov[0, 0])
    assert held / 400 > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 400)  # three deviations of a binomial


@pytest.mark.parametrize("off", [0.0, 3.0])
def test_an_octave_that_differs_is_seen_by_leaving_it_out(off):
    """Its pull on the answer of all is what the jackknife finds, and no more than a deviation where none differs."""
    column = flat_columns()
    at = PERIODS / (ROWS // 16 * DT)
    noise = np.random.default_rng(1).normal(0, NOISE, ROWS)
    asked = system(column, stiffer_about(column[:, 0], at, off) + noise)
    levels = level(asked, NOISE**2)
    whole = solve(asked, levels)
    found = np.sqrt(octave_spread(whole, asked, levels, levels, []).variance[0])
    pull = abs(whole.theta[0] - 5.0)
    std = np.sqrt(whole.cov[0, 0])
    if off:
        assert pull > 10 * std
        assert found > pull / 2  # the octaves beside it overlap with it
        assert found < 2 * pull
    else:
        assert found < 3 * std
