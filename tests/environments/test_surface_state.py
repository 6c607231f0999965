"""Touching and parting: momentum, energy, and one common acceleration."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.environments import contact_force, impact

masses = st.floats(1e-3, 20.0)
speeds = st.floats(-2.0, 2.0)


@given(masses, st.one_of(st.just(0.0), masses), speeds, speeds)
def test_an_impact_keeps_momentum_and_loses_energy(tip, surface, v, rate):
    common, impulse = impact(tip, surface, v, rate)
    assert tip * (v - common) == pytest.approx(impulse, abs=1e-12)
    assert surface * (common - rate) == pytest.approx(impulse, abs=1e-12)
    lost = tip * v**2 + surface * rate**2 - (tip + surface) * common**2
    assert lost >= -1e-12
    assert impulse * (v - rate) >= 0.0  # a faster tip pushes


@given(st.floats(-50.0, 50.0), masses, masses, st.floats(-100.0, 100.0))
def test_tip_and_surface_accelerate_as_one(force, surface, tip, free):
    felt = contact_force(force, surface, tip, free)
    together = free - felt / tip
    assert felt == pytest.approx(force + surface * together, rel=1e-9, abs=1e-9)
    # The same sign as with a tip that nothing moves, but that the smallest number has no half.
    assert felt * (1.0 + surface / tip) == pytest.approx(force + surface * free, rel=1e-12, abs=1e-300)


def test_without_mass_the_force_is_the_surfaces_own():
    assert contact_force(12.0, 0.0, 3.0, 99.0) == 12.0
