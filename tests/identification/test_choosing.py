from __future__ import annotations

import numpy as np
import pytest

from identification.questions import question
from identification.synthetic_contacts import coloured, force_of, press_path, pressed, record, shaken
from palpate.identification import Verdict, identify
from palpate.identification.choosing import choose
from palpate.identification.estimators.fit import fit
from palpate.identification.filters.state_variable import low_pass_once
from palpate.identification.models import (
    KELVIN_VOIGT,
    at_rest_before,
    direction,
    hunt_crossley,
    relaxing,
    with_friction,
)

TIME = np.arange(6000) / 1000


def noisy(force, std=0.03, seed=0):
    return force + coloured(len(force), std, 0.9, np.random.default_rng(seed))


def power_law(seed=0, n=1.5, b=1.5):
    x = press_path(TIME, 0.06)
    return record(TIME, x, noisy(force_of(x, lambda d, v: 3e6 * d**n * (1 + b * v), 1e-3), seed=seed))


def snapping(size):
    """A structure that is pushed and pulled through its unstable middle: f = -4000 x + K3 x^3 + 5 v."""
    x = size * np.sin(np.pi * TIME) + 0.2 * size * np.sin(14 * np.pi * TIME)
    v = np.gradient(x, 1e-3)
    return record(TIME, x, noisy(-4000 * x + 4000 / 1.5e-3**2 * x**3 + 5 * v))


@pytest.mark.parametrize("size", [1.2e-3, 2.5e-3])
def test_a_bistable_structure_has_no_stiffness(size):
    choice = choose(question(snapping(size), bonded=True))
    assert choice.rejected
    k = [part for part in choice.candidate.disagreements if part.name == "K"]
    assert k[0].parts["the middle"] == pytest.approx(-4000, rel=0.01)
    assert k[0].spread > choice.candidate.fit["K"]


def test_a_hold_that_relaxes_is_no_kelvin_voigt_contact():
    x = press_path(TIME, 0.06)
    d = np.maximum(x, 0)
    branch = d - low_pass_once(d, 0.23, 1e-3)
    force = np.where(x > 0, np.maximum(5600 * d + 13 * np.gradient(x, 1e-3) + 6900 * branch, 0), 0)
    log = record(TIME, x, noisy(force))
    found = identify(log, lag=0.0, model="kelvin-voigt")
    assert "model-rejected" in found.codes
    assert all(p.verdict is not Verdict.IDENTIFIED for p in found.parameters.values())
    with_touch = choose(question(log))
    assert with_touch.candidate.fit.model.name == "standard-linear-solid"
    for name, truth in (("K", 5600), ("K1", 6900), ("tau", 0.23)):
        assert with_touch.candidate.fit[name] == pytest.approx(truth, rel=0.02)


def test_a_plain_contact_is_not_taken_for_a_richer_one():
    names = [choose(question(pressed(seed=seed))).candidate.label for seed in range(15)]
    assert set(names) == {"kelvin-voigt"}
    shaken_names = [choose(question(shaken(seed=seed, n=2500))).candidate.label for seed in range(8)]
    assert set(shaken_names) == {"kelvin-voigt-mass"}


def test_the_touch_tells_the_exponent():
    asked = question(power_law())
    choice = choose(asked)
    fitted = choice.candidate.fit
    assert fitted.model.name == "hunt-crossley"
    assert not choice.rejected
    assert choice.candidate.question.resting == pytest.approx(0.0, abs=0.1)
    assert fitted["n"] == pytest.approx(1.5, abs=3 * fitted.std("n"))
    without = fit(hunt_crossley(asked.motion), asked.motion, asked.force, asked.lag)
    assert fitted.std("n") < without.std("n") / 2


def test_intervals_of_exponent_and_surface_cover_the_truth():
    inside = {"n": 0, "x0": 0}
    for seed in range(20):
        asked = question(power_law(seed)).with_touches
        fitted = fit(at_rest_before(hunt_crossley(asked.motion)), asked.motion, asked.force, asked.lag)
        truth = {"n": 1.5, "x0": -asked.origin}  # the surface is at zero
        for name, value in truth.items():
            inside[name] += abs(fitted[name] - value) < fitted.t * fitted.std(name)
    assert min(inside.values()) >= 15, inside  # 19 expected, four deviations less


def test_friction_beside_a_spring_and_a_damper():
    x = press_path(TIME, 0.2)
    v = np.gradient(x, 1e-3)
    asked = question(record(TIME, x, noisy(np.where(x > 0, 5000 * x + 20 * v + 1.5 * np.sign(v), 0))))
    plain = fit(KELVIN_VOIGT, asked.motion, asked.force, asked.lag)
    rubbed = fit(with_friction(KELVIN_VOIGT, direction(asked.motion)), asked.motion, asked.force, asked.lag)
    assert rubbed.names[:4] == ("K", "B", "Fc", "offset")
    assert rubbed["Fc"] == pytest.approx(1.5, rel=0.1)
    assert rubbed["B"] == pytest.approx(20, abs=10)
    assert abs(plain["B"] - 20) > 50
    assert rubbed.rmse < plain.rmse / 3


def test_a_branch_that_relaxes_beside_a_power_law():
    x = press_path(TIME, 0.06)
    s = np.maximum(x, 0) ** 1.5
    spring = 1e6 * s + 5e5 * (s - low_pass_once(s, 0.1, 1e-3))
    force = noisy(np.where(x > 0, np.maximum(spring, 0), 0))
    asked = question(record(TIME, x, force)).with_touches
    model = relaxing(at_rest_before(hunt_crossley(asked.motion)), asked.motion)
    fitted = fit(model, asked.motion, asked.force, asked.lag)
    assert fitted["n"] == pytest.approx(1.5, abs=0.02)
    assert fitted["tau"] == pytest.approx(0.1, rel=0.1)
    assert fitted["K1"] / fitted["K"] == pytest.approx(0.5, rel=0.1)


def test_direction_is_the_sign_of_the_motion():
    asked = question(pressed())
    way = direction(asked.motion)
    v = np.gradient(asked.motion.position, asked.motion.chain.dt)
    fast = np.abs(v) > 0.2 * np.abs(v).max()
    assert np.mean(np.sign(v[fast]) * way[fast]) > 0.95
    assert np.abs(way[: len(way) // 8]).max() < 1e-3  # the probe rests before it comes down
