"""TOML files of one kind: those that come with palpate, each by its name, and any of the user's."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from palpate.errors import InputError, unknown

LARGEST, DEEPEST = 1_000_000, 20
"""Letters of a file, and tables within tables; palpate's own files have some thousand, and four."""


def decoded(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Args:
        text: of the file.
        where: names it in errors.

    Raises:
        InputError: it is no TOML, or larger or deeper than any that a person writes.
    """
    import msgspec

    if len(text) > LARGEST:
        raise InputError(f"{where}: {len(text)} letters; give a file of at most {LARGEST}")
    try:
        tables = dict(msgspec.toml.decode(text))
    except (msgspec.DecodeError, ValueError) as error:
        raise InputError(f"{where}: not TOML: {error}") from error
    except RecursionError:
        raise _too_deep(where) from None
    level: list[Any] = [tables]
    for _ in range(DEEPEST):
        level = [inner for outer in level for inner in _inner(outer)]
    if level:
        raise _too_deep(where)
    return tables


def _inner(value: Any) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def _too_deep(where: str) -> InputError:
    return InputError(
        f"{where}: more than {DEEPEST} tables or lists within each other; give a plainer TOML file"
    )


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
        if not path.is_file():
            raise InputError(f"{name}: no such file; give {self.article} {self.kind}'s name or a TOML file")
        if path.stat().st_size > 4 * LARGEST:
            raise InputError(
                f"{name}: {path.stat().st_size} bytes; give a TOML file of at most {LARGEST} letters"
            )
        try:
            return path.read_text("utf-8")
        except UnicodeDecodeError as error:
            raise InputError(f"{name}: not a text file ({error.reason}); give a TOML file") from error
