"""One type for all: every built-in controller behaves in the sum as it does alone."""

import numpy as np
import pytest

from palpate._vector import ZERO3, Vec3
from palpate.controllers import Hybrid, alone, join
from palpate.controllers.controller import members
from palpate.errors import InputError
from palpate.robots.arm3 import Arm3
from palpate.signals.types import Sense, Task

each = pytest.mark.parametrize("one", members(), ids=lambda one: type(one).__name__)


def ticks():
    arm = Arm3(limits=Vec3(16.0, 2.5, 0.6), rotor=ZERO3)
    for k in range(12):
        x = Vec3(0.466 + 1e-4 * k, 1e-4 * k, -1e-3 * k)
        q, qd = arm.inverse(x, 1.0), Vec3(0.01, -0.02 * k, 0.03)
        sense = Sense(q, qd, x, Vec3(0.001, 0.0, 0.02), Vec3(14.0 + k, 0.0, 0.0))
        task = Task(Vec3(0.466, 0.0, 0.0), ZERO3, ZERO3, Vec3(20.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0))
        yield k, sense, task, arm.model(q, qd)


def path(controller):
    """Torques and reports over a contact, its loss and its regain."""
    state, found = controller.start(), []
    for k, sense, task, model in ticks():
        if 4 <= k < 7:
            state = controller.rest(state, sense)
        else:
            torque, state = controller.step(state, sense, task, model)
            found.append([*torque])
        found += [[*v] for v in controller.report(state)]
    return np.array(found), controller.trouble(state)


@each
def test_joined_it_is_what_it_is_alone(one):
    alone, trouble = path(one)
    joined, same = path(join(one))
    np.testing.assert_array_equal(joined, alone)
    assert same == trouble
    assert np.isfinite(alone).all()


def test_all_have_one_type_for_the_compiler():
    import numba

    joined = [join(one) for one in members()]
    assert len({str(numba.typeof(j)) for j in joined}) == 1
    assert len({str(numba.typeof(j.start())) for j in joined}) == 1


def test_one_that_is_not_built_in_is_refused():
    with pytest.raises(InputError, match="cannot join a Hybrid; there are: DecoupledHybrid"):
        join(Hybrid(ZERO3, ZERO3, ZERO3, ZERO3))


@each
def test_what_was_joined_is_taken_out_again(one):
    joined = join(one)
    own, state = alone(joined, joined.start())
    assert own is one
    assert type(state) is type(one.start())
