"""The direction of the force, and what not knowing it well does to K."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.contact_frame.load import Normal, main_axis, scale_std

TRIALS = 300


def pressing(rng, normal, noise, colour=0.0, n=2000):
    """A force along a normal over a bias, with noise on each axis; `colour` is how far it remembers itself."""
    strength = 10 * np.clip(np.sin(np.linspace(0, 12, n)), 0, None)
    white = rng.normal(0, noise * np.sqrt(1 - colour**2), (n, 3))
    out = np.empty_like(white)
    last = rng.normal(0, noise, 3)
    for k in range(n):
        last = colour * last + white[k]
        out[k] = last
    return np.outer(strength, normal) + np.array([3.0, -2.0, 5.0]) + out


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_the_angle_is_as_far_off_as_it_says(colour):
    """The rms of the error in units of the stated std, over both axes: 1 within the scatter of 300 trials."""
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(TRIALS if not colour else 60):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        axis, std = main_axis(pressing(rng, normal, 0.5, colour, 1000))
        axis = axis if axis @ normal > 0 else -axis
        ratios += list((axis - (axis @ normal) * normal) / std)
    rms = np.sqrt(np.sum(np.square(ratios)) / (2 * len(ratios) / 3))
    assert rms == pytest.approx(1.0, abs=0.12 if not colour else 0.25)


def test_a_bias_has_no_say():
    rng = np.random.default_rng(1)
    force = pressing(rng, np.array([0.0, 0.6, 0.8]), 0.0)
    axis, std = main_axis(force)
    assert abs(axis @ [0.0, 0.6, 0.8]) == pytest.approx(1.0, abs=1e-12)
    assert std < 1e-9


def test_what_a_wrong_normal_does_to_the_stiffness():
    """The first-order formula against K worked out along normals that are off by small angles."""
    rng = np.random.default_rng(2)
    normal, slip = np.array([0.0, 0.0, 1.0]), np.array([0.4, -0.2, 0.0])
    depth = np.linspace(0, 1e-3, 500)
    place, force = np.outer(depth, normal + slip), np.outer(5000 * depth, normal)
    std = np.radians(1.0)
    stiffness = []
    for _ in range(4000):
        off = normal + np.r_[rng.normal(0, std, 2), 0.0]
        off /= np.linalg.norm(off)
        stiffness.append(np.polyfit(place @ off, force @ off, 1)[0])
    assert np.std(stiffness) / 5000 == pytest.approx(
        scale_std(Normal(normal, std, True), force, place), rel=0.05
    )


def test_noise_has_no_direction():
    rng = np.random.default_rng(3)
    for _ in range(20):
        axis, std = main_axis(rng.normal(0, 1, (2000, 3)))
        normal = Normal(axis, std, True)
        assert not normal.shown
        assert scale_std(normal, rng.normal(size=(50, 3)), rng.normal(size=(50, 3))) > 0.9
