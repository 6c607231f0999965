"""Laws as one C file: every function that the entry calls, once for each set of types that Numba infers for it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

from palpate._jit.typing_rules import TypingRules
from palpate.native.constants import Constants
from palpate.native.source import place_of, refuse, syntax_of
from palpate.native.statements import FunctionBody
from palpate.native.structs import Structs, by_pointer, c_name, is_struct, members, plain

HELPERS = {
    ("larger", "double"): "(double a, double b) { return b > a ? b : a; }",
    ("smaller", "double"): "(double a, double b) { return b < a ? b : a; }",
    ("larger", "int64_t"): "(int64_t a, int64_t b) { return b > a ? b : a; }",
    ("smaller", "int64_t"): "(int64_t a, int64_t b) { return b < a ? b : a; }",
    ("square", "double"): "(double x) { return x * x; }",
    ("cube", "double"): "(double x) { return x * (x * x); }",
    ("root", "double"): "(double x) { return x == -INFINITY ? INFINITY : fabs(sqrt(x)); }",
    ("modulo", "int64_t"): "(int64_t a, int64_t b) {\n    int64_t rest = a % b;\n"
    "    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;\n}",
    ("floored", "int64_t"): "(int64_t a, int64_t b) { return a / b - (a % b != 0 && (a % b < 0) != (b < 0)); }",
    ("modulo", "double"): """(double a, double b) {
    double rest = fmod(a, b);
    if (b == 0.0) {
        return rest;
    }
    if (rest != 0.0) {
        return (b < 0.0) != (rest < 0.0) ? rest + b : rest;
    }
    return b < 0.0 ? -0.0 : 0.0;
}""",
    ("floored", "double"): """(double a, double b) {
    double rest = fmod(a, b), whole = (a - rest) / b, down;
    if (b == 0.0) {
        return a / b;
    }
    if (rest != 0.0 && (b < 0.0) != (rest < 0.0)) {
        whole -= 1.0;
    }
    if (!(whole < 0.0 || whole > 0.0)) {
        return whole * whole * a / b;
    }
    down = floor(whole);
    return whole - down > 0.5 ? down + 1.0 : down;
}""",
}  # fmt: skip
"""Operators whose meaning in Python is not that of one in C, as Numba compiles them."""
_SAYS = {
    "larger": "The larger of two, as Python's max: the first where they are equal or not comparable.",
    "smaller": "The smaller of two, as Python's min.",
    "square": "x ** 2.",
    "cube": "x ** 3.",
    "root": "x ** 0.5.",
    "modulo": "a % b with Python's sign, that of b.",
    "floored": "a // b of Python: rounded down.",
}


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
        self.real, self.integer, self.boolean = types.float64, types.int64, types.boolean
        self.structs = Structs(prefix)
        self._claimed: set[str] = set()
        self.constants = Constants(self.structs, self._claim)
        self._functions: dict[Any, Translated | None] = {}
        self._helpers: dict[tuple[str, str], str] = {}
        self.definitions: list[str] = []

    def function(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> Translated:
        """The C function of a law or a method given arguments of such types.

        Raises:
            OutsideSubset: it has something that the subset has not.
        """
        kinds = tuple(plain(kind) for kind in kinds)
        key = (function, kinds)
        if key not in self._functions:
            self._functions[key] = None
            self._functions[key] = self._translate(function, kinds)
        known = self._functions[key]
        if known is None:
            refuse(function, syntax_of(function), "a function that calls itself", "write a loop")
        return known

    def _translate(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> Translated:
        result = plain(self.rules.result(function, kinds))
        body = FunctionBody(self, function, kinds, result)
        try:
            for kind in (*kinds, result):
                self.structs.name(kind)
            part = function.__qualname__.rpartition(".")[0].rpartition(".")[2]
            method = part and "<locals>" not in function.__qualname__
            name = c_name(f"{part}_{function.__name__.strip('_')}" if method else function.__name__)
            structs = [self.structs.name(kind) for kind in kinds if is_struct(kind)]
            name = self._claim(name, structs[0] if structs else "again")
            text = body.text(name)
        except KeyError as error:
            refuse(
                function,
                body.tree,
                f"a value of type {error.args[0]}",
                "use numbers, truths, parts, float arrays",
            )
        says = [*_docstring(function), place_of(function)]
        comment = "\n".join(f" * {line}".rstrip() for line in says).removeprefix(" * ")
        self.definitions.append(f"/* {comment} */\n{text}")
        return Translated(name, result, body.writes)

    def implementation(self, callee: Any, kinds: tuple[Any, ...]) -> Callable[..., Any] | None:
        """The Python function that Numba compiles for a call with such types; None if it knows none."""
        return self.rules.implementation(callee, kinds)

    def signature(self, callee: Any, kinds: tuple[Any, ...]) -> Any:
        """Numba's types of the operands and of the value of an operation on numbers."""
        return self.rules.signature(callee, kinds)

    def helper(self, name: str, kind: Any) -> str:
        """The name of a function that stands for one of Python's operators."""
        key = (name, self.structs.name(kind))
        if key not in self._helpers:
            own = self._claim(name, f"of_{key[1].removesuffix('_t')}")
            self._helpers[key] = own
            text = f"static {key[1]} {own}{HELPERS[key]}"
            self.definitions.append(f"/* {_SAYS[name]} */\n{text}")
        return self._helpers[key]

    def selector(self, kind: Any) -> str:
        """The name of a function that gives a field of a struct by its place."""
        own = self.structs.name(kind)
        key = ("at", own)
        if key not in self._helpers:
            name = self._helpers[key] = self._claim(f"{own}_at", "again")
            fields, inner = members(kind), self.structs.name(members(kind)[0][1])
            dot, given = ("->", f"const {own} *") if by_pointer(kind) else (".", f"{own} ")
            choices = " : ".join(f"i == {k} ? v{dot}{field}" for k, (field, _) in enumerate(fields[:-1]))
            self.definitions.append(
                f"static {inner} {name}({given}v, int64_t i) {{\n    return {choices} : v{dot}{fields[-1][0]};\n}}"
            )
        return self._helpers[key]

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
