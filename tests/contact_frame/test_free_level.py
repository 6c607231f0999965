"""A force is flat over the position in free motion, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, shaken
from palpate.contact_frame.free_motion import free_level

TIME = np.arange(4000) / 1000
DEPTH = 1e-3 * np.sin(7 * TIME)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_press_from_the_air_whatever_the_signs_and_the_bias(sign, way):
    press = pressed(noise=0.05)
    level = free_level(sign * press["force"] + 7, way * press["position"])
    assert level == pytest.approx(7, abs=0.05)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_springs_of_all_kinds_have_an_air_side(power):
    assert free_level(1e5 * np.maximum(DEPTH, 0) ** power - 4, DEPTH) == pytest.approx(-4)


IN_CONTACT = {
    "cut out of a press": (pressed()["force"][700:1900], pressed()["position"][700:1900]),
    "shaken": (shaken()["force"], shaken()["position"]),
    "shaken and heavy": (shaken(m=3.0)["force"], shaken(m=3.0)["position"]),
    "hardening": (1e8 * (2e-3 + DEPTH) ** 2, DEPTH),
    "hardening more": (1e11 * (2e-3 + DEPTH) ** 3, DEPTH),
    "hardening to both sides": (DEPTH + 1e6 * DEPTH**3, DEPTH),
}


@pytest.mark.parametrize("kind", IN_CONTACT)
def test_a_probe_that_never_leaves_has_none(kind):
    assert free_level(*IN_CONTACT[kind]) is None


def test_neither_has_noise_nor_a_tool_that_does_not_move():
    rng = np.random.default_rng(0)
    assert free_level(rng.normal(size=4000), DEPTH) is None
    assert free_level(rng.normal(size=4000), 0 * DEPTH) is None
