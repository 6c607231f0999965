"""C types of what laws pass on: numbers, parts as structs with their fields' units, tuples, and views of arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.native.source import field_notes, first_sentence

MAX_NUMBERS_BY_VALUE = 4
"""Numbers that a struct passes by value at most: two registers' worth more than a vector; larger ones go by pointer."""
VIEW = """/* View of numbers in memory of the caller, one behind the other{}. */
typedef struct {{
    double *at;
    int64_t shape[{}];
}}"""
_OF_THE_LANGUAGE = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
    to
"""
_OF_ITS_LIBRARY = """
    main exp log pow sin cos sqrt floor fmod fabs isnan isfinite copysign y0 y1 yn j0 j1 jn gamma signal index memset
    nan NAN INFINITY I memcpy larger smaller square cube root modulo floored
"""

_NUMBERS = {"inf": "INFINITY", "-inf": "-INFINITY", "nan": "NAN", "True": "true", "False": "false"}


def plain(kind: Any) -> Any:
    """A Numba type without literals in it: the type of any such value."""
    from numba import types

    return types.unliteral(kind)


def is_struct(kind: Any) -> bool:
    """True if values of a type are structs in C."""
    return hasattr(kind, "types")


def members(kind: Any) -> list[tuple[str, Any]]:
    """Names in C and types of a tuple's fields, in their order."""
    names = getattr(kind, "fields", None) or [f"v{i}" for i in range(len(kind.types))]
    return [(c_name(name, field=True), plain(inner)) for name, inner in zip(names, kind.types, strict=True)]


def leaves(kind: Any) -> int:
    """Count of numbers in a value of a type; of a view its pointer and its length."""
    if is_struct(kind):
        return sum(leaves(inner) for _, inner in members(kind))
    return 1 + getattr(kind, "ndim", 0)


def by_pointer(kind: Any) -> bool:
    """True if functions take values of a type by a pointer to constant, and write them where a pointer says."""
    return leaves(kind) > MAX_NUMBERS_BY_VALUE


def c_name(name: str, field: bool = False) -> str:
    """A name of Python as one of C: no leading underscore, none that the language or its library has."""
    bare = name.strip("_")
    taken = bare in _OF_THE_LANGUAGE.split() or (not field and bare in _OF_ITS_LIBRARY.split())
    return f"{bare}_" if taken or bare != name else bare


def number(value: float | bool) -> str:
    """A number as C reads it back, to the last bit."""
    return _NUMBERS.get(str(value), str(value))


def initial(value: Any, kind: Any) -> str:
    """A value as C initialises a variable of its type with it."""
    if is_struct(kind):
        inner = [initial(field, of) for field, (_, of) in zip(value, members(kind), strict=True)]
    elif hasattr(kind, "ndim"):
        table = np.asarray(value)
        numbers = "".join(
            f"\n    {', '.join(map(number, row))}," for row in table.reshape(-1, table.shape[-1]).tolist()
        )
        inner = [f"(double *)(const double[]){{{numbers}\n}}", f"{{{', '.join(map(str, table.shape))}}}"]
    else:
        return number(value)
    return "{" + ", ".join(inner) + "}"


class Structs:
    """The struct types of one translation, each defined after those inside it.

    Args:
        prefix: of the names of those in the header, as `palpate_force`.
        claim: gives a name that nothing else in the file has.
    """

    def __init__(self, prefix: str, claim: Callable[[str], str]):
        from numba import types

        self._prefix = prefix
        self._claim = claim
        self._names: dict[Any, str] = {
            types.float64: "double",
            types.int64: "int64_t",
            types.boolean: "bool",
            types.none: "void",
        }
        self._public: dict[str, str] = {}
        self.definitions: list[str] = []
        self.header: list[str] = []

    def name(self, kind: Any, publish: bool = False, public: str = "") -> str:
        """The C name of a type; a struct is defined when it is first named.

        Args:
            kind: the type.
            publish: whether to define it in the header, with those inside it.
            public: its name there; the prefix and its own name if none is given.

        Raises:
            KeyError: a type that the subset does not have.
        """
        if kind not in self._names:
            name, text = self._struct(kind, publish) if is_struct(kind) else self._view(kind)
            short = self._names[kind] = self._claim(name)
            if publish:
                public_name = self._public[short] = public or f"{self._prefix}_{short}"
                self.header.append(f"{text} {public_name};")
                text = f"typedef {public_name}"
            self.definitions.append(f"{text} {short};")
        short = self._names[kind]
        return self._public.get(short, short) if publish else short

    def _view(self, kind: Any) -> tuple[str, str]:
        if getattr(kind, "layout", "") != "C" or self._names[kind.dtype] != "double" or kind.ndim > 3:
            raise KeyError(kind)
        order = ["", ", row by row", ", table by table, row by row"][kind.ndim - 1]
        return f"array{kind.ndim}", VIEW.format(order, kind.ndim)

    def _struct(self, kind: Any, publish: bool) -> tuple[str, str]:
        cls: Any = getattr(kind, "instance_class", None)
        notes = {field: f" /* {note} */" for field, note in field_notes(cls).items()} if cls else {}
        fields = [
            f"    {self.name(of, publish)} {field};{notes.get(field, '')}" for field, of in members(kind)
        ]
        text = first_sentence(vars(cls).get("__doc__") or "") if cls else ""
        says = "" if not text or text.startswith(f"{cls.__name__}(") else f"/* {text} */\n"
        inside = "_and_".join(self.name(of).removesuffix("_t") for _, of in members(kind))
        return c_name(cls.__name__) if cls else inside, "\n".join([f"{says}typedef struct {{", *fields, "}"])
