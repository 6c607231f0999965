"""Constants of laws' modules as C: the names that they have in Python, and the sentence that stands below them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate_native.source import constant_notes
from palpate_native.structs import Structs, c_name, is_struct, members


def number(value: float | bool) -> str:
    """A number as C reads it back, to the last bit."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return "NAN" if math.isnan(value) else repr(float(value))


def initial(value: Any, kind: Any) -> str:
    """A part's numbers as C initialises a struct with them."""
    if not is_struct(kind):
        return number(value)
    inner = (initial(one, of) for one, (_, of) in zip(value, members(kind), strict=True))
    return "{" + ", ".join(inner) + "}"


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

    def name(self, name: str, value: Any, kind: Any, function: Callable[..., Any]) -> str:
        """The name of a number or a part; of a table of numbers, row by row, if it has no `kind`."""
        if kind is not None:
            text = f"{self._structs.name(kind)} NAME = {initial(value, kind)};"
        else:
            flat = np.asarray(value, dtype=np.float64).ravel()
            rows = (", ".join(map(number, row.tolist())) for row in np.split(flat, range(6, len(flat), 6)))
            text = f"double NAME[{len(flat)}] = {{" + "".join(f"\n    {row}," for row in rows) + "\n};"
        if (name, text) not in self._names:
            module, note = _home(name, value, function)
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
