"""The bench a few ticks at a time: the same numbers as a run, and sliders that change the surface, not the force."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from live.conftest import near
from palpate.bench import build
from palpate.errors import InputError
from palpate.live.simulation import WatchedSimulation
from palpate.live.view import AT, STRIDE


def pressed(simulation, seconds):
    found = [simulation.advance(0.01) for _ in range(round(seconds / 0.01))]
    return np.concatenate(found)


def test_its_rows_are_those_of_a_run(simulation):
    shown = pressed(simulation, 3.0)
    record = build(near()).run(20.0, seed=1)
    at = np.round(shown[:, AT["t"]] * 1000).astype(int)
    for name, column in (("force", "force"), ("q1", "q1"), ("q2", "q2"), ("desired", "force_desired")):
        np.testing.assert_array_equal(shown[:, AT[name]], record[column][at])
    np.testing.assert_array_equal(shown[:, AT["depth"]], 1e3 * record["penetration"][at])
    np.testing.assert_allclose(shown[:, AT["wall"]], 0.465, rtol=0, atol=1e-15)
    assert np.allclose(np.diff(shown[:, 0]), STRIDE)


def test_of_the_measured_force_both_ends_of_each_stride_are_shown(simulation):
    shown = pressed(simulation, 1.0)
    record = build(near()).run(20.0, seed=1)
    last = np.round(shown[:, 0] * 1000).astype(int)
    strides = record["force_measured"][last[:, None] - np.arange(5)]
    highest = np.isclose(shown[:, AT["measured"]], strides.max(axis=1), rtol=0, atol=0)
    lowest = np.isclose(shown[:, AT["measured"]], strides.min(axis=1), rtol=0, atol=0)
    assert (highest | lowest).all()
    assert 0.4 < highest.mean() < 0.6


def test_it_begins_shortly_before_the_touch_and_the_same_again(simulation):
    first = pressed(simulation, 2.0)
    touch = first[np.argmax(first[:, AT["depth"]] > 0), 0] - first[0, 0]
    assert 1.4 < touch <= 1.5 + STRIDE
    simulation.reset()
    np.testing.assert_array_equal(pressed(simulation, 2.0), first)
    simulation.reset(seed=2)
    assert not np.array_equal(pressed(simulation, 2.0), first)


@pytest.mark.parametrize("surface", ["foam-hybrid", "foam-viscoelastic"])
def test_a_surface_that_changes_bears_the_force_of_that_moment(surface):
    simulation = WatchedSimulation(near(surface), seed=1)
    before = pressed(simulation, 4.0)
    simulation.set("surface.stiffness", 4.0 * simulation.state.values["surface.stiffness"])
    after = pressed(simulation, 0.05)
    # Without the new rest length the force would be four times as large at once.
    assert abs(after[0, AT["force"]] - before[-1, AT["force"]]) < 0.1 * before[-1, AT["force"]]


def test_the_estimate_begins_again_and_finds_the_new_surface(simulation):
    found = pressed(simulation, 4.0)[-1]
    assert abs(found[AT["K"]] - 5200) < 1.5 * found[AT["K_half"]]
    simulation.set("surface.stiffness", 15000.0)
    at_once = pressed(simulation, 0.01)[-1]
    assert at_once[AT["K_true"]] == 15000.0
    assert np.isnan(at_once[AT["K"]])  # nothing is known of it yet
    simulation.set("force.first", 12.0)  # a step, from which there is something to learn
    found = pressed(simulation, 6.0)[-1]
    assert abs(found[AT["K"]] - 15000) < 1.5 * found[AT["K_half"]]
    assert found[AT["desired"]] == 12.0
    assert abs(found[AT["force"]] - 12.0) < 1.0  # friction of the joints makes the last newton slow


def test_a_gain_too_large_loses_contact_and_says_so(simulation):
    pressed(simulation, 3.0)
    simulation.set("controller.kf", 20.0)
    simulation.set("surface.stiffness", 1e5)
    pressed(simulation, 20.0)
    assert simulation.state.ended.startswith("lost contact: ")
    assert "contact lost" in [one.text for one in simulation.state.events]
    assert not len(simulation.advance(0.01))
    simulation.reset()
    assert simulation.state.ended == ""
    assert len(simulation.advance(0.01))


def test_a_force_out_of_the_motors_reach_is_said(simulation):
    pressed(simulation, 3.0)
    assert simulation.state.warning == ""
    simulation.set("force.first", 40.0)
    pressed(simulation, 5.0)
    assert simulation.state.warning.startswith("motor 2 ")


@pytest.mark.parametrize(
    ("key", "value"),
    [("surface.mass", 1.0), ("surface.stiffness", 1e12), ("force.first", float("nan")), ("", 1.0)],
)
def test_sliders_take_nothing_else(simulation, key, value):
    before = simulation.experiment
    with pytest.raises(InputError, match=r"slider|must be from"):
        simulation.set(key, value)
    assert simulation.experiment is before


@pytest.mark.long
def test_the_first_change_of_a_surface_waits_for_no_import(root):
    """In a process that has loaded nothing else; a slider's picture would be late by a third of a second."""
    code = (
        f"import sys; sys.path[:0] = [{str(root / 'benchmarks' / 'live')!r}, {str(root / 'tests')!r}]\n"
        "from live.conftest import near\n"
        "from palpate.live.player import load_late_imports\n"
        "from palpate.live.simulation import WatchedSimulation\n"
        "shown = WatchedSimulation(near(), seed=1)\n"
        "load_late_imports()\n"
        "for _ in range(300): shown.advance(0.01)\n"
        "before = set(sys.modules)\n"
        "shown.set('surface.stiffness', 7000.0)\n"
        "print(sorted(set(sys.modules) - before))\n"
    )
    folder = Path(__file__).parents[1]
    ran = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
