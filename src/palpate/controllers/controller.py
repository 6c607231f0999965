"""A controller: its methods beside its law, its table in an experiment's file, and one type for the built-in ones."""

from functools import cache
from typing import Any, ClassVar, NamedTuple, TypeVar

from palpate._jit import part
from palpate._vector import ZERO3
from palpate.errors import InputError
from palpate.signals.types import Table, example, kinds

C = TypeVar("C", bound=type)


def controller(cls: C) -> C:
    """Marks a NamedTuple as a controller, and gives it the three methods that few need of their own.

    ``rest(state, sense)`` is the state after a tick on which it did not act; left out, it starts anew.
    ``report(state)`` is what a record shows of its inside, two `Vec3`: the force command that it has gathered or
    learned [N, N, N m], and three numbers of its own; left out, zeros.
    ``trouble(state)`` says what is wrong with it beyond repair, "" if nothing is; asked between ticks, in plain Python.
    """
    for method, otherwise in (("rest", _anew), ("report", _nothing), ("trouble", _none)):
        if not hasattr(cls, method):
            setattr(cls, method, otherwise)
    return part(cls)


def _anew(self: Any, state: Any, sense: Any) -> Any:
    return self.start()


def _nothing(self: Any, state: Any) -> Any:
    return ZERO3, ZERO3


def _none(self: Any, state: Any) -> str:
    return ""


class ControllerTable(Table, tag_field="kind"):
    """The [controller] table of an experiment. Derive from it beside the part, with the word that is its `kind` as tag.

    ``shares_loop``: whether the part has its place in the one loop that is compiled for several controllers. That costs
    half a second of compiling for all, a second part with arrays in its state four; others have a loop of their own.
    """

    shares_loop: ClassVar[bool] = False

    def build(self, tick: float, wall: float) -> Any:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        raise NotImplementedError


@cache
def members() -> tuple[Any, ...]:
    """One of each controller that shares the compiled loop, with any numbers: the type is what counts."""
    return tuple(example(kind).build(0.001, 0.5) for kind in kinds(ControllerTable) if kind.shares_loop)


def controller_of(table: ControllerTable, tick: float, wall: float) -> Any:
    """The controller of a table, for a time between ticks [s] and a surface at x = `wall` [m]."""
    one = table.build(tick, wall)
    return join(one) if table.shares_loop else one


@controller
class AnyController(NamedTuple):
    """One of two controllers, of which the second may again be one of two; `join` makes it.

    Args:
        chosen: 1 if the first acts, 0 if it is the second.
        first: a controller.
        second: another one.
    """

    chosen: int
    first: Any
    second: Any

    def start(self):
        return self.first.start(), self.second.start()

    def step(self, state, sense, task, model):
        first, second = state
        if self.chosen == 1:
            torque, first = self.first.step(first, sense, task, model)
        else:
            torque, second = self.second.step(second, sense, task, model)
        return torque, (first, second)

    def rest(self, state, sense):
        """As the one that acts; the other's state stays."""
        first, second = state
        if self.chosen == 1:
            return self.first.rest(first, sense), second
        return first, self.second.rest(second, sense)

    def report(self, state):
        """Of the one that acts."""
        if self.chosen == 1:
            return self.first.report(state[0])
        return self.second.report(state[1])

    def trouble(self, state):
        """Trouble of the active controller."""
        if self.chosen == 1:
            return self.first.trouble(state[0])
        return self.second.trouble(state[1])


def join(one: Any) -> Any:
    """The controller that behaves as this one and has the same type for every built-in one.

    Raises:
        InputError: not a built-in controller.
    """
    kinds = [type(member) for member in members()]
    if type(one) not in kinds:
        known = ", ".join(kind.__name__ for kind in kinds)
        raise InputError(f"cannot join a {type(one).__name__}; there are: {known}")
    placed = [one if type(member) is type(one) else member for member in members()]
    *others, joined = placed
    for first in reversed(others):
        joined = AnyController(int(first is one), first, joined)
    return joined


def alone(controller: Any, state: Any) -> tuple[Any, Any]:
    """The controller that acts and its state, taken out of what `join` made."""
    while isinstance(controller, AnyController):
        chosen = controller.chosen == 1
        controller, state = (controller.first, state[0]) if chosen else (controller.second, state[1])
    return controller, state
