"""Constants of laws' modules as C: the names that they have in Python, and the sentence that stands below them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate_native.expressions import Value, number
from palpate_native.source import constant_notes
from palpate_native.structs import Structs, c_name, is_struct, members, plain


class Constants:
    """The constants of one translation, each defined once.

    Args:
        structs: the types.
        claim: gives a name that nothing else in the file has: asked for name and module.
    """

    def __init__(self, structs: Structs, claim: Callable[[str, str], str]):
        self._structs, self._claim = structs, claim
        self._names: dict[Any, str] = {}
        self.definitions: list[str] = []

    def value(self, name: str, value: Any, function: Callable[..., Any]) -> Value | None:
        """A number or a part that a module's name stands for; None if it is none of them."""
        part = isinstance(value, tuple) and hasattr(value, "_fields")
        if not part and (type(value) not in (int, float) or not math.isfinite(value)):
            return None
        import numba

        kind, (module, note) = plain(numba.typeof(value)), _home(name, value, function)
        text = f"{self._structs.name(kind)} NAME = {self.initial(value, kind)};"
        return Value(self._define(name, module, text, note), kind, place="named")

    def table(self, name: str, numbers: Any, function: Callable[..., Any]) -> str:
        """The name of a table of numbers that a module holds, row by row."""
        flat = np.asarray(numbers, dtype=np.float64).ravel()
        rows = (", ".join(map(number, row.tolist())) for row in np.split(flat, range(6, len(flat), 6)))
        text = f"double NAME[{len(flat)}] = {{" + "".join(f"\n    {row}," for row in rows) + "\n};"
        note = constant_notes(function.__code__.co_filename).get(name, "")
        return self._define(name, function.__module__, text, note)

    def initial(self, value: Any, kind: Any) -> str:
        """A part's numbers as C initialises a struct with them."""
        if not is_struct(kind):
            return number(value)
        inner = (self.initial(one, of) for one, (_, of) in zip(value, members(kind), strict=True))
        return "{" + ", ".join(inner) + "}"

    def _define(self, name: str, module: str, text: str, note: str) -> str:
        if (name, text) not in self._names:
            own = self._names[name, text] = self._claim(c_name(name), module.rpartition(".")[2])
            says = f"/* {note} */\n" if note else ""
            self.definitions.append(f"{says}static const {text.replace('NAME', own, 1)}")
        return self._names[name, text]


def _home(name: str, value: Any, function: Callable[..., Any]) -> tuple[str, str]:
    """The module of ours that says what the value under the name is, and the sentence; or the function's."""
    for module in [one for one in list(sys.modules.values()) if getattr(one, "__file__", None)]:
        ours = module.__name__.startswith("palpate") and vars(module).get(name) is value
        if ours and (note := constant_notes(str(module.__file__)).get(name)):
            return module.__name__, note
    return function.__module__, ""
