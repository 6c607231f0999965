"""The judge's own physics: what it calls true is true, and a seed makes one log."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foreign.bound import columns_of, half_widths
from foreign.logs import CELLS, Cell, make_log
from foreign.motions import tracked
from foreign.scoring import WORKING_POINT, judged, score
from foreign.surfaces import SURFACES, Surface, random_surface, touch
from foreign.truth import Dense, dynamic_stiffness, octave_stiffness, press_stiffness

physics = pytest.mark.long
"""Of the judge's own physics, which takes seconds to compile: nothing of the package."""
SLICE = [cell for i, cell in enumerate(CELLS) if i % 69 == 5]


def pressed(surface, depth, dt, seconds=2.0, below=0.6):
    """Pressed with a sine that leaves the surface, from rest in free motion."""
    t = np.arange(int(seconds / dt)) * dt
    command = depth * (0.5 * (1 - np.cos(2 * np.pi * 1.5 * t)) * (1 + below) - below)
    x, v, a = tracked(command, 25.0, dt)
    return x, v, a, touch(surface, x, v, a, dt)


def drawn(name, seed=3):
    surface = random_surface(name, np.random.default_rng(seed))
    return surface, surface.depth_of(8.0)


def test_the_generator_and_the_truth_know_nothing_of_the_package():
    for name in ("surfaces", "motions", "recording", "logs", "truth", "bound"):
        text = Path(sys.modules[f"foreign.{name}"].__file__).read_text(encoding="utf-8")
        assert "palpate" not in text, name


@physics
@pytest.mark.parametrize("name", SURFACES)
def test_out_of_contact_there_is_no_force_and_in_contact_none_pulls(name):
    surface, depth = drawn(name)
    x, _, _, touched = pressed(surface, depth, 1e-4)
    assert touched.contact.any()
    assert not touched.contact.all()
    flying = ~touched.contact
    if not surface["M"]:  # the blow of a mass lasts 2 ms, also where the probe bounces off sooner
        assert np.all(touched.force[flying] == 0)
    assert np.all(touched.force >= 0)
    assert np.all(x <= touched.depth + 1e-12)


@physics
@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_gives_back_no_more_than_it_took(name):
    surface, depth = drawn(name)
    _, v, _, touched = pressed(surface, depth, 5e-5)
    work = np.cumsum(touched.force * v) * 5e-5
    assert work[-1] >= 0
    # A softening surface stores energy on the way; none of it is there before it was put in.
    assert work.min() >= -1e-3 * work.max()


@physics
@pytest.mark.parametrize("name", SURFACES)
def test_integrated_twice_as_fine_the_force_is_the_same(name):
    surface, depth = drawn(name)
    coarse = pressed(surface, depth, 1.25e-4)[3].force
    fine = pressed(surface, depth, 6.25e-5)[3].force[::2][: len(coarse)]
    apart = np.abs(coarse - fine)
    # A jump at the touch may fall one step to the left or right; a bouncing mass does so more than once.
    assert np.percentile(apart, 97) < (0.02 if surface["M"] else 2e-3) * fine.max()


@physics
@pytest.mark.parametrize("name", ["kelvin-voigt", "mass"])
def test_regression_on_the_force_without_noise_returns_the_parameters(name):
    surface, depth = drawn(name)
    x, v, a, touched = pressed(surface, depth, 1e-4)
    inside = touched.contact & (touched.force > 0.1 * touched.force.max())
    settled = inside & (np.convolve(inside, np.ones(61), "same") > 60)  # 3 ms from any blow
    found = np.linalg.lstsq(np.column_stack([x, v, a])[settled], touched.force[settled], rcond=None)[0]
    assert found[:2] == pytest.approx([surface["K"], surface["B"]], rel=1e-6)
    assert found[2] == pytest.approx(surface["M"], rel=1e-6, abs=1e-9)


@physics
@pytest.mark.parametrize("name", ["kelvin-voigt", "mass", "standard-linear", "arms"])
def test_a_small_sine_has_the_dynamic_stiffness_of_the_formula(name):
    surface, depth = drawn(name)
    formula = dynamic_stiffness(surface, 3.0, depth, 0.1 * depth)
    nearly = surface.scaled(K3=1e-9 * surface["K"] / depth**2)
    assert not nearly.linear
    measured = dynamic_stiffness(replace(nearly, arms=surface.arms), 3.0, depth, 0.1 * depth)
    # Eight time constants leave 3e-4 of an arm, and the ramp to the depth as much in the first line of the period.
    assert measured == pytest.approx(formula, rel=2e-3)


@physics
def test_the_octave_and_the_press_of_a_spring_are_its_stiffness():
    log = make_log(Cell("kelvin-voigt", "clean", "multisine"), 4)
    stiffness = log.plan.surface["K"]
    assert octave_stiffness(log.dense, 1.0) == pytest.approx((stiffness, stiffness), rel=0.01)
    soft = replace(log.dense, force=np.where(log.dense.contact, stiffness * log.dense.depth, 0.0))
    assert press_stiffness(log.plan.surface, soft) == pytest.approx((stiffness, stiffness), rel=1e-9)


@physics
def test_what_relaxes_at_rest_is_no_part_of_the_slope_of_a_press():
    """Two ramps with a rest between them, in which the force falls by 6 % and stays in the window."""
    advance = np.linspace(0.0, 1.0, 200)
    depth = 1e-3 * np.concatenate([advance, np.ones(400), 1 + advance])
    force = 1e3 * depth - np.interp(np.arange(800), [200, 600], [0.0, 0.06])
    press = Dense(1e-3, depth, force, np.ones(800, bool))
    told = press_stiffness(Surface("relaxing", {"K": 1e3}), press, 1.0)
    assert told == pytest.approx((1e3, 1e3), rel=1e-6)


@physics
@pytest.mark.parametrize("cell", SLICE, ids=str)
def test_a_seed_makes_one_log(cell):
    log, again = make_log(cell, 11), make_log(cell, 11)
    for one, other in ((log.time, again.time), (log.position, again.position), (log.force, again.force)):
        assert np.array_equal(one, other)
        assert np.isfinite(one).all()
    assert log.truth == again.truth
    assert log.dense.contact.any()


@physics
def test_a_knowing_estimator_scatters_as_the_bound_says():
    log = make_log(Cell("kelvin-voigt", "lag-told", "multisine"), 2)
    columns, _ = columns_of(log, ["K", "B"])
    recording, rng = log.plan.recording, np.random.default_rng(1)
    truth = np.array([log.truth["K"][0], log.truth["B"][0], 0.0])
    noise = np.hypot(recording.force_noise, truth[0] * recording.position_noise)
    solve = np.linalg.pinv(columns)
    found = np.array([solve @ (columns @ truth + noise * rng.normal(size=len(columns))) for _ in range(200)])
    bound = half_widths(log)
    # The deviation of 200 draws is known to 5 %.
    assert 1.96 * found[:, :2].std(0) == pytest.approx([bound["K"], bound["B"]], rel=0.2)


def test_confidently_wrong_is_far_off_or_many_half_widths():
    assert not judged("K", 100, (95, 105), (104, 104)).wrong
    assert judged("K", 100, (60, 140), (130, 130)).holds
    assert judged("K", 140, (100, 180), (100, 100)).wrong
    assert judged("K", 104, (103, 105), (100, 100)).wrong
    assert not judged("K", 101, (100.9, 101.1), (100, 100)).wrong
    assert judged("M", 0.1, (0.09, 0.11), (0.0, 0.0)).wrong
    assert judged("K", 100, (95, 105), (90, 200), defined=False).holds


@physics
@pytest.mark.parametrize(
    "cell",
    [
        "friction/held-steady",  # friction that holds as a spring: the presses differ
        "kelvin-voigt/payload",  # air beside a tool's inertia
        "kelvin-voigt/encoder",  # a motion of a few counts
        # a force that drifts along a bent line, and a relaxation time to be found beside it
        "standard-linear/drift",
        "stiffening/jitter",  # a lag that nobody knows, behind a stiffness that goes with depth
        # octaves in which the acceleration is noise and the position is not
        "mass/high-rate",
    ],
)
def test_no_answer_is_wrong_on_these_logs_again(cell):
    found = score(Cell(*cell.split("/")), 906)
    assert found.outcome == "answered"
    assert found.working
    assert [answer.name for answer in found.answers if answer.wrong] == []


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), [("tissue/payload", 990), ("plastic/saturation", 970)])
def test_a_steady_unloading_after_loadings_in_steps_is_no_press_at_constant_speed(name, seed):
    """The slope of the unloading was given for that of the loadings."""
    point = next(a for a in score(Cell(*name.split("/")), seed).answers if a.name == WORKING_POINT)
    assert point.holds


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), [("mass/drift", 3000), ("mass/saturation", 3001)])
def test_a_lag_that_nobody_gave_is_found_in_a_narrow_valley_of_the_likelihood(name, seed):
    """The likeliest lag of the grid was another, and K came out negative."""
    found = {a.name: a for a in score(Cell(*name.split("/")), seed).answers}
    own = found["K"]
    assert abs(own.value - own.truth[0]) < 1.5 * own.half  # 3 of 1000 true intervals are farther off
    assert own.half < 0.01 * own.value


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "seed", "parameter"),
    [
        ("mass/spikes", 971, "M"),  # the answer in contact was charged with the approach's error
        ("mass/ms-stamps", 971, "M"),  # the slope of a tap has inertia in it
        ("mass/never-leaves", 970, "K"),  # a dither, of which the lowest octaves hold nothing
        ("kelvin-voigt/payload", 1206, "B"),  # a mass below zero had refused it
    ],
)
def test_a_parameter_that_the_log_shows_is_given(name, seed, parameter):
    found = {a.name: a for a in score(Cell(*name.split("/")), seed).answers}
    assert found[parameter].holds
