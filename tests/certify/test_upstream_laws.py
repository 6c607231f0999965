"""Laws of other projects: edges derived by hand, known edges, and a step-by-step simulation of each tick."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.certify.discrete_loop import growth, runs_away_in_free_motion, stable_ranges
from palpate.certify.upstream_laws import SOURCES, Admittance, CartesianImpedance, ForwardDynamics, Timing

TEST_PARAMS = Admittance(5.5, 214.1, 2.828427, 5.0, 0.005)
"""The x axis of test_params.yaml of ros2_controllers."""


def edge(loop):
    (ends,) = stable_ranges(loop)
    return ends[1]


@pytest.mark.parametrize(("delay", "expected"), [(0.010, 9.5e3), (0.024, 6.5e3), (0.036, 5.1e3)])
def test_the_admittance_of_test_params_is_stable_up_to_its_known_edge(delay, expected):
    assert edge(TEST_PARAMS.loop(Timing(500.0, delay))) == pytest.approx(expected, rel=0.005)


def test_the_force_controller_of_the_sample_is_stable_up_to_its_known_edge():
    sample = ForwardDynamics(0.5 * 0.05, 0.0)
    assert edge(sample.loop(Timing(500.0, 0.010, "velocity"))) == pytest.approx(23.9e3, rel=0.001)


@pytest.mark.parametrize("rate", [100.0, 125.0, 500.0])
@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_the_edge_of_an_admittance_with_joint_damping_alone(rate, interface):
    """z^2 - (2 - h d - h^2 K/M) z + 1 - h d for S = 0, no filter and no delay: by Jury, K < M (4 - 2 h d)/h^2."""
    M, d, h = 0.02, 8.0, 1.0 / rate
    law = Admittance(M, 0.0, 2.8, d, 1.0)
    expected = M * (4.0 - 2.0 * h * d) / h**2
    assert edge(law.loop(Timing(rate, 0.0, interface))) == pytest.approx(expected, rel=1e-6)


def test_the_edge_of_a_force_controller_without_delay():
    """z^2 - (1.9 - c) z + 0.9 with c = 0.9 * 0.02 p K h: by Jury, c < 3.8."""
    p, h = 0.5, 0.01
    law = ForwardDynamics(p, 0.0)
    assert edge(law.loop(Timing(1.0 / h, 0.0, "velocity"))) == pytest.approx(3.8 / (0.018 * p * h), rel=1e-6)


@pytest.mark.parametrize(("decay", "away"), [(1.9, False), (2.1, True)])
def test_the_explicit_step_runs_away_from_two(decay, away):
    law = Admittance(1.0, 1e-6, 0.0, decay * 100.0, 1.0)
    assert law.decay(100.0) == pytest.approx(decay)
    assert runs_away_in_free_motion(law.loop(Timing(100.0, 0.0))) == away


def admittance_tick(law, h):
    """The admittance rule as a person reads its source."""
    memory = {"filtered": 0.0, "velocity": 0.0, "position": 0.0}

    def tick(x, force):
        m = memory
        m["filtered"] = law.filter_coefficient * force + (1.0 - law.filter_coefficient) * m["filtered"]
        D = law.damping_ratio * 2.0 * np.sqrt(law.mass * law.stiffness)
        acceleration = (m["filtered"] - D * m["velocity"] - law.stiffness * x) / law.mass
        acceleration -= law.joint_damping * m["velocity"]
        m["velocity"] += acceleration * h
        m["position"] += m["velocity"] * h
        return m["position"], m["velocity"]

    return tick


def forward_dynamics_tick(law, _):
    """The compliance controller and its solver as a person reads their source."""
    memory = {"velocity": 0.0, "error": 0.0, "pose": 0.0}

    def tick(x, force):
        position = x
        for _ in range(law.iterations):
            error = law.stiffness * (0.0 - memory["pose"]) + force
            effort = law.p * error + law.d * (error - memory["error"]) / 0.02
            memory["error"] = error
            position = position + memory["velocity"] * 0.02
            memory["velocity"] = 0.9 * (memory["velocity"] + effort * 0.02)
            memory["pose"] = position
        return position, memory["velocity"]

    return tick


def simulate(tick, timing, stiffness, ticks):
    """Positions at the ticks, of an arm that follows late in continuous time, a millionth of a tick at a time."""
    h, late = 1.0 / timing.rate, timing.delay * timing.rate
    places, commands, x = [], [], 0.0
    for k in range(ticks):
        if timing.interface == "velocity" and k:
            ends = np.unique([k - 1.0, k, *(np.arange(k - 2, k + 1) + late % 1.0).clip(k - 1, k)])
            for begin, end in pairwise(ends):
                given = int(np.floor(0.5 * (begin + end) - late))
                x += (end - begin) * h * (commands[given][1] if 0 <= given < len(commands) else 0.0)
        elif timing.interface == "position":
            arrived = [j for j in range(len(commands)) if j + late < k - 1e-9]
            x = commands[arrived[-1]][0] if arrived else 0.0
        places.append(x)
        commands.append(tick(x, (1.0 if k == 0 else 0.0) - stiffness * x))
    return np.array(places)


CASES = [
    *[(Admittance(2.0, 300.0, 1.5, 4.0, 0.3), admittance_tick, interface) for interface in ("position", "velocity")],
    *[(ForwardDynamics(0.02, 0.001, 400.0, 3), forward_dynamics_tick, i) for i in ("position", "velocity")],
    *[(ForwardDynamics(0.3, 0.01), forward_dynamics_tick, i) for i in ("position", "velocity")],
]  # fmt: skip


@pytest.mark.parametrize(("law", "tick", "interface"), CASES)
@pytest.mark.parametrize("delay", [0.0, 0.008, 0.0117])
def test_a_tick_of_the_model_is_a_tick_of_the_source(law, tick, interface, delay):
    timing, stiffness = Timing(250.0, delay, interface), 700.0
    loop = law.loop(timing)
    (A,), (b,) = loop.matrices(np.array([stiffness])), loop.inputs(np.array([stiffness]))
    expected = simulate(tick(law, 1.0 / timing.rate), timing, stiffness, 60)
    state, places = np.zeros(len(A)), []
    for k in range(60):
        places.append(state[loop.pressed])
        state = A @ state + (b if k == 0 else 0.0)
    assert np.abs(expected).max() > 0.0
    assert places == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max())


def test_where_the_force_alone_is_late_the_arm_starts_at_its_last_command():
    law = ForwardDynamics(0.05, 0.0)
    late = Timing(500.0, 0.010, "position")
    assert not stable_ranges(law.loop(late)), "the positions of every sixth tick form a loop of their own"
    assert edge(law.loop(late._replace(sensor=True))) == pytest.approx(
        edge(ForwardDynamics(0.05 * 10.0, 0.0).loop(Timing(500.0, 0.010, "velocity"))), rel=0.2
    ), "0.02 s of the velocity in a tick of 0.002 s"


def test_an_impedance_is_stable_on_every_spring_without_delay_but_by_its_tick():
    """Half a tick late, and damped by d: stable while d > k h/2, on soft and on stiff springs."""
    stiff, h = 2000.0, 1e-3
    for damping, stable in ((0.9 * stiff * h / 2.0, False), (1.2 * stiff * h / 2.0, True)):
        loop = CartesianImpedance(stiff, damping, 3.0).loop(Timing(1.0 / h, 0.0))
        assert (growth(loop, np.array([1e2, 1e4])) < 1.0).tolist() == [stable] * 2


def test_an_operational_impedance_scales_with_the_mass():
    one = CartesianImpedance(100.0, 10.0, 3.0, operational=True).loop(Timing(1000.0, 0.001))
    same = CartesianImpedance(300.0, 30.0, 3.0).loop(Timing(1000.0, 0.001))
    assert np.array_equal(one.matrices(np.array([500.0])), same.matrices(np.array([500.0])))


def test_sources_are_named_by_a_commit():
    assert all(len(source.commit) == 40 and "/" in source.repository for source in SOURCES.values())
