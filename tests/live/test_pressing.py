"""An arm in space, a few ticks at a time: the numbers of a press; sliders change the surface, not the force."""

from functools import cache

import numpy as np
import pytest

from palpate.environments.models import KelvinVoigt
from palpate.errors import InputError
from palpate.live.pressing import DAMPING, FORCE, STIFFNESS, PressingArm
from palpate.live.view import AT
from palpate.press.prepare import PressSpec, prepare_press
from palpate.robots.serial.serial_arm import SerialArm


def pressed(arm, seconds):
    return np.concatenate([arm.advance(0.01) for _ in range(round(seconds / 0.01))])


@pytest.fixture(scope="module")
def arms():
    """One of torques and one of positions; each test begins again."""
    return cache(lambda name: PressingArm(name, seed=1))


@pytest.fixture(params=["fr3", pytest.param("ur5e", marks=pytest.mark.long)])
def arm(arms, request):
    own = arms(request.param)
    for slider in own.view.sliders:
        own.set(slider.key, slider.value)
    own.reset(seed=1)
    return own


def test_its_rows_are_those_of_a_press(arm):
    shown = pressed(arm, 1.2)
    name = "fr3" if arm.view.rate == 1000.0 else "ur5e"
    surface = KelvinVoigt(STIFFNESS, DAMPING, 0.0)
    record = prepare_press(PressSpec(name, FORCE, surface, seconds=0.6, probe=0.0, seed=1)).run()
    at = np.round(shown[:, AT["t"]] * arm.view.rate).astype(int)
    both = at < len(record)
    for column, own in (("force", "force"), ("q1", "q1"), ("q4", "q4")):
        np.testing.assert_array_equal(shown[both, AT[column]], record[own][at[both]])
    assert record["touching"][at[both]].max() == 1.0
    assert np.allclose(np.diff(shown[:, 0]), arm.view.stride)


@pytest.mark.long
def test_the_estimate_holds_the_truth_in_its_interval_and_begins_again(arm):
    last = pressed(arm, 3.0)[-1]
    for name in ("K", "B"):
        if np.isfinite(last[AT[name]]):
            assert abs(last[AT[name]] - last[AT[f"{name}_true"]]) < 1.5 * last[AT[f"{name}_half"]]
    # A press that has settled moves little: by torques its stiffness is known to a quarter; by positions the tip stands
    # still to an encoder's count, and none may be given.
    if np.isfinite(last[AT["K"]]) or arm.view.rate == 1000.0:
        assert abs(last[AT["K"]] - STIFFNESS) < 0.25 * STIFFNESS
    arm.set("surface.stiffness", 4 * STIFFNESS)
    at_once = pressed(arm, 0.02)[-1]
    assert at_once[AT["K_true"]] == 4 * STIFFNESS
    assert np.isnan(at_once[AT["K"]])  # nothing is known of it yet


def test_the_same_seed_is_the_same_again_and_a_gain_keeps_the_contact(arm):
    first = pressed(arm, 0.8)
    arm.reset()
    np.testing.assert_array_equal(pressed(arm, 0.8), first)
    pressed(arm, 1.0)
    arm.set("gain", 0.5)
    assert arm.state.values["gain"] == 0.5
    later = pressed(arm, 0.5)
    assert (later[:, AT["force"]] > 15.0).all()
    assert "contact lost" not in [one.text for one in arm.state.events]


def test_the_tip_of_the_drawn_joints_is_at_the_depth(arm):
    row = pressed(arm, 1.2)[-1]
    serial = SerialArm.named("fr3" if arm.view.rate == 1000.0 else "ur5e")
    tip = serial.joint_places(row[AT["q1"] : AT["q1"] + serial.joints])[-1]
    along = np.array(arm.view.scene.normal) @ tip
    assert along - row[AT["wall"]] == pytest.approx(1e-3 * row[AT["depth"]], abs=1e-6)


@pytest.mark.parametrize(("key", "value"), [("surface.mass", 1.0), ("force", 1e4), ("gain", float("nan"))])
def test_sliders_take_nothing_else(arm, key, value):
    with pytest.raises(InputError, match=r"slider|must be from"):
        arm.set(key, value)
