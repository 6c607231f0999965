"""Options that name the indenter of a press."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli.options.flags import SIGNED
from palpate.cli.options.values import with_std
from palpate.errors import InputError
from palpate.units import unit

if TYPE_CHECKING:
    from palpate.identification import Identification
    from palpate.identification.indenter import Indenter

_SIZE = re.compile(r"\s*([-+0-9.eE]+)\s*:?\s*([a-zA-Zµμ°]*)\s*")
_QUANTITIES = {"sphere": ("length", "m"), "punch": ("length", "m"), "cone": ("angle", "deg")}


@Parameter(name="*", group=Group("Young's modulus", sort_key=5))
@dataclass(frozen=True, kw_only=True)
class IndenterOptions:
    """Shape of the indenter, if it is known.

    Parameters
    ----------
    indenter
        sphere:RADIUS, punch:RADIUS (flat, round) or cone:HALF_ANGLE (from its axis), as sphere:5:mm or cone:70:deg; m
        and deg if no unit is given. It adds Young's modulus E.
    poisson
        Poisson's ratio of the material, VALUE or VALUE:STD; unknown from 0 to 0.5 if not given.
    """

    indenter: str | None = None
    poisson: Annotated[str | None, SIGNED] = None

    def check(self) -> None:
        """Check the options before any work is done."""
        from palpate.identification.indenter import check_poisson

        if self.poisson is not None and self.indenter is None:
            raise InputError("--poisson needs a known shape of the indenter; add --indenter")
        check_poisson(with_std("poisson", self.poisson, "0.45:0.05"))
        self._shape()

    def modulus(self, found: Identification, tolerance: float) -> Identification:
        """The identification with Young's modulus, if an indenter is named."""
        from palpate.identification.indenter import with_modulus

        shape = self._shape()
        if shape is None:
            return found
        return with_modulus(found, shape, with_std("poisson", self.poisson, "0.45:0.05"), tolerance)

    def _shape(self) -> Indenter | None:
        from palpate.identification.indenter import Indenter

        if self.indenter is None:
            return None
        shape, _, size = self.indenter.partition(":")
        match = _SIZE.fullmatch(size)
        if shape not in _QUANTITIES or match is None:
            shapes = "sphere:RADIUS, punch:RADIUS or cone:HALF_ANGLE, as sphere:5:mm"
            raise InputError(f"--indenter needs {shapes}, got {self.indenter!r}")
        quantity, default = _QUANTITIES[shape]
        own = unit(match[2] or default)
        if own.quantity != quantity:
            raise InputError(
                f"{match[2]!r} of --indenter is a unit of {own.quantity}; a {shape} needs one of {quantity}"
            )
        try:
            value = float(match[1])
        except ValueError:
            raise InputError(f"--indenter needs a number as its size, got {match[1]!r}") from None
        return Indenter(shape, value * own.factor)
