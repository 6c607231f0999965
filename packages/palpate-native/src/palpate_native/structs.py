"""C types of what laws pass on: numbers, parts as structs with their fields' units, tuples, and views of arrays."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np

from palpate_native.source import field_notes, first_sentence

LARGE = 4
"""Numbers that a struct passes by value at most: two registers' worth more than a vector; larger ones go by pointer."""
VIEW = """/* View of numbers in memory of the caller, one behind the other{}. */
typedef struct {{
    double *at;
    int64_t shape[{}];
}} NAME;"""
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

    kind = types.unliteral(kind)
    if is_struct(kind):
        named = getattr(kind, "instance_class", None)
        return types.BaseTuple.from_types(tuple(plain(one) for one in kind.types), named)
    return types.Array(kind.dtype, kind.ndim, kind.layout) if isinstance(kind, types.Array) else kind


def is_struct(kind: Any) -> bool:
    """Whether values of a type are structs in C."""
    return hasattr(kind, "types")


def members(kind: Any) -> list[tuple[str, Any]]:
    """Names in C and types of a tuple's fields, in their order."""
    names = getattr(kind, "fields", None) or [f"v{i}" for i in range(len(kind.types))]
    return [(c_name(name, field=True), plain(inner)) for name, inner in zip(names, kind.types, strict=True)]


def leaves(kind: Any) -> int:
    """How many numbers a value of a type has; of a view its pointer and its lengths."""
    if is_struct(kind):
        return sum(leaves(inner) for _, inner in members(kind))
    return 1 + getattr(kind, "ndim", 0)


def by_pointer(kind: Any) -> bool:
    """Whether functions take values of a type by a pointer to constant, and write them where a pointer says."""
    return is_struct(kind) and leaves(kind) > LARGE


def c_name(name: str, field: bool = False) -> str:
    """A name of Python as one of C: no leading underscore, none that the language or its library has."""
    bare = name.strip("_") or "unnamed"
    taken = bare in _OF_THE_LANGUAGE.split() or (not field and bare in _OF_ITS_LIBRARY.split())
    return f"{bare}_" if taken or bare != name else bare


def number(value: float | bool) -> str:
    """A number as C reads it back, to the last bit."""
    text = str(value) if isinstance(value, int | np.bool_) else repr(float(value))
    return _NUMBERS.get(text, text)


def initial(value: Any, kind: Any) -> str:
    """A value as C initialises a variable of its type with it."""
    if is_struct(kind):
        inner = [initial(one, of) for one, (_, of) in zip(value, members(kind), strict=True)]
    elif hasattr(kind, "ndim"):
        table = np.asarray(value, dtype=float)
        numbers = "".join(f"\n    {', '.join(map(number, row))}," for row in table.reshape(-1, table.shape[-1]).tolist())
        inner = [f"(double *)(const double[]){{{numbers}\n}}", f"{{{', '.join(map(str, table.shape))}}}"]
    else:
        return number(value)
    return "{" + ", ".join(inner) + "}"


class Structs:
    """The struct types of one translation, each defined after those inside it.

    Args:
        prefix: of the names of those in the header, as `palpate_force`.
    """

    def __init__(self, prefix: str):
        from numba import types

        self.prefix = prefix
        self._names: dict[Any, str] = {
            types.float64: "double", types.int64: "int64_t", types.boolean: "bool", types.none: "void"
        }  # fmt: skip
        self._public: dict[str, str] = {}
        self.definitions: list[str] = []
        self.header: list[str] = []

    @property
    def names_in_use(self) -> set[str]:
        """Names that types have."""
        return set(self._names.values())

    def name(self, kind: Any, publish: bool = False, public: str = "") -> str:
        """The C name of a type; a struct is defined when it is first named.

        Args:
            kind: the type.
            publish: whether to define it in the header, with those inside it.
            public: its name there; the prefix and its own name if none is given.

        Raises:
            KeyError: a type that the subset does not have.
        """
        kind = plain(kind)
        if kind not in self._names:
            text, basis = self._struct(kind, publish) if is_struct(kind) else self._view(kind)
            choices = (basis, *(f"{basis}{i}" for i in range(2, 999)))
            short = self._names[kind] = next(one for one in choices if one not in self.names_in_use)
            if publish:
                own = self._public[short] = public or f"{self.prefix}_{short}"
                self.header.append(text.replace("NAME;", f"{own};"))
                text = f"typedef {own} NAME;"
            self.definitions.append(text.replace("NAME;", f"{short};"))
        short = self._names[kind]
        return self._public.get(short, short) if publish else short

    def _view(self, kind: Any) -> tuple[str, str]:
        from numba import types

        if not isinstance(kind, types.Array) or kind.dtype != types.float64 or kind.layout != "C":
            raise KeyError(kind)
        order = ["", ", row by row", ", table by table, row by row"][kind.ndim - 1]
        return VIEW.format(order, kind.ndim), f"array{kind.ndim}"

    def _struct(self, kind: Any, publish: bool) -> tuple[str, str]:
        fields = [(field, self.name(one, publish)) for field, one in members(kind)]
        if not hasattr(kind, "fields"):
            lines = [f"    {of} {field};" for field, of in fields]
            basis = "_and_".join(self.name(one).removesuffix("_t") for _, one in members(kind))
            says = ""
        else:
            cls = kind.instance_class
            notes = {name: f" /* {note} */" for name, note in field_notes(cls).items()}
            lines = [f"    {of} {field};{notes.get(field, '')}" for field, of in fields]
            basis, text = c_name(cls.__name__), first_sentence(vars(cls).get("__doc__") or "")
            says = "" if text.startswith(f"{cls.__name__}(") or not text else f"/* {text} */\n"
        return f"{says}typedef struct {{\n" + "\n".join(lines) + "\n} NAME;", basis
