"""palpate: identify what a robot touches, and press on it with exactly the force asked for.

The names below are imported when they are first used, so that `import palpate` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.errors import InputError, PalpateError
    from palpate.identification import Identification, identify
    from palpate.logs import read_log
    from palpate.records import Record

_HOME = {
    "Identification": "palpate.identification",
    "InputError": "palpate.errors",
    "PalpateError": "palpate.errors",
    "Record": "palpate.records",
    "identify": "palpate.identification",
    "read_log": "palpate.logs",
}

__all__ = ["Identification", "InputError", "PalpateError", "Record", "identify", "read_log"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("palpate")
    if name not in _HOME:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, "__version__"])
