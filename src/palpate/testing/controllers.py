"""Laws of every controller."""

from typing import Any

import numpy as np

from palpate._vector import ZERO3, Vec3
from palpate.arrays import Array
from palpate.bench import build, load, with_values
from palpate.bench.bench import Bench
from palpate.bench.from_experiment import check_parts
from palpate.controllers.controller import controller as registered
from palpate.errors import InputError
from palpate.robots.arm3 import Arm3
from palpate.signals.types import Sense, Task
from palpate.testing.check import Check, require

_NEAR = {
    "run.press": 0.1,
    "run.duration": 1.5,
    "robot.start": (0.4635, 0.0, 0.0),
    "approach.hold": 0.05,
    "approach.first": 0.470,
    "approach.step": 0.002,
    "approach.period": 0.1,
}


def controller_checks(controller: Any) -> list[Check]:
    """The checks of a controller: a part with ``start()`` and ``step(state, sense, task, model)``."""
    return [Check(law, controller) for law in LAWS]


def a_moment() -> tuple[Sense, Task, Any]:
    """Input of a controller at a tick in contact."""
    arm = Arm3(limits=Vec3(16.0, 2.5, 0.6), rotor=ZERO3)
    x = Vec3(0.466, 1e-4, -1e-3)
    q = arm.inverse(x, 1.0)
    qd = Vec3(0.01, -0.02, 0.03)
    sense = Sense(q, qd, x, Vec3(0.001, 0.0, 0.02), Vec3(14.0, 0.0, 0.0))
    task = Task(Vec3(0.466, 0.0, 0.0), ZERO3, ZERO3, Vec3(20.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0))
    return sense, task, arm.model(q, qd)


def ticks(controller: Any) -> tuple[Array, Any]:
    """Torques [N m] of five equal ticks, shape (5, 3), and the state after them."""
    sense, task, model = a_moment()
    state = controller.start()
    torques = []
    for _ in range(5):
        torque, state = controller.step(state, sense, task, model)
        torques.append(torque)
    return np.array(torques), state


def class_has_a_docstring(controller: Any) -> None:
    """The class has a docstring of its own."""
    docstring = type(controller).__doc__ or ""
    require(
        docstring and not docstring.startswith(f"{type(controller).__name__}("), "its class has no docstring"
    )


def torque_is_finite(controller: Any) -> None:
    """The torque has three finite numbers at each tick."""
    torques, _ = ticks(controller)
    require(torques.shape[1:] == (3,), f"a torque has shape {torques.shape[1:]}, not (3,)")
    require(np.isfinite(torques).all(), f"the torques of its first ticks are {torques.tolist()}")


def all_memory_is_in_the_state(controller: Any) -> None:
    """Equal states and measurements give equal torques."""
    first, _ = ticks(controller)
    repeated, _ = ticks(controller)
    require(
        np.array_equal(first, repeated), "repeated ticks give different torques; keep all memory in the state"
    )


def report_trouble_and_rest_fit_the_loop(controller: Any) -> None:
    """``report``, ``trouble`` and ``rest`` return what the loop takes."""
    registered(type(controller))
    _, state = ticks(controller)
    require(np.shape(controller.report(state)) == (2, 3), "report must return two vectors of three")
    require(isinstance(controller.trouble(state), str), "trouble must return a text, '' if nothing is")
    state_at_rest = controller.rest(state, a_moment()[0])
    require(
        type(state_at_rest) is type(state),
        f"rest returns a {type(state_at_rest).__name__}, its state is a {type(state).__name__}",
    )


def compiled_loop_agrees_with_python(controller: Any) -> None:
    """Compiled, in contact, and as plain Python does it, to the last bit; libm's own functions to 1e-9."""
    bench = _bench(controller)
    try:
        check_parts(bench)
    except InputError as error:
        raise AssertionError(str(error)) from error
    record = bench.run(1.5, seed=1, press=0.1)
    n = int(np.argmax(record["phase"] == 1.0)) + 20
    require((record["phase"] == 1.0).any(), "the arm never touched the surface")
    plain = bench.run(n * bench.loop.tick, seed=1, compiled=False)
    for name in ("torque1", "torque2", "torque3", "force"):
        off = float(np.max(np.abs(plain[name] - record[name][: len(plain)]), initial=0.0))
        require(off <= 1e-9, f"{name} differs by {off:.2g} between compiled and plain Python")


def runs_with_one_seed_are_equal(controller: Any) -> None:
    """Two runs of one bench and one seed are one record."""
    bench = _bench(controller)
    first = bench.run(0.5, seed=2)
    repeated = bench.run(0.5, seed=2)
    require(np.array_equal(first["torque1"], repeated["torque1"]), "two runs with one seed differ")


def _bench(controller: Any) -> Bench:
    return build(with_values(load("foam-hybrid"), _NEAR)).with_controller(controller)


LAWS = (
    class_has_a_docstring,
    torque_is_finite,
    all_memory_is_in_the_state,
    report_trouble_and_rest_fit_the_loop,
    compiled_loop_agrees_with_python,
    runs_with_one_seed_are_equal,
)
IN_PLAIN = LAWS[:4]
"""Checks that compile nothing."""
