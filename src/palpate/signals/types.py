"""The values that pass between a bench, its controller and its identifiers, and the tables that parts are read from.

Fields that are marked `Vec3` are those for the planar arm, and NumPy arrays for any other. Parts take floats: an
integer would be another type to the compiler, and a new compilation.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, TypeVar, Union

import msgspec
import numpy as np
from msgspec import Meta, Struct

from palpate._jit import part
from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.records import Compared, Readable

NORMAL = 1.96
"""Standard deviations of a 95 % half-width."""


@part
class Sense(NamedTuple):
    """Measurements of the controller at a tick."""

    q: Vec3  # joint angles [rad], shape (n,)
    qd: Vec3  # joint rates [rad/s], shape (n,)
    x: Vec3  # pose [m, m, rad], shape (m,)
    xd: Vec3  # its rate [m/s, m/s, rad/s], shape (m,)
    f: Vec3  # wrench that the robot exerts on the environment, measured [N, N, N m], shape (m,)


@part
class Task(NamedTuple):
    """Task of the controller at a tick."""

    x: Vec3  # desired pose, shape (m,)
    xd: Vec3  # its rate
    xdd: Vec3  # its second rate
    f: Vec3  # desired wrench on the environment, shape (m,)
    s: Vec3  # selection: 1 where the force is controlled, 0 where the position is, shape (m,)


@dataclass(frozen=True, eq=False)
class Estimate(Compared):
    """Estimate of an identifier so far.

    Args:
        names: of the parameters, in their order: ("M", "B", "K") for the thesis' regressor.
        theta: the values, shape (n,), SI.
        covariance: of theta, shape (n, n): the noise found in the data included.
        samples: how many samples the data are worth (fewer than were seen when old ones are forgotten).
        rejected: the reason why none of its numbers is valid; empty if the model is not rejected.
        passive: names of the parameters that no passive surface has below zero.
    """

    names: tuple[str, ...]
    theta: Array
    covariance: Array
    samples: float
    rejected: str = ""
    passive: tuple[str, ...] = ()

    @property
    def std(self) -> Array:
        """Standard deviation of each parameter, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def verdicts(self, tolerance: float = 0.25) -> dict[str, str]:
        """Verdict of each parameter, as of `verdict`; "rejected" for all where the estimate is."""
        if self.rejected:
            return dict.fromkeys(self.names, "rejected")
        rules = {name: passive_verdict if name in self.passive else verdict for name in self.names}
        values = zip(self.names, self.theta.tolist(), self.std.tolist(), strict=True)
        return {name: rules[name](value, std, tolerance) for name, value, std in values}


def verdict(value: float, std: float, tolerance: float = 0.25) -> str:
    """Verdict "identified" if the 95 % half-width is at most `tolerance` of the value, else "not identifiable"."""
    return "identified" if NORMAL * std <= tolerance * abs(value) else "not identifiable"


def passive_verdict(value: float, std: float, tolerance: float = 0.25) -> str:
    """Verdict of a mass, damping or stiffness: "rejected" if significantly negative, else that of `verdict`."""
    return "rejected" if value + NORMAL * std < 0.0 else verdict(value, std, tolerance)


C = TypeVar("C", bound=type)


def coerce_fields(check: Callable[[Any], None] | None = None) -> Callable[[C], C]:
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
    """Three numbers as a `Vec3`."""
    return Vec3(*map(float, values))


def _as_it_is(value: Any) -> Any:
    return value


def _floats(value: Any) -> Any:
    return triple(value) if isinstance(value, Vec3) else float(value)


Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Triple = tuple[float, float, float]
PositiveTriple = tuple[Positive, Positive, Positive]
NotNegativeTriple = tuple[NotNegative, NotNegative, NotNegative]
Size = Annotated[int, Meta(ge=1, le=1000)]

T = TypeVar("T", bound=Struct)


class Table(Readable, Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the file; keys that it does not know are refused."""


def kinds(base: type[T]) -> list[type[T]]:
    """Every table that was derived from this one, in the order of the words that name them."""
    return sorted(base.__subclasses__(), key=lambda kind: str(kind.__struct_config__.tag))


def any_of(base: type[Table]) -> Any:
    """The type of a table that may be of any of these kinds."""
    return Union[tuple(kinds(base))]  # noqa: UP007 - of a list that is not known before


def example(kind: type[T]) -> T:
    """A table of this kind: its defaults, and 1 for each number that has none."""
    required = {field.encode_name: 1.0 for field in msgspec.structs.fields(kind) if field.required}
    return kind(**required)
