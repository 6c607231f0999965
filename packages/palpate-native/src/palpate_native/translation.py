"""Laws as one C file: every function that the entry calls, once for each set of types that Numba infers for it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate._jit.typing_rules import TypingRules
from palpate_native.constants import Constants
from palpate_native.source import place_of, refuse, syntax_of
from palpate_native.statements import FunctionBody
from palpate_native.structs import Structs, by_pointer, c_name, is_struct, members, plain

_OPERATOR = re.compile(r"/\* (?P<says>.*) \*/\nstatic (?P<of>\w+) (?P<name>\w+)(?P<body>(?:.+\n)+)")
OPERATORS = {
    (found["name"], found["of"]): found
    for found in _OPERATOR.finditer(Path(__file__).with_name("operators.c").read_text(encoding="utf-8"))
}
"""Operators whose meaning in Python is not that of one in C: a function in C for each and each type of its value."""


class Translated(NamedTuple):
    """A function in C.

    Args:
        name: of it.
        result: Numba's type of its value.
        writes: whether it writes to an array that it is given.
    """

    name: str
    result: Any
    writes: bool


class Translation:
    """Translates laws into C.

    Args:
        prefix: of the names in the header, as `palpate_force`.
    """

    def __init__(self, prefix: str):
        from numba import types

        self.rules = TypingRules()
        self.typing = self.rules.context
        self.real, self.integer = types.float64, types.int64
        self.boolean, self.none = types.boolean, types.none
        self.kinds = {bool: self.boolean, int: self.integer, float: self.real, np.float64: self.real}
        self.structs = Structs(prefix)
        self._claimed: set[str] = set()
        self.constants = Constants(self.structs, self._claim)
        self._functions: dict[Any, Translated | None] = {}
        self._helpers: dict[str, str] = {}
        self.definitions: list[str] = []

    def type_of(self, value: Any) -> Any:
        """The type of a Python number or part."""
        import numba

        return plain(numba.typeof(value))

    def function(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> Translated:
        """The C function of a law or a method given arguments of such types.

        Raises:
            OutsideSubset: it has something that the subset has not.
        """
        key = (function, tuple(plain(kind) for kind in kinds))
        if key not in self._functions:
            self._functions[key] = None
            self._functions[key] = self._translate(*key)
        known = self._functions[key]
        if known is None:
            refuse(function, syntax_of(function), "a function that calls itself", "write a loop")
        return known

    def _translate(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> Translated:
        result = plain(self.rules.result(function, kinds))
        body = FunctionBody(self, function, kinds, result)
        try:
            names = [self.structs.name(kind) for kind in (*kinds, result)]
            part = function.__qualname__.rpartition(".")[0].rpartition(".")[2]
            method = part and "<locals>" not in function.__qualname__
            own = c_name(f"{part}_{function.__name__.strip('_')}" if method else function.__name__)
            beside = next(
                (name for name, kind in zip(names, kinds, strict=False) if is_struct(kind)), "again"
            )
            own = self._claim(own, beside)
            text = body.text(own)
        except KeyError as error:
            remedy = "use numbers, truths, parts, float arrays"
            refuse(function, body.tree, f"a value of type {error.args[0]}", remedy)
        says = [*_docstring(function), place_of(function)]
        comment = "\n".join(f" * {line}".rstrip() for line in says).removeprefix(" * ")
        self.definitions.append(f"/* {comment} */\n{text}")
        return Translated(own, result, body.writes)

    def helper(self, name: str, kind: Any) -> str:
        """The name of a function that stands for one of Python's operators."""
        of = self.structs.name(kind)
        found = OPERATORS[name, of]
        text = f"/* {found['says']} */\nstatic {of} NAME{found['body'].rstrip()}"
        return self._once(name, f"of_{of.removesuffix('_t')}", text)

    def storage(self, kind: Any, reads: bool) -> str:
        """The name of a function that reads a part from the beginning of an array, or writes it there."""
        of = self.structs.name(kind)
        if reads:
            head, body = f"{of} from", f"memcpy(to, a.at, sizeof({of}));\n    return to;"
            return self._once(f"read_{of}", "again", f"""/* A {head} the beginning of an array. */
static const {of} *NAME(array1 a, {of} *to) {{\n    {body}\n}}""")
        head, body = f"{of} to", f"memcpy(a.at, v, sizeof({of}));"
        return self._once(f"write_{of}", "again", f"""/* A {head} the beginning of an array. */
static void NAME(array1 a, const {of} *v) {{\n    {body}\n}}""")

    def selector(self, kind: Any) -> str:
        """The name of a function that gives a field of a struct by its place."""
        of, inner = self.structs.name(kind), self.structs.name(members(kind)[0][1])
        dot, given = ("->", f"const {of} *v") if by_pointer(kind) else (".", f"{of} v")
        *first, last = (f"v{dot}{field}" for field, _ in members(kind))
        choices = "".join(f"i == {k} ? {field} : " for k, field in enumerate(first))
        text = f"static {inner} NAME({given}, int64_t i) {{\n    return {choices}{last};\n}}"
        return self._once(f"{of}_at", "again", text)

    def _once(self, name: str, beside: str, text: str) -> str:
        """The name of a function that stands in the file once, written with NAME in its place."""
        if text not in self._helpers:
            self._helpers[text] = self._claim(name, beside)
            self.definitions.append(text.replace("NAME", self._helpers[text], 1))
        return self._helpers[text]

    def _claim(self, name: str, beside: str) -> str:
        """A name that nothing else of the file has: the name, that with another beside it, or with a number."""
        choices = (name, f"{name}_{beside}", *(f"{name}_{beside}{k}" for k in range(2, 999)))
        taken = {*self._claimed, *self.structs.names_in_use}
        own = next(choice for choice in choices if choice not in taken)
        self._claimed.add(own)
        return own


def _docstring(function: Callable[..., Any]) -> list[str]:
    """Lines of a function's own docstring, an empty one behind them; none where it has none."""
    text = inspect.cleandoc(function.__doc__ or "").replace("*/", "* /").replace("/*", "/ *")
    return [*text.split("\n"), ""] if text else []
