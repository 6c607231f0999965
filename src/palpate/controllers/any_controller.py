"""One type for the built-in controllers, so that one compiled loop serves them all."""

from functools import cache
from typing import Any, NamedTuple

from palpate.controllers.controller import ControllerTable, controller
from palpate.errors import InputError
from palpate.signals.types import example, kinds


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
