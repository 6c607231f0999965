"""How far off each parameter may be, by cause: each cause planted in data that have it."""

from __future__ import annotations

import numpy as np
import pytest

from identification.test_by_octave import DT, ROWS, level, system
from palpate.identification import budget as causes
from palpate.identification.octaves import System, estimate, solve
from palpate.signals.octaves import HIDDEN_SHARE

NOISE = 0.1


def flat_columns(seed=0, count=1):
    """White columns: each octave has power by its lines."""
    return np.random.default_rng(seed).normal(size=(ROWS, count))


def stiffer_about(column, frequency, more):
    """A force of stiffness 5, and more in one octave [Hz]."""
    lines = np.fft.rfft(column)
    at = np.fft.rfftfreq(ROWS, DT)
    inside = (at > frequency / 2**0.5) & (at < frequency * 2**0.5)
    return np.fft.irfft(lines * np.where(inside, 5.0 + more, 5.0), ROWS)


def stretch_spread(each, seed=0):
    """Of a log in equal stretches, each with a stiffness of its own."""
    column = flat_columns(seed)
    force = column[:, 0] * np.repeat(each, ROWS // len(each))
    asked = system(column, force + np.random.default_rng([seed, 2]).normal(0, NOISE, ROWS))
    whole = estimate(asked)
    return causes.stretch_spread(asked, whole), whole


def by_residuals(columns, target, groups):
    """Variance and degrees of freedom of CR2 over the rows (Bell and McCaffrey, 2002), for noise of variance 1."""
    cov = np.linalg.inv(columns.T @ columns)
    hat = columns @ cov @ columns.T
    residuals = target - hat @ target
    weights = np.zeros((groups.max() + 1, columns.shape[1], len(columns)))
    for g in range(len(weights)):
        own = groups == g
        value, vector = np.linalg.eigh(np.eye(own.sum()) - hat[np.ix_(own, own)])
        weights[g][:, own] = cov @ columns[own].T @ (vector / np.sqrt(value)) @ vector.T
    spread = weights @ (np.eye(len(columns)) - hat)  # of the rows' noise
    tied = np.einsum("gpn,hpn->pgh", spread, spread)
    freedom = np.einsum("pgg->p", tied) ** 2 / np.einsum("pgh,pgh->p", tied, tied)
    return ((weights @ residuals) ** 2).sum(axis=0), freedom, np.diag(cov)


def test_stretches_of_unlike_leverage_count_as_bell_and_mccaffrey_have_it():
    rng = np.random.default_rng(4)
    groups = np.repeat(np.arange(5), 12)
    columns = rng.normal(size=(60, 2)) * np.where(groups == 2, 8.0, 1.0)[:, None]
    target = columns @ [1.0, 2.0] + rng.normal(size=60) * np.where(groups == 2, 3.0, 1.0)
    variance, freedom, own = by_residuals(columns, target, groups)
    rows = np.column_stack([columns, target])
    products = np.stack([rows[groups == g].T @ rows[groups == g] for g in range(5)])[:, None]
    asked = System(
        products.sum(axis=0), np.array([60.0]), (products, np.full((5, 1), 12.0)), np.zeros(2), np.zeros(2)
    )
    found = causes.stretch_spread(asked, solve(asked, np.ones(1)))
    assert found.freedom == pytest.approx(np.clip(freedom, 1, 4), rel=1e-6)
    assert found.variance == pytest.approx(np.maximum(variance - own, 0), rel=1e-6)
    assert freedom.max() < 2  # one stretch has nearly all that tells them


def test_stretches_that_differ_have_the_variance_of_their_mean():
    each = 5.0 + np.array([1.0, -1.0, 0.5, -0.5, 1.0, -1.0, 0.5, -0.5])
    found, whole = stretch_spread(each)
    variance = found.variance[0] + whole.cov[0, 0]
    # Stretches of white motion have as much of it to a tenth, and blocks at their edges are of two of them.
    assert np.sqrt(variance) == pytest.approx(each.std(ddof=1) / np.sqrt(8), rel=0.5)
    assert found.freedom == pytest.approx([7.0], rel=0.05)


def test_stretches_that_agree_add_next_to_nothing():
    """In the mean over seeds: the scatter of eight about their variance."""
    shares = []
    for seed in range(40):
        found, whole = stretch_spread(np.full(8, 5.0), seed)
        shares.append(found.variance[0] / whole.cov[0, 0])
    assert np.mean(shares) < 0.5


def test_a_stretch_that_alone_has_the_motion_is_not_held_against_the_rest():
    """The probe moves in one eighth of the log: what is left of it says nothing, and takes nothing away."""
    column = flat_columns()
    column[ROWS // 8 :] *= 1e-3
    asked = system(column, 5.0 * column[:, 0] + np.random.default_rng(2).normal(0, NOISE, ROWS))
    whole = estimate(asked)
    assert causes.stretch_spread(asked, whole).variance[0] < 2 * whole.cov[0, 0]


def test_a_force_that_nothing_explains_is_bounded_by_what_is_seen_of_it():
    """A spring whose force is off by a known amount in one octave: half of that may lie along its column."""
    column = flat_columns()
    asked = system(column, 5.0 * column[:, 0])
    noise = level(asked, NOISE**2)
    seen = noise.copy()
    seen[4] += 2.0**2
    found = causes.unexplained_spread(asked, solve(asked, seen), noise, asked.lines)
    weight = 1 / seen
    gram = asked.products[:, 0, 0]
    # All lines of the octave may conspire: a force of amplitude 2 in each, along the column.
    pull = np.sqrt(asked.lines[4] * 2.0**2 * gram[4]) * weight[4] / (weight @ gram)
    assert np.sqrt(found.variance[0]) == pytest.approx(HIDDEN_SHARE * pull, rel=1e-6)
    none = causes.unexplained_spread(asked, solve(asked, seen), seen, asked.lines)
    assert none.variance[0] == 0.0


def test_parts_of_the_covariance_are_what_each_cause_adds():
    """Noise with lag and other forces known; what the lag, and what the other forces, add to it."""
    base = flat_columns(0)
    own = np.column_stack([base, base + 0.5 * flat_columns(1), base + 2.0 * flat_columns(2)])
    force = own[:, :1] @ [5.0] + np.random.default_rng(5).normal(0, NOISE, ROWS)
    asked = system(own, force, names=("K", "lag", "Fc"))
    noise = level(asked, NOISE**2)
    whole = solve(asked, noise)
    parts = causes.noise_budget(asked, whole, ("K", "lag", "Fc"), 2, "lag")
    assert set(parts) == {"noise", "lag", "other forces"}
    total = sum(part.variance for part in parts.values())
    assert total[0] == pytest.approx(whole.cov[0, 0], rel=1e-6)
    without_others = system(own[:, :2], force, names=("K", "lag"))
    alone = solve(without_others, noise).cov[0, 0]
    assert parts["other forces"].variance[0] == pytest.approx(whole.cov[0, 0] - alone, rel=1e-3)
    without_lag = system(own[:, [0, 2]], force, names=("K", "Fc"))
    known = solve(without_lag, noise).cov[0, 0]
    assert parts["lag"].variance[0] == pytest.approx(whole.cov[0, 0] - known, rel=1e-3)
    assert parts["lag"].variance[1] == 0.0
