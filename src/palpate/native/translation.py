"""Laws as one C file: every function that the entry calls, once for each set of types that Numba infers for it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate._jit.kernels import TypingRules
from palpate.native.source import comment_text, constant_home, locate_line, parse_function, refuse
from palpate.native.statements import FunctionBody
from palpate.native.structs import Structs, c_name, initial, plain

_OPERATOR = re.compile(r"/\* .* \*/\nstatic (?:const )?(\w+) \*?(\w+)\((?:.+\n)+")
OPERATORS = {
    (match[2], match[1]): match[0].rstrip()
    for match in _OPERATOR.finditer(Path(__file__).with_name("operators.c").read_text(encoding="utf-8"))
}
"""Functions in C for operators of Python that C has not, by name and type of the value; TYPE stands for any."""


class Translation:
    """Translates laws into C.

    Args:
        prefix: of the names in the header, as `palpate_force`.
    """

    def __init__(self, prefix: str):
        from numba import types

        self.rules = TypingRules()
        self.typing = self.rules.context
        self.real = types.float64
        self.integer = types.int64
        self.boolean = types.boolean
        self.none = types.none
        self.kinds = {bool: self.boolean, int: self.integer, float: self.real, np.float64: self.real}
        self._taken: set[str] = set()
        self.structs = Structs(prefix, self._claim)
        self._constants: dict[str, str] = {}
        self._functions: dict[Any, FunctionBody] = {}
        self._helpers: dict[tuple[str, str], str] = {}
        self.constants: list[str] = []
        self.definitions: list[str] = []

    def function(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> FunctionBody:
        """The C function of a law or a method given arguments of such types.

        Raises:
            OutsideSubset: it has something that the subset has not.
        """
        from numba.core.errors import NumbaError

        key = (function, tuple(plain(kind) for kind in kinds))
        if key not in self._functions:
            try:
                body = self._functions[key] = FunctionBody(self, *key, plain(self.rules.result(*key)))
                names = [self.structs.name(kind) for kind in (*key[1], body.result)]
                name = re.sub(r"\._*(\w*?)_*$", r"_\1", function.__qualname__.rpartition("<locals>.")[2])
                body.name = self._claim(c_name(name), names[0])
                text = body.text()
            except (KeyError, NumbaError) as error:
                kind = f"type {error.args[0]}" if isinstance(error, KeyError) else "no type that Numba infers"
                remedy = "use numbers, truths, parts, float arrays"
                refuse(function, parse_function(function), f"a value of {kind}", remedy)
            doc = comment_text(inspect.cleandoc(function.__doc__ or ""))
            says = f"{doc}\n\n{locate_line(function, function.__code__.co_firstlineno)}".lstrip()
            comment = "\n".join(f" * {line}".rstrip() for line in says.split("\n")).removeprefix(" * ")
            self.definitions.append(f"/* {comment} */\n{text}")
        return self._functions[key]

    def helper(self, name: str, kind: Any) -> str:
        """The name of a function of `operators.c` for values of a type."""
        of = self.structs.name(kind)
        if (name, of) not in self._helpers:
            text = next(
                OPERATORS[name, c_type] for c_type in (of, "TYPE", "void") if (name, c_type) in OPERATORS
            )
            helper_name = self._claim(name.replace("TYPE", of), f"of_{of.removesuffix('_t')}")
            self.definitions.append(text.replace(f"{name}(", f"{helper_name}(", 1).replace("TYPE", of))
            self._helpers[name, of] = helper_name
        return self._helpers[name, of]

    def constant(self, name: str, value: Any, function: Callable[..., Any]) -> tuple[str, Any]:
        """The C name and the type of a number, a part, or a table of numbers that laws' modules name."""
        import numba

        table = not hasattr(value, "_fields") and np.ndim(value) > 0
        kind = plain(numba.typeof(np.array(value, float) if table else value))
        text = f"{self.structs.name(kind)} {name} = {initial(value, kind)};"
        if text not in self._constants:
            module, note = constant_home(name, value, function)
            constant_name = self._constants[text] = self._claim(c_name(name), module.rpartition(".")[2])
            says = f"/* {note} */\n" if note else ""
            self.constants.append(f"{says}static const {text.replace(f' {name}', f' {constant_name}', 1)}")
        return self._constants[text], kind

    def _claim(self, name: str, beside: str = "again") -> str:
        """A name that nothing else of the file has: the name, that with another beside it, or with a number."""
        choices = (name, f"{name}_{beside}", *(f"{name}_{beside}{k}" for k in range(2, 999)))
        claimed = next(choice for choice in choices if choice not in self._taken)
        self._taken.add(claimed)
        return claimed
