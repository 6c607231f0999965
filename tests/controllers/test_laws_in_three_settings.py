"""Every controller means the same on `Vec3`, compiled, and on arrays; and serves arms with joints to spare."""

import numpy as np
import pytest

from palpate._vector import Mat3, Vec3
from palpate.controllers import (
    DecoupledHybrid,
    Hybrid,
    Impedance,
    ProportionalIntegral,
    ResolvedAcceleration,
)
from palpate.robots.arm3 import ArmModel
from palpate.signals.types import Sense, Task

#: From the shape of a task direction's gain to a controller.
MAKERS = {
    "hybrid": lambda m: Hybrid(m(400.0), m(80.0), m(1.0), m(0.003)),
    "resolved acceleration": lambda m: ResolvedAcceleration(m(400.0), m(80.0)),
    "proportional-integral": lambda m: ProportionalIntegral(m(400.0), m(80.0), m(0.25), m(5.0), 0.001),
    "decoupled": lambda m: DecoupledHybrid.corrected(m(400.0), m(80.0), m(3000.0), m(110.0), 5200.0),
    "decoupled, printed": lambda m: DecoupledHybrid.printed(m(400.0), m(80.0), m(3000.0), 5200.0),
    "impedance": lambda m: Impedance(m(5.0), m(600.0), m(2000.0), m(0.47)),
}
each = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS.keys())


def alike(value):
    return Vec3(value, value, value)


def inputs(m, n, seed):
    """Random senses, a task and a model, as arrays: m directions, n joints."""
    g = np.random.default_rng(seed)
    root = g.normal(size=(n, n))
    model = ArmModel(g.normal(size=(m, n)), g.normal(size=m), root @ root.T + n * np.eye(n), g.normal(size=n))
    sense = Sense(g.normal(size=n), g.normal(size=n), g.normal(size=m), g.normal(size=m), g.normal(size=m))
    s = np.zeros(m)
    s[0] = 1.0
    task = Task(g.normal(size=m), g.normal(size=m), g.normal(size=m), s * 20.0, s)
    return sense, task, model


def by_value(value):
    """Arrays of three and of three by three as `Vec3` and `Mat3`, inside a NamedTuple."""
    as_vector = [Vec3(*a) if a.ndim == 1 else Mat3(*(Vec3(*row) for row in a.tolist())) for a in value]
    return type(value)(*(Vec3(*map(float, a)) if isinstance(a, Vec3) else a for a in as_vector))


def walk(controller, sense, task, model, torques):
    """Several ticks under the same senses: the torque of each."""
    state = controller.start()
    for k in range(len(torques)):
        torque, state = controller.step(state, sense, task, model)
        torques[k, 0], torques[k, 1], torques[k, 2] = torque.x, torque.y, torque.z


def walk_on_arrays(controller, sense, task, model, ticks=5):
    state, torques = controller.start(), []
    for _ in range(ticks):
        torque, state = controller.step(state, sense, task, model)
        torques.append(torque)
    return np.array(torques)


@each
@pytest.mark.parametrize("seed", range(3))
def test_on_arrays_it_means_the_same(make, seed):
    arrays = inputs(3, 3, seed)
    values = [by_value(v) for v in arrays]
    plain = np.empty((5, 3))
    walk(make(alike), *values, plain)
    on_arrays = walk_on_arrays(make(lambda v: np.full(3, v)), *arrays)
    assert on_arrays == pytest.approx(plain, rel=1e-9)


@pytest.mark.parametrize("name", ["resolved acceleration", "decoupled", "impedance"])
def test_seven_joints_accelerate_as_the_six_directions_were_told(name):
    """These compensate all of the dynamics: what is left is J qdd + Jdot qd = u."""
    sense, task, model = inputs(6, 7, 6)
    (torque,) = walk_on_arrays(MAKERS[name](lambda v: np.full(6, v)), sense, task, model, 1)
    outside = 0.0 if name == "resolved acceleration" else sense.f
    qdd = np.linalg.solve(model.M, torque - model.h - model.J.T @ (outside + np.zeros(6)))
    xdd = model.J @ qdd + model.Jdqd
    free = task.xdd + 80.0 * (task.xd - sense.xd) + 400.0 * (task.x - sense.x)
    if name == "impedance":
        free = task.xdd + (600.0 * (task.xd - sense.xd) + 2000.0 * (task.x - sense.x) - sense.f) / 5.0
    first = 0 if name == "resolved acceleration" else 1  # in direction 0 the force is controlled
    assert xdd[first:] == pytest.approx(free[first:])
