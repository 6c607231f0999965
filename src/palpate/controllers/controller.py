"""Methods of every controller beside its law, and its table in an experiment's file."""

from typing import Any, ClassVar, TypeVar

from palpate._jit import part
from palpate._vector import ZERO3
from palpate.signals.types import Table

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
