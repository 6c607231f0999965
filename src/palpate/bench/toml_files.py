"""TOML files of one kind: those that come with palpate, each by its name, and any of the user's."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from palpate.errors import InputError, unknown


@dataclass(frozen=True)
class TomlFiles:
    """Where they are.

    Args:
        kind: what one of them is, as `experiment`.
        article: of that word.
        package, folder: that hold those of palpate.
    """

    kind: str
    article: str
    package: str
    folder: str

    def names(self) -> list[str]:
        """Those that come with palpate."""
        files = (resources.files(self.package) / self.folder).iterdir()
        return sorted(p.name.removesuffix(".toml") for p in files if p.name.endswith(".toml"))

    def source(self, name: str) -> str:
        """The text of one that comes with palpate, or of a TOML file of the user's.

        Raises:
            InputError: no such name, no such file, or not a text.
        """
        if name in self.names():
            return (resources.files(self.package) / self.folder / f"{name}.toml").read_text("utf-8")
        path = Path(name)
        if path.suffix != ".toml" and not path.exists():
            raise unknown(self.kind, name, self.names())
        if not path.is_file():
            raise InputError(f"{name}: no such file; give {self.article} {self.kind}'s name or a TOML file")
        try:
            return path.read_text("utf-8")
        except UnicodeDecodeError as error:
            raise InputError(f"{name}: not a text file ({error.reason}); give a TOML file") from error
