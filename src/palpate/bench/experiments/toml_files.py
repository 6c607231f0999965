"""TOML files of one kind: those that come with palpate, each by its name, and any of the user's."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from palpate.errors import InputError, unknown
from palpate.files import read_text


@dataclass(frozen=True)
class TomlFiles:
    """Where they are.

    Args:
        kind: what one of them is, as `experiment`.
        article: of that word.
        package: that holds those of palpate.
        folders: of it.
    """

    kind: str
    article: str
    package: str
    folders: tuple[str, ...]

    def names(self) -> list[str]:
        """Those that come with palpate."""
        return sorted(self._shipped())

    def _shipped(self) -> dict[str, Traversable]:
        """File of each name."""
        files = [p for f in self.folders for p in (resources.files(self.package) / f).iterdir()]
        return {p.name.removesuffix(".toml"): p for p in files if p.name.endswith(".toml")}

    def source(self, name: str) -> str:
        """The text of one that comes with palpate, or of a TOML file of the user's.

        Raises:
            InputError: no such name, no such file, or not a text.
        """
        shipped = self._shipped()
        if name in shipped:
            return shipped[name].read_text("utf-8")
        path = Path(name)
        if path.suffix != ".toml" and not path.exists():
            raise unknown(self.kind, name, self.names())
        if not path.exists():
            raise InputError(f"{name}: no such file; give {self.article} {self.kind}'s name or a TOML file")
        return read_text(path, f"{self.article} {self.kind}")
