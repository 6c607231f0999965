"""Imports at the first use: a package's names, so that its import costs next to nothing, and the report of values."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

report: Callable[[], Any]
"""Imports the module that shows values (`line`, `text`, `html`, `plot`, `write_page`); set by `palpate`."""


def importer(package: str, homes: Mapping[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """The `__getattr__` of a package: it imports a public name from the module that has it.

    Args:
        package: its name.
        homes: public names by module, relative to the package; one beside it begins with a dot.
    """

    def attribute(name: str) -> Any:
        for module, names in homes.items():
            if name in names:
                value = getattr(import_module(f".{module}", package), name)
                setattr(sys.modules[package], name, value)
                return value
        public = ", ".join(sorted(name for names in homes.values() for name in names))
        raise AttributeError(f"module {package!r} has no attribute {name!r}; it has {public}")

    return attribute
