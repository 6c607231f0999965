"""Options that name the indenter of a press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli.options.flags import SIGNED
from palpate.cli.options.values import with_std
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.identification.indenter import Indenter


@Parameter(name="*", group=Group("Young's modulus", sort_key=5))
@dataclass(frozen=True, kw_only=True)
class IndenterOptions:
    """Shape of the indenter, if it is known.

    Parameters
    ----------
    indenter
        sphere:RADIUS, punch:RADIUS (flat, round) or cone:HALF_ANGLE (from its axis), as sphere:5:mm or cone:70:deg.
        It adds Young's modulus E.
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
        check_poisson(self.ratio)
        self.shape()

    def shape(self) -> Indenter | None:
        """The shape; None if not given."""
        from palpate.identification.indenter import Indenter

        return None if self.indenter is None else Indenter.parse(self.indenter)

    @property
    def ratio(self) -> tuple[float, float] | None:
        """Poisson's ratio, with its standard deviation."""
        return with_std("poisson", self.poisson, "0.45:0.05")
