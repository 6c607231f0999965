"""The laws inside kernels: the same numbers, bit for bit, and one set of sines and cosines."""

import numpy as np
import pytest

from palpate import robots
from palpate._jit import kernel
from palpate._vector import Vec3
from palpate.robots import Arm3

RNG = np.random.default_rng(5)


@kernel
def everything(arm, q, qd, qdd, w):
    geometry = (
        arm.pose(q),
        arm.jac(q),
        arm.jac_dot(q, qd),
        arm.jac_dot_qd(q, qd),
        arm.jac_inverse(q),
        arm.jac_det(q),
    )
    inverse = arm.inverse(arm.pose(q), 1.0), arm.inverse(arm.pose(q), -1.0), arm.beyond_reach(arm.pose(q))
    dynamics = (
        arm.inertia(q),
        arm.bias(q, qd),
        arm.newton_euler(q, qd, qdd, w),
        arm.accelerations(q, qd, qdd, w),
    )
    return geometry, inverse, dynamics, arm.kinetic_energy(q, qd), arm.model(q, qd), arm.with_rotors()


@pytest.mark.parametrize("state", RNG.uniform(-4.0, 4.0, (20, 4, 3)))
def test_compiled_is_plain_bit_for_bit(state):
    values = [Vec3(*row.tolist()) for row in state]
    assert everything(Arm3(), *values) == everything.plain(Arm3(), *values)


def test_model_takes_each_sine_and_cosine_once(monkeypatch):
    calls = []
    for name in ("sin", "cos"):
        real = getattr(robots.arm3, name)
        monkeypatch.setattr(robots.arm3, name, lambda a, real=real, name=name: calls.append(name) or real(a))
    Arm3().model(Vec3(0.1, 0.2, 0.3), Vec3(1.0, 2.0, 3.0))
    assert sorted(calls) == ["cos"] * 3 + ["sin"] * 3
