"""Options of the files that a command writes, and the check of their paths before any work is done."""

# No annotations from the future: cyclopts looks at those of a base class in the module of whoever inherits them.
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from palpate.cli.options.flags import FLAG
from palpate.errors import InputError
from palpate.files import check_place

WRITTEN = Group("Output", sort_key=6)


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class JsonOption:
    """An answer for programs."""

    json: Annotated[bool, FLAG] = False
    "Print one JSON object and nothing else."


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class ReportOption:
    """A page with all results."""

    report: Path | None = None
    "Where to write a page with all results, an HTML file."

    def page(self) -> Path | None:
        """Path of the page, checked before any work is done."""
        if self.report is not None:
            check_place(self.report, "--report", ending=".html")
        return self.report


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class FileOptions(JsonOption):
    """A file of results."""

    out: Path | None = None
    "Where to write the result."
    replace: Annotated[bool, FLAG] = False
    "Replace the file at --out."

    def check_new(self, path: Path | None, option: str = "--out", ending: str = "") -> None:
        """Check a path before any work is done; an existing file is refused unless it is to be replaced.

        Raises:
            InputError: in one line.
        """
        if path is None:
            return
        check_place(path, option, ending=ending)
        if path.exists() and not self.replace:
            raise InputError(f"{path} exists; choose another place, or add --replace")


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class PictureOptions(ReportOption, JsonOption):
    """A figure, a page, an answer for programs."""

    figure: Path | None = None
    no_figure: Annotated[bool, FLAG] = False
    "Write no figure."
    json: Annotated[bool, FLAG] = False
    "Print one JSON object and nothing else; a figure is written only if --figure is given."

    def picture(self, default: str, endings: tuple[str, ...] = (".png",)) -> Path | None:
        """Path of the figure, checked before any work is done."""
        if self.no_figure or (self.figure is None and self.json):
            return None
        path = self.figure or Path(default)
        ending = path.suffix.lower()
        check_place(path, "--figure", ending=ending if ending in endings else endings[0])
        return path
