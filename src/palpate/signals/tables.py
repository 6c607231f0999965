"""Base of the tables in an experiment's or a study's file, and the discovery of the kinds of a part."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar, Union

import msgspec
from msgspec import Meta, Struct

from palpate.results import Readable

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
    wanted = {field.encode_name: 1.0 for field in msgspec.structs.fields(kind) if field.required}
    return kind(**wanted)
