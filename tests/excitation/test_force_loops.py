"""The robot as an excitation sees it: limits by hand, power of the friction, stability, and the bench's arm."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.bench import build, load, with_values
from palpate.excitation import HybridLoop, KnownBandwidth, LinearSurface
from palpate.excitation.force_loops import contact_force
from palpate.excitation.multisine import low_peak

RUBBER = LinearSurface(34500.0, 480.0, 0.05)
OMEGA = 2 * np.pi * np.array([0.5, 5.0, 40.0])
SLOW = np.full((1, 1), 1e-3)


def test_without_a_tip_only_the_way_of_the_measured_force_is_left():
    loop = HybridLoop(
        tip_mass=0.0, damping=0.0, stiffness=0.0, friction=0.0, gain=1.0, integral=0.0, delay=0.01
    )
    measured = loop.low_pass.at(OMEGA) * np.exp(-0.01j * OMEGA)
    found = loop.transfer(OMEGA, RUBBER.impedance(OMEGA)[None], SLOW)[0]
    assert found == pytest.approx(2 / (1 + measured))


def test_an_integral_brings_a_slow_force_through_whole():
    slow = np.array([1e-4])
    found = HybridLoop(friction=0.0).transfer(slow, RUBBER.impedance(slow)[None], SLOW)
    assert np.abs(found).item() == pytest.approx(1.0, abs=1e-3)


def test_the_damper_for_friction_takes_its_power():
    """Of a Gaussian speed v, friction takes F |v| on average; the damper must take b v^2."""
    v = 0.02 * np.random.default_rng(0).standard_normal(200_000)
    stiff = HybridLoop(tip_mass=0, damping=0, stiffness=0, friction=3.0, presliding=1e12, gain=0, integral=0)
    Z = RUBBER.impedance(OMEGA)[None]
    tip = (1 / stiff.transfer(OMEGA, Z, np.full((1, 1), v.std())) - 1) * Z  # f_d/f = 1 + R/Z
    damper = np.real(tip / (1j * OMEGA))[0]
    assert damper * np.mean(v**2) == pytest.approx(np.full(3, 3.0 * np.mean(np.abs(v))), rel=0.01)


def test_friction_holds_a_weak_force_back_more_than_a_strong_one():
    amplitudes = np.array([1.0, 1.0, 1.0])
    Z = RUBBER.impedance(OMEGA)[None]
    weak = np.abs(contact_force(HybridLoop(), OMEGA, Z, amplitudes))
    strong = np.abs(contact_force(HybridLoop(), OMEGA, Z, 5 * amplitudes)) / 5
    free = np.abs(contact_force(HybridLoop(friction=0.0), OMEGA, Z, amplitudes))
    assert weak[0, 1] < strong[0, 1] < free[0, 1]


def test_the_bandwidth_of_a_robot_is_where_071_is_left():
    at = 2 * np.pi * np.array([12.0])
    found = KnownBandwidth(12.0).transfer(at, RUBBER.impedance(at)[None], SLOW)
    assert np.abs(found).item() == pytest.approx(np.sqrt(0.5))
    assert KnownBandwidth(12.0).stable(RUBBER)


@pytest.mark.parametrize(
    ("gain", "stable"), [(0.0, True), (1.0, True), (2.0, True), (4.0, False), (40.0, False)]
)
def test_stability_on_rubber(gain, stable):
    """At a gain of 4 the bench's own loop does not come to rest on rubber either: 0.6 N of noise, 0.08 N at 1."""
    assert HybridLoop(gain=gain).stable(RUBBER) is stable
    assert HybridLoop(gain=gain, integral=0.0).stable(RUBBER) is stable


@pytest.mark.parametrize("name", ["foam-hybrid", "rubber-hybrid"])
def test_it_foretells_what_the_arm_on_the_bench_lets_through(name):
    experiment = load(name)
    harmonics = np.arange(1, 81, 4)
    frequencies = 0.5 * harmonics
    amplitudes = np.full(20, 1.2)
    phases = low_peak(amplitudes, harmonics)
    waves = {"frequencies": frequencies, "amplitudes": amplitudes, "phases": phases}
    change = {"force.first": 15.0, "run.press": 5.0}
    change |= {f"force.multisine.{key}": tuple(values.tolist()) for key, values in waves.items()}
    run = build(with_values(experiment, change)).run(60.0, seed=1, press=5.0)
    force = run["force"][np.flatnonzero(run["phase"] == 1.0)[1000:5000]]

    own = experiment.controller
    omega = 2 * np.pi * frequencies
    s = experiment.surface
    Z = LinearSurface(s.stiffness, s.damping, s.mass).impedance(omega)[None]
    loop = HybridLoop(gain=own.kf, integral=1000 * own.ki)
    foretold = contact_force(loop, omega, Z, amplitudes)
    # Friction is not linear; a tenth is what its linearisation was fitted to, on other amplitudes.
    assert np.sqrt((np.abs(foretold) ** 2).sum() / 2) == pytest.approx(force.std(), rel=0.15)
