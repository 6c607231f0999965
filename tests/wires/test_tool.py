"""A tool that was weighed, against what an arm's sensor shows of it at rest."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.contact_frame import Payload
from palpate.wires import ArmReading, AtRest
from palpate.wires.at_rest import tool_notes

WEIGHT = (0.0, 0.0, 9.80665)


def payload(**changed):
    known = {
        "mass": 1.0, "mass_std": 0.01, "weight": WEIGHT, "weight_std": 0.05, "bias": (1.0, 0.5, 0.3), "bias_std": 0.02,
        "noise": 0.1, "wrench_frame": "tool", "inertia": 1.0, "inertia_std": 0.02,
    }  # fmt: skip
    return Payload(**{**known, **changed})


def at_rest(force):
    """The tool points down: turned by half a turn about x."""
    sense = ArmReading(0.0, 0.0, tuple(force), (0.0,) * 3, (0.4, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0))
    return AtRest(np.zeros(3), np.array(force), 0.1, 0.0, 0.1, 500.0, sense, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tool_as_it_was_weighed(sign):
    """Its bias turned with it, and its weight; a wire may show the other sign."""
    shown = at_rest(sign * np.array([1.0, -0.5, -0.3 + WEIGHT[2]]))
    assert tool_notes(payload(), shown) == ["the sensor shows the tool as it was weighed"]


def test_another_tool_and_a_compensation_of_the_wrong_sign_are_named():
    unlike, mistaken = tool_notes(payload(inertia=-0.3), at_rest((0.0, 0.0, 0.0)))
    assert "the sensor was zeroed since" in unlike
    assert "follows the acceleration as a mass of -0.3 kg" in mistaken
    assert "wrong sign" in mistaken
