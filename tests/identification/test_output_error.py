from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identification.estimators.output_error import CURVED, LINEAR, output_error, simulation_error
from palpate.identification.estimators.simulation import COLUMNS, drive_of, simulated

SILVERBOX = Path(__file__).parents[3] / "shared/data/silverbox/schroeder_80mV.csv"
N = 3000
TIME = np.arange(N) / 1000
TRUTH = {"M": 0.5, "B": 12.0, "K": 4000.0, "K2": 2e5, "K3": 3e8, "offset": 1.5}
START = {"M": 0.4, "B": 20.0, "K": 4500.0}


def shaking(seed=1, at=TIME):
    """A sum of sines of 1 to 40 Hz [N] at any times."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * np.geomspace(1, 40, 25)
    phase = rng.uniform(0, 2 * np.pi, 25)
    return 2.0 * np.sin(omega * at[:, None] + phase).sum(1) / 5


def moved(parameters, force=None):
    force = shaking() if force is None else force
    return simulated(drive_of(force, 1e-3, 120.0), parameters)[0]


def test_the_simulation_is_that_of_another_integrator():
    from scipy.integrate import solve_ivp

    p = TRUTH | {"x0": 1e-3, "v0": -0.05}

    def rates(t, state):
        x, v = state
        spring = p["K"] * x + p["K2"] * x**2 + p["K3"] * x**3
        force = shaking(at=np.array([t]))[0]
        return v, (force - p["offset"] - p["B"] * v - spring) / p["M"]

    other = solve_ivp(
        rates, (0, TIME[-1]), (1e-3, -0.05), t_eval=TIME, rtol=1e-7, atol=1e-11, method="DOP853"
    )
    # The force between its readings: sines of up to 40 Hz read at 1 kHz come back to 1e-4 of the motion.
    assert np.abs(moved(p) - other.y[0]).max() < 2e-4 * other.y[0].std()


@pytest.mark.parametrize("name", COLUMNS)
def test_sensitivities_are_what_finite_differences_give(name):
    p = TRUTH | {"lag": 1e-3, "x0": 1e-3, "v0": 0.02}
    drive = drive_of(shaking(), 1e-3, 120.0)
    step = 1e-4 * (abs(p[name]) or 1.0)
    up, down = (simulated(drive, p | {name: p[name] + sign * step})[0] for sign in (1, -1))
    slope = simulated(drive, p)[1][:, COLUMNS.index(name)]
    difference = (up - down) / (2 * step)
    share = 0.02 if name == "lag" else 1e-4  # the force between two half steps is a straight line
    assert np.abs(slope - difference).max() < share * np.abs(difference).max()


def test_a_curved_spring_under_noise_of_the_position():
    position = moved(TRUTH)
    noise = 0.1 * position.std()
    inside, theta = np.zeros(len(CURVED)), []
    for seed in range(40):
        noisy = position + np.random.default_rng(seed).normal(0, noise, N)
        found = output_error(TIME, shaking(), noisy, START, free=CURVED)
        truth = np.array([TRUTH[name] for name in found.names])
        inside += np.abs(found.theta - truth) < 1.96 * found.std
        theta.append(found.theta)
    theta = np.array(theta)
    assert np.all(np.abs(theta.mean(0) - truth) < 4 * theta.std(0) / np.sqrt(40))
    assert np.all(inside >= 33), inside  # 38 expected, four deviations less
    assert theta.std(0)[CURVED.index("K3")] < 0.05 * TRUTH["K3"]


def test_a_lag_of_the_force_is_found():
    late = shaking(at=TIME - 0.003)
    found = output_error(TIME, late, moved(TRUTH), START, free=(*CURVED, "lag"))
    values = dict(zip(found.names, found.theta, strict=True))
    assert values["lag"] == pytest.approx(0.003, abs=1e-5)
    assert values["M"] == pytest.approx(0.5, rel=1e-3)


def test_what_is_not_free_stays_as_given():
    held = {name: TRUTH[name] for name in ("K2", "K3")}
    found = output_error(TIME, shaking(), moved(TRUTH), START | held, free=LINEAR)
    assert found.theta == pytest.approx([TRUTH[name] for name in LINEAR], rel=1e-6)


def test_a_model_is_tried_on_motion_it_has_not_seen():
    force = shaking(seed=2)
    position = moved(TRUTH, force)
    error, course = simulation_error(TIME, force, position, TRUTH)
    assert error < 1e-6 * position.std()
    assert course == pytest.approx(position, abs=1e-6 * position.std())
    wrong, _ = simulation_error(TIME, force, position, TRUTH | {"K": 4400.0})
    assert wrong > 0.05 * position.std()


@pytest.mark.long
@pytest.mark.skipif(not SILVERBOX.exists(), reason="the measured data are not here")
def test_silverbox_simulates_what_was_not_fitted():
    _, force, position = np.genfromtxt(SILVERBOX, delimiter=",", skip_header=1).T
    time = np.arange(len(force)) * 2**14 / 1e7
    fitted, fresh = slice(0, 16384), slice(98304, 131072)
    start = {"M": 6e-6, "B": 3e-4, "K": 1.1}
    found = output_error(time[fitted], force[fitted], position[fitted], start, free=CURVED)
    assert all(word == "identified" for word in found.verdicts().values())
    values = dict(zip(found.names, found.theta, strict=True))
    error, _ = simulation_error(time[fresh], force[fresh], position[fresh], values)
    assert error < 0.01 * position[fresh].std()


@pytest.mark.parametrize(
    ("start", "free", "words"),
    [
        ({"M": 0.4, "B": 20.0}, LINEAR, "start lacks K"),
        (START | {"M": 0.0}, LINEAR, "M must be above 0"),
        (START | {"mass": 1.0}, LINEAR, "no parameter of the oscillator: mass"),
        (START | {"M": 1e-9}, LINEAR, "fastest mode"),
        (START | {"K": -3e4, "B": 0.0}, LINEAR, "runs away"),
    ],
)
def test_wrong_starts(start, free, words):
    with pytest.raises(InputError, match=words) as caught:
        output_error(TIME, shaking(), moved(TRUTH), start, free=free)
    assert "\n" not in str(caught.value)


def test_too_few_readings():
    with pytest.raises(InputError, match="too few"):
        output_error(TIME[:50], shaking()[:50], moved(TRUTH)[:50], START)
