"""Constants of laws' modules as C: the names that they have in Python, and the sentence that stands below them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.native.expressions import Value, number
from palpate.native.source import constant_notes
from palpate.native.structs import Structs, c_name, is_struct, members, plain


class Constants:
    """The constants of one translation, each defined once.

    Args:
        structs: the types.
        claim: gives a name that nothing else in the file has: asked for name and module.
    """

    def __init__(self, structs: Structs, claim: Callable[[str, str], str]):
        self._structs, self._claim = structs, claim
        self._names: dict[tuple[str, str, str], str] = {}
        self.definitions: list[str] = []

    def value(self, name: str, value: Any, file: str) -> Value | None:
        """A number or a part that a module's name stands for; None if it is none of them."""
        if isinstance(value, bool) or not isinstance(value, int | float | tuple):
            return None
        if isinstance(value, tuple) and not hasattr(value, "_fields"):
            return None
        import numba

        kind = plain(numba.typeof(value))
        key, note = self._home(name, value, file)
        if key not in self._names:
            own = self._names[key] = self._claim(c_name(name), key[1].rpartition(".")[2])
            text = self.initial(value, kind)
            self._define(f"static const {self._structs.name(kind)} {own} = {text};", note)
        return Value(self._names[key], kind, place="named")

    def table(self, name: str, numbers: Any, function: Callable[..., Any]) -> str:
        """The name of a table of numbers that a module holds, row by row."""
        key, note = self._home(name, None, function.__code__.co_filename)
        key = (key[0], function.__module__, name)
        if key not in self._names:
            own = self._names[key] = self._claim(c_name(name), key[1].rpartition(".")[2])
            flat = np.asarray(numbers, dtype=np.float64).ravel()
            rows = [
                ", ".join(number(float(x)) for x in row) for row in np.split(flat, range(6, len(flat), 6))
            ]
            text = "".join(f"\n    {row}," for row in rows)
            self._define(f"static const double {own}[{len(flat)}] = {{{text}\n}};", note)
        return self._names[key]

    def initial(self, value: Any, kind: Any) -> str:
        """A part's numbers as C initialises a struct with them."""
        if not is_struct(kind):
            return number(value)
        inner = (self.initial(one, of) for one, (_, of) in zip(value, members(kind), strict=True))
        return "{" + ", ".join(inner) + "}"

    def _home(self, name: str, value: Any, file: str) -> tuple[tuple[str, str, str], str]:
        """Where a name is defined: the module that has the same value under it, and the sentence there."""
        for module in [m for m in list(sys.modules.values()) if getattr(m, "__file__", None)]:
            own = vars(module)
            if own.get("__name__", "").startswith("palpate") and own.get(name) is value and value is not None:
                note = constant_notes(str(module.__file__)).get(name)
                if note:
                    return ("value", module.__name__, name), note
        return ("value", file, name) if value is None else ("value", repr(value), name), ""

    def _define(self, text: str, note: str) -> None:
        self.definitions.append((f"/* {note} */\n" if note else "") + text)
