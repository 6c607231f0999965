"""How parts take their numbers: an integer would be another type to the compiler, and a new compilation."""

from collections.abc import Callable
from typing import Any, TypeVar

from palpate.errors import InputError

C = TypeVar("C", bound=type)


def coerced(check: Callable[[Any], None] | None = None) -> Callable[[C], C]:
    """Decorates a NamedTuple of parameters: numbers become what their fields say, then `check` judges them.

    Put it under `@part`. `_make` and `_replace` build the tuple directly and skip both.
    """

    def decorate(cls: C) -> C:
        plain_new = cls.__new__
        kinds = [kind if kind in {float, int} else None for kind in cls.__annotations__.values()]

        def new(cls: Any, *args: Any, **kwargs: Any) -> Any:
            raw = plain_new(cls, *args, **kwargs)
            self = tuple.__new__(cls, (kind(v) if kind else v for kind, v in zip(kinds, raw, strict=True)))
            if check is not None:
                check(self)
            return self

        cls.__new__ = new  # type: ignore[method-assign,assignment]
        return cls

    return decorate


def require(ok: bool, name: str, limit: str, value: Any) -> None:
    """Raises the error of a parameter outside its limit: what, the limit, what was given."""
    if not ok:
        raise InputError(f"{name} must be {limit}, got {value!r}")
