"""What is true of every controller that an experiment can ask for: found, not listed."""

import msgspec
import numpy as np
import pytest

from bench.quick import quick
from palpate._vector import ZERO3, Vec3
from palpate.bench import build, changed
from palpate.controllers import ControllerTable
from palpate.robots.arm3 import Arm3
from palpate.signals.tables import example, kinds
from palpate.signals.types import Sense, Task

TICK, WALL = 0.001, 0.465
each = pytest.mark.parametrize(
    "table", [example(kind) for kind in kinds(ControllerTable)], ids=lambda t: t.__struct_config__.tag
)


def a_tick():
    arm = Arm3(limits=Vec3(16.0, 2.5, 0.6), rotor=ZERO3)
    x = Vec3(0.466, 1e-4, -1e-3)
    q, qd = arm.inverse(x, 1.0), Vec3(0.01, -0.02, 0.03)
    sense = Sense(q, qd, x, Vec3(0.001, 0.0, 0.02), Vec3(14.0, 0.0, 0.0))
    task = Task(Vec3(0.466, 0.0, 0.0), ZERO3, ZERO3, Vec3(20.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0))
    return sense, task, arm.model(q, qd)


def ticks(controller, count=5):
    sense, task, model = a_tick()
    state, torques = controller.start(), []
    for _ in range(count):
        torque, state = controller.step(state, sense, task, model)
        torques.append(torque)
    return np.array(torques), state


@each
def test_it_is_known_by_its_word_and_says_what_it_is(table):
    assert table.__struct_config__.tag
    assert type(table).__doc__
    assert type(table.made(TICK, WALL)).__doc__


@each
def test_a_step_keeps_nothing_on_the_part(table):
    """The same start and the same senses give the same torques, whatever went before."""
    controller = table.made(TICK, WALL)
    first, _ = ticks(controller)
    again, _ = ticks(controller)
    assert np.isfinite(first).all()
    np.testing.assert_array_equal(first, again)


@each
def test_it_tells_of_itself(table):
    controller = table.made(TICK, WALL)
    _, state = ticks(controller)
    assert np.shape(controller.report(state)) == (2, 3)
    assert isinstance(controller.trouble(state), str)
    assert type(controller.rest(state, a_tick()[0])) is type(state)


@each
def test_an_experiment_may_ask_for_it(table):
    asked = {"controller": {"kind": table.__struct_config__.tag, **msgspec.to_builtins(table)}}
    record = build(changed(quick("foam-hybrid"), asked)).run(0.002, compiled=False)
    assert len(record) == 2
