"""Compensation of dry friction (4.8), (4.13): what it gains, and what it costs."""

import numpy as np
import pytest

from palpate._vector import Vec3
from palpate.bench import Bench, build, load
from palpate.controllers import Hybrid
from palpate.friction import Coulomb

NONE, LEVEL = Vec3(0.0, 0.0, 0.0), Vec3(3.0, 0.25, 0.03)


def alike(value):
    return Vec3(value, value, value)


def pressed(level, blend, seed=0):
    """A run on foam, without integral, so that friction's share of the error is seen."""
    bench = build(load("foam-hybrid"))
    loop = bench.loop._replace(
        controller=Hybrid(alike(400.0), alike(80.0), alike(1.0), NONE),
        compensation=Coulomb(level, alike(blend)),
    )
    return Bench(loop, bench.q).run(60.0, seed, press=5.0).columns


def figures(columns):
    """Mean approach error [m], jitter of joint 1's torque [N m], force error [N], spread of the force [N]."""
    approach = (columns["t"] > 6.0) & (columns["phase"] == 0)
    late = columns["x_desired"][approach] - columns["x"][approach]
    jitter = np.diff(columns["torque1"][approach]).std()
    force = columns["force"][-1000:]
    return late.mean(), jitter, 20.0 - force.mean(), force.std()


@pytest.fixture(scope="module")
def plain():
    return figures(pressed(NONE, 0.002))


def test_without_it_friction_keeps_both_errors(plain):
    late, jitter, error, spread = plain
    assert late > 2e-3
    assert error > 1.0
    assert jitter < 0.1
    assert spread < 0.1


def test_a_blend_of_several_quanta_halves_the_force_error_quietly(plain):
    late, jitter, error, spread = figures(pressed(LEVEL, 0.05))
    assert late < 0.8 * plain[0]
    assert abs(error) < 0.5 * plain[2]
    assert jitter < 0.3
    assert spread < 0.1


def test_a_blend_below_one_quantum_is_a_hammer(plain):
    """Full Coulomb torque or none, with the encoder's last bit: it shakes the arm loose, and the force with it."""
    late, jitter, error, spread = figures(pressed(LEVEL, 0.002))
    assert late < 0.3 * plain[0]
    assert abs(error) < 0.3 * plain[2]
    assert jitter > 20 * plain[1]
    assert spread > 5 * plain[3]
