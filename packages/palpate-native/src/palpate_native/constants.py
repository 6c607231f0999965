"""Constants of laws' modules as C: the names that they have in Python, and the sentence that stands below them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate_native.source import constant_notes
from palpate_native.structs import Structs, c_name, initial, number, plain


class Constants:
    """The constants of one translation, each defined once.

    Args:
        structs: the types.
        claim: gives a name that nothing else in the file has: asked for name and module.
    """

    def __init__(self, structs: Structs, claim: Callable[[str, str], str]):
        self._structs, self._claim = structs, claim
        self._names: dict[str, str] = {}
        self.definitions: list[str] = []

    def name(self, name: str, value: Any, function: Callable[..., Any]) -> tuple[str, Any]:
        """The C name and the type of a number, of a part, or of a table of numbers, row by row."""
        import numba

        kind = plain(numba.typeof(value if hasattr(value, "_fields") or np.ndim(value) == 0 else np.array(value, float)))
        text = f"{self._structs.name(kind)} {name} = {initial(value, kind)};"
        if text not in self._names:
            module, note = _home(name, value, function)
            own = self._names[text] = self._claim(c_name(name), module.rpartition(".")[2])
            says = f"/* {note} */\n" if note else ""
            self.definitions.append(f"{says}static const {text.replace(f' {name}', f' {own}', 1)}")
        return self._names[text], kind


def _home(name: str, value: Any, function: Callable[..., Any]) -> tuple[str, str]:
    """The module of ours that says what the value under the name is, and the sentence; or the function's."""
    for module in list(sys.modules.values()):
        if module.__name__.startswith("palpate") and vars(module).get(name) is value:
            if note := constant_notes(str(module.__file__)).get(name):
                return module.__name__, note
    return function.__module__, ""
