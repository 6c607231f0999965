"""What the tables of an experiment's file are made of."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Triple = tuple[float, float, float]
PositiveTriple = tuple[Positive, Positive, Positive]
NotNegativeTriple = tuple[NotNegative, NotNegative, NotNegative]


class Part(Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the file; keys that it does not know are refused."""
