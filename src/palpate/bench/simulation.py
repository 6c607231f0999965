"""The one march through a run: tick after tick, for as long as it is asked to, and changed between ticks if need be.

A part of the user's that fails is stepped once in plain Python, then compiled alone, for a diagnosis in one line.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import NotCompiled
from palpate._vector import ZERO3, Vec3
from palpate.arrays import Array
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import ALONG_X, Loop, LoopState, compiled_march, march, tick
from palpate.bench.summary import CONTACT
from palpate.environments.surface import touch
from palpate.errors import PartError
from palpate.plugins import reason
from palpate.signals.types import Sense, Task

DEPTH, RATE = 1e-3, 1e-3
"""Depth of the tip [m] and its rate [m/s] at which a surface is tried."""


class PartCall(NamedTuple):
    """A call of one method of a part, with the arguments that the loop gives.

    Args:
        role: of the part in the loop.
        part: with the method.
        method: its name.
        arguments: of the call.
        keeps: index of the state among the returned values; None if there is none, -1 if the value is the state.
    """

    role: str
    part: Any
    method: str
    arguments: tuple[Any, ...]
    keeps: int | None


def diagnose(loop: Loop, state: LoopState) -> PartError:
    """The reason why a loop does not run compiled, in one line.

    A mistake in a part shows itself in plain Python with the line that makes it, which is the cause of the error
    returned. What only the compiler minds shows itself where the part's methods are compiled one by one.
    """
    pressed = _pressing_state(state)
    try:
        after = tick(loop, pressed, 0, 0.0, np.empty(len(COLUMNS)))
    except Exception as error:  # noqa: BLE001 - whatever the user's own code raises
        failure = PartError(f"{_user_parts(loop)} fails when it is stepped: {reason(error)}")
        failure.__cause__ = error
        return failure
    changed = [name for name in state._fields if _kinds(getattr(state, name)) != _kinds(getattr(after, name))]
    if changed:
        return PartError(
            f"the state of the {changed[0]} changes its types from one tick to the next; start with the types of step"
        )
    return PartError(
        uncompilable(loop, state)
        or "the loop runs in plain Python but cannot be compiled: a part may hold, take and return only floats, "
        "vectors and NamedTuples of them, and call only laws; run it with compiled=False"
    )


def uncompilable(loop: Loop, state: LoopState) -> str:
    """The first method of the user's parts that does not compile, and why; "" if all do."""
    import numba

    from palpate._jit.kernels import compiled_alone

    for call in calls(loop, state):
        returned, why = compiled_alone(getattr(type(call.part), call.method), call.part, *call.arguments)
        method = f"{call.method} of the {call.role} {type(call.part).__name__}"
        if why:
            return f"{method} cannot be compiled: {why}"
        if call.keeps is None:
            continue
        returned_state = returned if call.keeps < 0 else returned.types[call.keeps]
        if returned_state != numba.typeof(call.arguments[0]):
            return (
                f"{method} returns a state of another type than start: {returned_state}, "
                f"not {numba.typeof(call.arguments[0])}; return the same type in every branch"
            )
    return ""


def not_finite(loop: Loop, state: LoopState) -> str:
    """The first method of the user's parts that returns a number that is not finite; "" if none does.

    Raises:
        PartError: a method raises, or does not return what it must.
    """
    for call in calls(loop, state):
        method = f"{call.method} of the {call.role} {type(call.part).__name__}"
        try:
            with np.errstate(all="ignore"):
                value = getattr(call.part, call.method)(*call.arguments)
        except Exception as error:
            raise PartError(f"{method} fails: {reason(error)}") from error
        wrong = _wrong(call, value)
        if wrong:
            raise PartError(f"{method} {wrong}")
        if not all(map(np.isfinite, _numbers(value))):
            return f"{method} gives {list(_numbers(value))} at its first tick; every number must be finite"
    return ""


def _wrong(call: PartCall, value: Any) -> str:
    """Fault of a method's return value."""
    if call.method == "step":
        if not isinstance(value, tuple) or isinstance(value, Vec3) or len(value) != 2:
            return f"returns a {type(value).__name__}; it must return (torque, state)"
        if not isinstance(value[0], Vec3):
            return f"returns a {type(value[0]).__name__} as its torque; it must be a Vec3, such as model.J.T @ wrench"
    if call.method == "report" and not (len(value) == 2 and all(isinstance(v, Vec3) for v in value)):
        return "must return two Vec3"
    if call.method == "force" and not isinstance(value, float | int):
        return f"returns a {type(value).__name__}; it must be a number [N]"
    if call.keeps is not None:
        returned_state = value if call.keeps < 0 else value[call.keeps]
        if _kinds(returned_state) != _kinds(call.arguments[0]):
            return "returns a state of another type than start; start with the types of step"
    return ""


def calls(loop: Loop, state: LoopState) -> Iterator[PartCall]:
    """Every method of the user's parts, as the loop calls it in contact."""
    controller, surface = loop.controller, loop.plant.surface
    if is_own(controller):
        sense, task, model = _moment(loop, state)
        controller_state = controller.start()
        yield PartCall("controller", controller, "start", (), None)
        yield PartCall("controller", controller, "step", (controller_state, sense, task, model), 1)
        yield PartCall("controller", controller, "rest", (controller_state, sense), -1)
        yield PartCall("controller", controller, "report", (controller_state,), None)
    if is_own(surface):
        untouched = surface.start()
        pressed, dt = touch(untouched, RATE), loop.tick / loop.steps
        yield PartCall("surface", surface, "start", (), None)
        yield PartCall("surface", surface, "force", (pressed, DEPTH, RATE), None)
        yield PartCall("surface", surface, "relax", (pressed, DEPTH, RATE, dt), -1)
        yield PartCall("surface", surface, "free", (untouched, dt), -1)


def _moment(loop: Loop, state: LoopState) -> tuple[Sense, Task, Any]:
    """Input of a controller in contact at the arm's start."""
    q = loop.encoder.read(state.plant.q)
    arm = loop.conditioning.arm
    x = arm.pose(q)
    sense = Sense(q, ZERO3, x, ZERO3, ZERO3)
    task = Task(x, ZERO3, ZERO3, 10.0 * ALONG_X, ALONG_X)
    return sense, task, arm.model(q, ZERO3)


def is_own(part: Any) -> bool:
    """True if a part is the user's, not one that comes with palpate."""
    return type(part).__module__.partition(".")[0] != "palpate"


def _user_parts(loop: Loop) -> str:
    """The parts of the user's in a loop."""
    parts = {"controller": loop.controller, "surface": loop.plant.surface}
    names = [f"the {role} {type(part).__name__}" for role, part in parts.items() if is_own(part)]
    return " or ".join(names) or "a part"


def _pressing_state(state: LoopState) -> LoopState:
    plant = state.plant._replace(surface=touch(state.plant.surface, 0.0))
    return state._replace(plant=plant, sequence=state.sequence._replace(phase=CONTACT))


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, tuple):
        for element in value:
            yield from _numbers(element)
    elif isinstance(value, int | float):
        yield float(value)


def _kinds(value: object) -> object:
    """The types of a value and of all that is in it."""
    if isinstance(value, tuple):
        return type(value), tuple(_kinds(v) for v in value)
    return float if isinstance(value, float) else type(value)


PHASE = list(COLUMNS).index("phase")


@dataclass
class Simulation:
    """A running loop. The same seed gives the same rows, bit for bit, in steps of any size.

    Args:
        loop: all its parts; another one of the same types may take its place between ticks.
        state: what it is in; likewise.
        seed: of the noise.
        compiled: False runs the same code in plain Python.
        waiting: called when the loop has to be compiled first.
    """

    loop: Loop
    state: LoopState
    seed: int
    compiled: bool = True
    waiting: Callable[[], None] | None = None
    ticks: int = 0
    """So many have been run."""
    contact: int | None = None
    """The tick of the first contact; None before it."""
    _generator: np.random.Generator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._generator = np.random.default_rng(self.seed)

    @property
    def since_contact(self) -> float:
        """Time since the first contact [s]; 0 before it."""
        return 0.0 if self.contact is None else (self.ticks - self.contact) * self.loop.tick

    def advance(self, ticks: int) -> Array:
        """Run some ticks; return their rows in the order of `COLUMNS`, shape (ticks, columns).

        Raises:
            PartError: a part of the user's cannot be compiled, or fails.
        """
        out = np.empty((ticks, len(COLUMNS)))
        self._march(self._generator.standard_normal(ticks), out)
        pressing = out[:, PHASE] == CONTACT
        if self.contact is None and pressing.any():
            self.contact = self.ticks + int(np.argmax(pressing))
        self.ticks += ticks
        return out

    def _march(self, noise: Array, out: Array) -> None:
        if not self.compiled:
            self.state = _march_plain(self.loop, self.state, self.ticks, noise, out)
            return
        try:
            self.state = compiled_march.run(
                self.waiting or _compiling, self.loop, self.state, self.ticks, noise, out
            )
        except NotCompiled as error:
            failure = diagnose(self.loop, self.state)
            failure.compiler = str(error.__cause__)
            # The compiler's account is a hundred lines on palpate's own code: whoever wants it asks for it.
            raise failure from failure.__cause__


def _compiling() -> None:
    """Announce the compilation on a terminal, where a script seems to hang."""
    if sys.stderr.isatty():
        sys.stderr.write("palpate: compiling the loop: some ten seconds, once after installation\n")


def _march_plain(loop: Loop, state: LoopState, k: int, noise: Array, out: Array) -> LoopState:
    """Run ticks in plain Python, with NaN rows after numbers overflow: compiled code does not raise there."""
    out[:] = np.nan
    try:
        with np.errstate(all="ignore"):
            return march(loop, state, k, noise, out)
    except (ArithmeticError, ValueError):
        written = np.isfinite(out[:, 0])
        if np.isfinite(out[written]).all():
            raise
        return state
