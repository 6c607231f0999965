"""A law as a C module: header, source, and functions of its own beside the translated ones that call them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.native.structs import by_pointer, initial, is_struct, leaves, members, number, plain
from palpate.native.translation import Translation

MIN_LINES_OF_ONE_COPY = 8
"""Lines of C from which a copy at each call is larger than the calls: gcc and clang give the force loop 34 kB."""
MAX_COLUMNS = 118
"""Columns of a line of C, unless a name is longer."""


@dataclass(frozen=True)
class Argument:
    """A parameter of a function in the header.

    Args:
        name: of it.
        meaning: with its unit.
        shape: of an array; () for a number.
        out: whether the function writes it.
    """

    name: str
    meaning: str
    shape: tuple[int, ...] = ()
    out: bool = False

    @property
    def count(self) -> int:
        """How many numbers it is."""
        return int(np.prod(self.shape, dtype=int))

    @property
    def text(self) -> str:
        """The parameter as C has it."""
        if not self.shape:
            return f"double {self.name}"
        return f"{'' if self.out else 'const '}double {self.name}[{self.count}]"


@dataclass(frozen=True)
class Entry:
    """A function in the header.

    Args:
        name: of it, behind the prefix.
        law: of Python, called with gains, state and the arguments; one that changes a state of parts gives
            its fields back behind the value.
        meaning: of it and of its value.
        arguments: beside gains and state.
        writes: whether it has no value, but the last argument.
    """

    name: str
    law: Callable[..., Any]
    meaning: str
    arguments: tuple[Argument, ...] = ()
    writes: bool = False


@dataclass(frozen=True)
class Module:
    """A law and how it is called.

    Args:
        name: of the files and the functions, as `palpate_force`.
        title: what it is, in words.
        gains: numbers of the law, a part.
        start: the law that makes the state of the gains, or fills a flat one; or the numbers of the first state.
        entries: functions in the header.
        words: of a number of the state, by the function's name: the way to it, and a text for each of its values.
        notes: lines at the head of both files: version, hashes.
        size: numbers of a flat state that `start` fills.
    """

    name: str
    title: str
    gains: Any
    start: Callable[..., Any] | Array
    entries: tuple[Entry, ...]
    words: Mapping[str, tuple[tuple[str, ...], Mapping[float, str]]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    size: int = 0

    @property
    def flat(self) -> int:
        """Numbers of a state that is an array; 0 for one of parts."""
        return len(self.start) if isinstance(self.start, np.ndarray) else self.size


@dataclass(frozen=True)
class Sources:
    """A module in C.

    Args:
        header: text of the .h file.
        source: text of the .c file.
        numbers: in the state.
    """

    header: str
    source: str
    numbers: int


def generate_sources(module: Module) -> Sources:
    """The C of a module.

    Raises:
        OutsideSubset: a law has something that no C stands for.
    """
    return _Writer(module).sources()


class _Writer:
    """Writes a module's two files."""

    def __init__(self, module: Module):
        import numba

        self.module = module
        self.whole = Translation(module.name)
        self.kind = plain(numba.typeof(module.gains))
        self.gains = f"{module.name}_gains"
        self.whole.structs.name(self.kind, publish=True, public=self.gains)
        self.state = f"{module.name}_state"
        self.functions: list[str] = []
        self.declared: list[str] = []
        self.state_kind, self.numbers = self._publish_state()

    def _publish_state(self) -> tuple[Any, int]:
        from numba import types

        structs = self.whole.structs
        start = self.module.start
        count = self.module.flat
        if count or isinstance(start, np.ndarray):
            kind = types.Array(types.float64, 1, "C")
            structs.name(kind)
            structs.header.append(
                f"/* All that is remembered; {self.module.name}_init writes it. */\n"
                f"typedef struct {{\n    double numbers[{count}];\n}} {self.state};"
            )
            return kind, count
        kind = plain(self.whole.rules.result(start, (self.kind,)))
        structs.name(kind, publish=True, public=self.state)
        return kind, leaves(kind)

    def sources(self) -> Sources:
        """The texts of both files of the module."""
        self._init()
        for entry in self.module.entries:
            self._entry(entry)
        for name, (path, texts) in self.module.words.items():
            self._words(name, path, texts)
        default = f"{self.module.name}_default_gains"
        fields = zip(self.module.gains, members(self.kind), strict=True)
        values = ",\n    ".join(initial(value, kind) for value, (_, kind) in fields)
        table = f"const {self.gains} {default} = {{\n    {values},\n}};"
        return Sources(self._header(default), self._source(table), self.numbers)

    def _declare(self, text: str, meaning: str, arguments: tuple[Argument, ...] = ()) -> None:
        says = [meaning, *(f"{a.name}: {a.meaning}" for a in arguments)]
        self.declared.append("/* " + "\n * ".join(says) + f" */\n{text};")

    def _init(self) -> None:
        name = f"{self.module.name}_init"
        head = f"void {name}(const {self.gains} *gains, {self.state} *state)"
        self._declare(head, "The state before the first tick.")
        if isinstance(self.module.start, np.ndarray):
            self.functions.append(
                f"{_runs(name, self.module.start)}\n\n{head} {{\n{_FILL.format(name=name)}}}"
            )
            return
        flat = self.module.flat
        start = self.whole.function(self.module.start, (self.kind, self.state_kind)[: 1 + (flat > 0)])
        body = f"{start.name}(gains, {self._numbers() if flat else 'state'})"
        self.functions.append(f"{head} {{\n    {body};\n}}")

    def _numbers(self) -> str:
        """A flat state as laws see it."""
        return f"(array1){{(double *)state->numbers, {{{self.numbers}}}}}"

    def _entry(self, entry: Entry) -> None:
        from numba import types

        structs = self.whole.structs
        kinds = [
            types.Array(types.float64, len(a.shape), "C") if a.shape else types.float64
            for a in entry.arguments
        ]
        kinds = [self.kind, self.state_kind, *kinds]
        result = plain(self.whole.rules.result(entry.law, tuple(kinds)))
        inner = members(result) if is_struct(result) else []
        fields = [] if self.module.flat else members(self.state_kind)
        changes = bool(fields) and [kind for _, kind in inner[1:]] == [kind for _, kind in fields]
        public = structs.name(inner[0][1] if changes else result, publish=True)
        known = self.whole.function(entry.law, tuple(kinds))
        values = ["gains" if by_pointer(self.kind) else "*gains"]
        values.append(self._numbers() if self.module.flat else "state")
        values += [
            f"({structs.name(kind)}){{{'' if a.out else '(double *)'}{a.name}, {{{', '.join(map(str, a.shape))}}}}}"
            if a.shape
            else a.name
            for a, kind in zip(entry.arguments, kinds[2:], strict=True)
        ]
        result_name = structs.name(result)
        new = "&after" if changes else f"&({result_name}){{0}}"
        call = f"{known.name}({', '.join([*values, *([new] if by_pointer(result) else [])])})"
        constant = "" if changes or (known.writes and self.module.flat) else "const "
        arguments = [f"const {self.gains} *gains", f"{constant}{self.state} *state"]
        arguments += [argument.text for argument in entry.arguments]
        head = f"{public} {self.module.name}_{entry.name}({', '.join(arguments)})"
        self._declare(head, entry.meaning, entry.arguments)
        if changes:
            moves = [f"state->{to[0]} = after.{of[0]};" for to, of in zip(fields, inner[1:], strict=True)]
            lines = [f"{result_name} after;", f"{call};", *moves, f"return after.{inner[0][0]};"]
            body = "\n".join(f"    {line}" for line in lines)
        else:
            body = f"    {'' if public == 'void' else 'return '}{'*' if by_pointer(result) else ''}{call};"
        self.functions.append(f"{head} {{\n{body}\n}}")

    def _words(self, name: str, path: tuple[str, ...], texts: Mapping[float, str]) -> None:
        head = f"const char *{self.module.name}_{name}(const {self.state} *state)"
        self._declare(head, f"The {name} in words.")
        choices = "".join(
            f'    if (state->{".".join(path)} == {number(float(value))}) {{\n        return "{text}";\n    }}\n'
            for value, text in texts.items()
            if text
        )
        self.functions.append(f'{head} {{\n{choices}    return "";\n}}')

    def _header(self, default: str) -> str:
        guard = f"{self.module.name.upper()}_H"
        parts = [
            self._head(f"{self.module.name}.h"),
            f"#ifndef {guard}\n#define {guard}\n\n#include <stdbool.h>\n#include <stdint.h>",
            '#ifdef __cplusplus\nextern "C" {\n#endif',
            *self.whole.structs.header,
            f"/* The gains of the file that this was made of. */\nextern const {self.gains} {default};",
            *self.declared,
            f"#ifdef __cplusplus\n}}\n#endif\n\n#endif /* {guard} */\n",
        ]
        return _fold("\n\n".join(parts))

    def _source(self, table: str) -> str:
        parts = [
            self._head(f"{self.module.name}.c"),
            f'#include "{self.module.name}.h"',
            "\n".join(f"#include <{header}.h>" for header in ("float", "math", "stddef", "string")),
            _IEEE,
            *self.whole.structs.definitions,
            *self.whole.constants,
            *_one_copy(self.whole.definitions),
            table,
            *self.functions,
        ]
        return _fold("\n\n".join(parts) + "\n")

    def _head(self, file: str) -> str:
        lines = [f"// Made by palpate: {file}, {self.module.title}.", *self.module.notes]
        return "\n".join(f"// {line.removeprefix('// ')}" for line in lines)


_IEEE = """#if defined(__FAST_MATH__) || (defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16)
#error "each operation is to be that of IEEE doubles: no -ffast-math, no -mfpmath=387"
#endif
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif
#ifdef __GNUC__
#define ONE_COPY __attribute__((noinline))
#else
#define ONE_COPY
#endif"""
_FILL = """    (void)gains;
    for (size_t i = 0; i < sizeof {name}_runs / sizeof *{name}_runs; ++i) {{
        for (int64_t k = 0; k < {name}_runs[i].count; ++k) {{
            state->numbers[{name}_runs[i].at + k] = {name}_runs[i].value;
        }}
    }}
"""


def _one_copy(definitions: Sequence[str]) -> list[str]:
    """Functions, marked where they are long and called twice: compilers else put a copy at each call."""
    text = "\n".join(definitions)
    marked = []
    for each in definitions:
        head = re.search(r"^static .*?(\w+)\(", each, re.MULTILINE)
        long = head and each.count("\n", head.start()) > MIN_LINES_OF_ONE_COPY
        calls = len(re.findall(rf"\b{head[1]}\(", text)) - 1 if head else 0
        marked.append(each.replace("static ", "static ONE_COPY ", 1) if long and calls > 1 else each)
    return marked


def _runs(name: str, numbers: Array) -> str:
    """Numbers of a first state as runs of equal ones."""
    words = numbers.view(np.int64)
    begins = [0, *(1 + np.flatnonzero(words[1:] != words[:-1])).tolist(), len(numbers)]
    runs = ((at, end - at, number(float(numbers[at]))) for at, end in pairwise(begins))
    rows = "".join(f"    {{{at}, {count}, {value}}},\n" for at, count, value in runs)
    return (
        f"static const struct {{\n    int64_t at, count;\n    double value;\n}} {name}_runs[] = {{\n{rows}}};"
    )


_BREAKS = (", ", " && ", " || ", " + ", " ? ", " : ", " /* ", " = ")
"""Signs before or behind which a line of C may be broken, the best first."""


def _fold(text: str) -> str:
    """Lines of C broken behind commas and before operators of conditions where they are too long."""
    return "\n".join(piece for line in text.split("\n") for piece in _pieces(line))


def _pieces(line: str) -> list[str]:
    if len(line) <= MAX_COLUMNS or line.startswith(("//", " *", "#")) or '"' in line:
        return [line]
    indent = line[: len(line) - len(line.lstrip())]
    pieces = []
    deeper = indent + "    "
    while len(line) > MAX_COLUMNS:
        places = [line.rfind(sign, len(deeper) + 8, MAX_COLUMNS) for sign in _BREAKS]
        strong = max(places[:3])
        place = strong if strong > MAX_COLUMNS // 2 else max(places)
        if place < 0:
            break
        cut = place + (1 if line[place] == "," else 0)
        pieces.append(line[:cut])
        line = deeper + line[cut:].lstrip()
    return [*pieces, line]
