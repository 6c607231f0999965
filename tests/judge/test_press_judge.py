"""The judge of force laws: its simulators agree, its theta is enough, and it tells a safe law from others."""

import argparse
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks" / "judge"))
import press_judge
from press_draws import ACCURACY, ARMS, FULL_SPEED, Errors, draw_press
from press_judge import StopLaw, ceiling
from press_simulators import Axis, Engine, Sample

FORCE, FORCE_MAX, CAP = 20.0, 100.0, 1e5


class Proportional:
    """Speed in proportion to the error, up to a limit; no learning."""

    def __init__(self, limit, gain):
        self._limit, self._gain = limit, gain

    def update(self, force, position, missed=0.0):
        return min(self._limit, max(-self._limit, self._gain * (FORCE - force)))


class Eager(StopLaw):
    """Slow in free motion, at full speed as soon as a reading looks like a touch."""

    def update(self, force, position, missed=0.0):
        speed = super().update(force, position, missed)
        return FULL_SPEED if speed > 0 and force > 1.0 else speed


def judge(make, name, case, approach, runs=4, simulator="axis"):
    law = press_judge.Candidate(name, make, approach, "")
    draws = [draw_press(ARMS[name], case, FORCE, CAP, seed) for seed in range(runs)]
    made = press_judge.press_all(law, case, simulator, draws, argparse.Namespace(force=FORCE, rows=None))
    peaks = [run.peak for run in made]
    return {
        "above": sum(peak > FORCE_MAX for peak in peaks),
        "peak_N": max(peaks),
        "fast": sum(run.fast for run in made),
    }


@pytest.mark.parametrize("name", ARMS)
def test_a_proportional_law_at_full_speed_is_condemned_on_layers(name):
    row = judge(lambda: Proportional(FULL_SPEED, 1.0), name, "layers", FULL_SPEED)
    assert row["above"] > 0
    assert row["peak_N"] > FORCE_MAX


@pytest.mark.parametrize(
    ("simulator", "runs"),
    [
        ("axis", 1),
        pytest.param("axis", 60, marks=pytest.mark.long),
        pytest.param("mujoco", 10, marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("name", ARMS)
def test_a_law_well_below_the_ceiling_is_never_above(name, simulator, runs):
    """At half of the ceiling: its momentum is a margin, and a servo in MuJoCo used it up in one press of fifty."""
    speed = 0.5 * ceiling(ARMS[name], FORCE, FORCE_MAX, CAP)
    for case in press_judge.CASES:
        row = judge(lambda: StopLaw(speed, FORCE), name, case, speed, runs, simulator)
        assert row["above"] == 0, case
        assert row["fast"] == 0, case


@pytest.mark.parametrize("name", ARMS)
def test_a_ceiling_with_a_third_of_the_lag_is_condemned(name):
    speed = 3 * ceiling(ARMS[name], FORCE, FORCE_MAX, CAP)
    assert judge(lambda: StopLaw(speed, FORCE), name, "layers", 1.0)["above"] > 0


@pytest.mark.parametrize("case", ["cable", "pose", "drift"])
def test_a_law_that_takes_an_error_for_a_touch_is_too_fast(case):
    assert judge(lambda: Eager(0.02, FORCE), "ur5e", case, 0.02, runs=12)["fast"] > 0


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("layers", [((0.0, 3e4),), ((0.0, 500.0), (0.002, 1e5))])
def test_the_simulators_agree(name, layers):
    """A press with every error of the reading, without noise, at up to 30 mm/s.

    Steps of 0.1 and 0.2 ms are 6 um apart, motors of 1000 kg yield by 25 um to 100 N. The forces differ by less than
    2 % of the largest, sampled readings by what they change in 2 ms. A cable may let go one tick earlier.
    """
    draw = draw_press(ARMS[name], "clean", FORCE, CAP, 3)
    errors = Errors(0.5, 150.0, 0.002, 0.006, 0.008, 1.5, 0.06, 1.0, 1.0, 0.2)
    draw = draw._replace(distance=0.004, layers=layers, tau=0.002, noise=0.0, errors=errors)
    command, rows = 0.0, []
    simulators = Axis(draw), Engine(draw)
    for tick in range(int(0.6 * draw.arm.rate)):
        command += 0.03 / draw.arm.rate * (tick < 0.4 * draw.arm.rate)
        rows.append([simulator.tick(command, 1 / draw.arm.rate, 0.0) for simulator in simulators])
    first, second = (np.array([row[k] for row in rows]).T for k in (0, 1))
    largest = first[4].max()
    assert largest > 10.0
    for k, tolerance in enumerate((0.08 * largest, 1e-4, 1e-4, 0.02 * largest, 0.02 * largest)):
        np.testing.assert_allclose(first[k], second[k], rtol=0, atol=tolerance, err_msg=Sample._fields[k])
    assert np.count_nonzero(np.abs(first[5] - second[5]) > 0.02) <= 1


@pytest.mark.parametrize("name", ["ur5e", "fr3", "iiwa14"])
def test_theta_is_the_residual_travel(name):
    """After a ramp the tip moves on by less than theta allows, and by more than half of it: the sensor has the rest."""
    arm = ARMS[name]
    for seed in range(5):
        simulator = Axis(draw_press(arm, "clean", FORCE, CAP, seed)._replace(distance=1.0))
        speed, ramp = 0.1, np.minimum(np.arange(arm.rate) + 1, arm.rate / 2) / arm.rate
        tips = [simulator.tick(speed * place, 1 / arm.rate, 0.0).tip for place in ramp]
        travel = max(tips) - tips[int(arm.rate / 2) - 1]
        assert 0.5 * arm.theta < travel / speed < arm.theta


@given(
    seed=st.integers(0, 10**6), name=st.sampled_from(sorted(ARMS)), case=st.sampled_from(press_judge.CASES)
)
def test_draws_are_within_the_assumptions(seed, name, case):
    draw = draw_press(ARMS[name], case, FORCE, CAP, seed)
    depths, stiffness = np.array(draw.layers).T
    assert np.all(np.diff(depths) > 0)
    assert np.all(stiffness + draw.tau * stiffness / ARMS[name].theta <= 1.001 * CAP)
    simulator = Axis(draw)
    errors, place = draw.errors, draw.distance
    pulled = abs(errors.cable) * max(0.0, min(place, errors.slips) - errors.begin) * (place < errors.ends)
    assert pulled + 2 * errors.ripple + abs(errors.drift) * errors.settles + abs(errors.bias) <= ACCURACY
    assert simulator.tick(0.0, 0.002, 0.0).largest == 0.0


def test_the_lower_bound_is_reached_by_the_law_that_it_is_of():
    """dF/dt = K v with v = (F_max - F)/R, integrated in small steps, layer by layer."""
    draw = draw_press(ARMS["ur5e"], "layers", FORCE, CAP, 0)._replace(layers=((0.0, 500.0), (0.02, 1e5)))
    slope, step, depth, time, force = 1500.0, 1e-5, 0.0, 0.0, 0.0
    while force < FORCE:
        depth += step * (FORCE_MAX - force) / slope
        force = 500.0 * depth + (1e5 - 500.0) * max(0.0, depth - 0.02)
        time += step
    assert draw.least_time(FORCE, FORCE_MAX, slope) == pytest.approx(time, rel=1e-3)
    simple = draw._replace(layers=((0.0, 400.0),))
    assert simple.least_time(FORCE, FORCE_MAX, slope) == pytest.approx(slope / 400 * np.log(100 / 80))


def test_settling_is_from_when_the_force_stays():
    times = np.arange(6.0)
    forces = np.array([0.0, 20.0, 25.0, 20.5, 20.0, 19.5])
    assert press_judge.settling_time(times, forces, FORCE, 1.0) == 3.0
    assert press_judge.settling_time(times[:3], forces[:3], FORCE, 1.0) == np.inf
    assert press_judge.settling_time(times[:0], forces[:0], FORCE, 1.0) == np.inf
