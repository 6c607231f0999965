"""A mass that the force shows in free motion is named and taken out, whichever way it was compensated."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import record
from palpate.identification import Verdict, identify

TIME = np.arange(4000) / 500
RNG = np.random.default_rng


def shaken(payload: float, seed: int = 0):
    """Sines in free motion and into the surface; the force has the inertia of what moves beyond the sensor."""
    lines = np.array([0.7, 1.9, 3.1])
    omega, phase = 2 * np.pi * lines[:, None], np.array([0.0, 1.0, 2.0])[:, None]
    waves = 3e-3 * np.sin(omega * TIME + phase) * np.array([1.0, 0.5, 0.3])[:, None]
    x = -1e-3 + waves.sum(0)
    v = np.gradient(x, TIME)
    a = -(omega**2 * waves).sum(0)
    force = np.where(x > 0, np.maximum(2500 * x + 12 * v, 0), 0.0) + payload * a
    noise = RNG(seed).normal(0, 0.01, len(TIME))
    return record(TIME, x + RNG(seed + 1).normal(0, 1e-6, len(TIME)), force + noise)


@pytest.mark.parametrize("payload", [0.8, 0.2, -0.2])
def test_an_inertia_in_the_air_is_named_and_taken_out(payload):
    found = identify(shaken(payload), lag=0.0)
    text = next(w.text for w in found.warnings if w.code.word == "tool-inertia")
    assert float(text.split("mass of ")[1].split(" kg")[0]) == pytest.approx(payload, abs=0.02)
    assert ("wrong sign" in text) == (payload < 0)
    mass = found.parameters["M"]
    assert mass.value is None or abs(mass.value) < 0.02  # the surface has none
    stiffness = found.parameters["K"]
    assert stiffness.ci95[0] < 2500 < stiffness.ci95[1]
    assert stiffness.value == pytest.approx(2500, rel=0.01)


@pytest.mark.long
def test_one_frequency_in_contact_leaves_stiffness_and_mass_to_the_noise_of_the_position():
    """K - M w^2 is all that one frequency tells; what the position's noise tells beyond that is no mass."""
    x = 6e-3 * np.sin(2 * np.pi * 2 * TIME) - 2e-3
    v, a = np.gradient(x, TIME), -((2 * np.pi * 2) ** 2) * (x + 2e-3)
    force = np.where(x > 0, np.maximum(2500 * x + 12 * v, 0), 0.0) + 1.0 * a
    log = record(TIME, x + RNG(1).normal(0, 2e-6, len(TIME)), force + RNG(2).normal(0, 0.02, len(TIME)))
    found = identify(log)
    k, m = (found.parameters[name] for name in ("K", "M"))
    assert k.verdict is not Verdict.IDENTIFIED or k.ci95[0] < 2500 < k.ci95[1]
    assert m.verdict is not Verdict.IDENTIFIED


@pytest.mark.long
def test_a_damping_below_zero_refuses_all_that_is_seen_in_time():
    """A relaxing surface under a tool compensated with the wrong sign: its branch was called known, 19 % off."""
    from foreign.logs import Cell, make_log
    from foreign.scoring import record_of

    log = make_log(Cell("standard-linear", "payload"), 1100)
    found = identify(record_of(log), **log.options)
    assert found.parameters["B"].verdict is Verdict.REJECTED
    branch = [found.parameters[name].verdict for name in ("K1", "tau")]
    assert Verdict.IDENTIFIED not in branch
    assert "negative-stiffness" not in found.codes  # it is the damping that is below zero
