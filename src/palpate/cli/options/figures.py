"""Options of the figures of a folder of results, for every command that writes one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from palpate.errors import InputError

DRAWN = Group("Figures", sort_key=4)


@Parameter(name="*", group=DRAWN)
@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """How figures are written."""

    figures: Annotated[
        tuple[str, ...], Parameter(negative=(), show_default=", ".join, consume_multiple=True)
    ] = ("png",)
    "Formats: png, svg, pdf, one or more."
    dpi: int | None = None
    "Of a PNG; 110 if not given."

    @property
    def endings(self) -> tuple[str, ...]:
        """Of the figures' files."""
        return tuple(f".{kind.lower().lstrip('.')}" for kind in self.figures)

    def check(self) -> None:
        """Check that the figures can be written, before any work is done."""
        from palpate.report.style import FORMATS, check_dpi

        check_dpi(self.dpi)
        for ending in self.endings:
            if ending not in FORMATS:
                raise InputError(
                    f"--figures must be of {', '.join(kind[1:] for kind in FORMATS)}, got {ending[1:]!r}"
                )
