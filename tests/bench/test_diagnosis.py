"""A part of the user's that is wrong is told in a line, with the line of code that fails as the cause."""

from typing import NamedTuple

import pytest

from palpate.bench import Vec3, build, load, part
from palpate.controllers.controller import controller
from palpate.errors import PartError


@part
@controller
class Misspelt(NamedTuple):
    gain: float

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        return model.J.T @ task.force, state


@part
@controller
class Fickle(NamedTuple):
    gain: float

    def start(self):
        return 0

    def step(self, state, sense, task, model):
        return model.J.T @ task.f, state + 0.5


@part
@controller
class Foreign(NamedTuple):
    gain: float

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        import json

        return float(json.dumps(1)) * (model.J.T @ task.f), state


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        pytest.param(Misspelt(1.0), "'Task' object has no attribute 'force'", marks=pytest.mark.long),
        pytest.param(Fickle(1.0), "the state of the controller changes its types", marks=pytest.mark.long),
        (Foreign(1.0), "cannot be compiled"),
    ],
)
def test_a_wrong_part_is_told_in_a_line(wrong, told):
    bench = build(load("foam-hybrid")).with_controller(wrong)
    with pytest.raises(PartError, match=told) as raised:
        bench.run(1.0)
    assert "\n" not in str(raised.value)
    assert raised.value.__cause__ is not None or raised.value.compiler or "types" in told


@pytest.mark.long
def test_a_right_part_of_the_user_s_own_runs():
    @part
    @controller
    class Pushing(NamedTuple):
        gain: float

        def start(self):
            return 0.0

        def step(self, state, sense, task, model):
            return model.J.T @ (self.gain * task.f), state

    bench = build(load("foam-hybrid")).with_controller(Pushing(1.0))
    assert bench.run(0.01).meta["end"] == "no contact"
    assert isinstance(
        bench.loop.controller.step(0.0, None, _Task(Vec3(1.0, 0.0, 0.0)), _model(bench))[0], Vec3
    )


class _Task(NamedTuple):
    f: Vec3


def _model(bench):
    return bench.loop.conditioning.arm.model(bench.q, 0.0 * bench.q)
