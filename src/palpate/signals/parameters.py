"""How parts take their numbers: an integer would be another type to the compiler, and a new compilation."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from palpate._vector import Vec3
from palpate.errors import InputError

C = TypeVar("C", bound=type)


def coerced(check: Callable[[Any], None] | None = None) -> Callable[[C], C]:
    """Decorates a NamedTuple of parameters: numbers become what their fields say, then `check` judges them.

    A field marked `Any` takes a number or a `Vec3`. Put it under `@part`. `_make` and `_replace` build the
    tuple directly: they skip both.
    """

    def decorate(cls: C) -> C:
        plain_new = cls.__new__
        makers: dict[Any, Callable[[Any], Any]] = {float: float, int: int, Any: _floats}
        kinds = [makers.get(kind, _as_it_is) for kind in cls.__annotations__.values()]

        def new(cls: Any, *args: Any, **kwargs: Any) -> Any:
            raw = plain_new(cls, *args, **kwargs)
            self = tuple.__new__(cls, (kind(v) for kind, v in zip(kinds, raw, strict=True)))
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


def components(value: Any) -> tuple[float, ...]:
    """The numbers in a number or in a `Vec3`."""
    return tuple(value) if isinstance(value, Vec3) else (value,)


def alike(value: float) -> Vec3:
    """The same number three times."""
    return triple((value, value, value))


def triple(values: Iterable[float]) -> Vec3:
    """Three numbers."""
    return Vec3(*map(float, values))


def _as_it_is(value: Any) -> Any:
    return value


def _floats(value: Any) -> Any:
    return triple(value) if isinstance(value, Vec3) else float(value)
