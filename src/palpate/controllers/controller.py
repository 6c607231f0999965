"""What every controller answers beside its law."""

from typing import Any, TypeVar

from palpate._jit import part
from palpate._vector import ZERO3

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
