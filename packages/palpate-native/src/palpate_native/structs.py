"""C types of what laws pass on: numbers, parts as structs with their fields' units, tuples, and views of arrays."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

from palpate_native.source import field_notes, first_sentence

LARGE = 4
"""Numbers that a struct passes by value at most: two registers' worth more than a vector; larger ones go by pointer."""
VIEW = """/* View of numbers in memory of the caller, one behind the other{}. */
typedef struct {{
    double *at;
    int64_t shape[{}];
}} {};"""


def plain(kind: Any) -> Any:
    """A Numba type without literals in it: the type of any such value."""
    from numba import types

    kind = types.unliteral(kind)
    if isinstance(kind, types.BaseNamedTuple):
        inner = [plain(one) for one in kind.types]
        if all(one == inner[0] for one in inner):
            return types.NamedUniTuple(inner[0], len(inner), kind.instance_class)
        return types.NamedTuple(inner, kind.instance_class)
    if isinstance(kind, types.BaseTuple):
        return types.Tuple([plain(one) for one in kind.types])
    if isinstance(kind, types.Array):
        return types.Array(kind.dtype, kind.ndim, kind.layout)
    return kind


def members(kind: Any) -> list[tuple[str, Any]]:
    """Names in C and types of a tuple's fields, in their order."""
    names = getattr(kind, "fields", None) or [f"v{i}" for i in range(len(kind.types))]
    return [(c_name(name, field=True), plain(inner)) for name, inner in zip(names, kind.types, strict=True)]


def is_struct(kind: Any) -> bool:
    """Whether values of a type are structs in C."""
    from numba import types

    return isinstance(kind, types.BaseTuple)


def leaves(kind: Any) -> int:
    """How many numbers a value of a type has; of a view its pointer and its lengths."""
    if is_struct(kind):
        return sum(leaves(inner) for _, inner in members(kind))
    return 1 + getattr(kind, "ndim", 0)


def by_pointer(kind: Any) -> bool:
    """Whether functions take values of a type by a pointer to constant."""
    return is_struct(kind) and leaves(kind) > LARGE


def result_places(kind: Any) -> list[tuple[str, Any]]:
    """Places that a function with such a result writes: a large struct, or of a tuple all but its one small field."""
    large = (
        [(f"to{name[1:]}", one) for name, one in members(kind) if by_pointer(one)] if is_struct(kind) else []
    )
    if not hasattr(kind, "fields") and large and len(large) == len(kind.types) - 1:
        return large
    return [("to", kind)] if by_pointer(kind) else []


def value_type(kind: Any) -> Any:
    """The type of a function's value in C: of a tuple whose large fields it writes, the small field."""
    split = result_places(kind) not in ([], [("to", kind)])
    return next(one for _, one in members(kind) if not by_pointer(one)) if split else kind


_OF_THE_LANGUAGE = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
"""
_OF_ITS_LIBRARY = """
    main exp log pow sin cos sqrt floor fmod fabs isnan isfinite copysign y0 y1 yn j0 j1 jn gamma signal index memset
    nan NAN INFINITY I memcpy larger smaller square cube root modulo floored
"""


def c_name(name: str, field: bool = False) -> str:
    """A name of Python as one of C: no leading underscore, none that the language or its library has."""
    bare = name.strip("_") or "unnamed"
    taken = bare in _OF_THE_LANGUAGE.split() or (not field and bare in _OF_ITS_LIBRARY.split())
    taken = taken or re.fullmatch(r"to\d*", bare) is not None
    return f"{bare}_" if taken or bare != name else bare


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

    def name(self, kind: Any) -> str:
        """The C name of a type; a struct is defined when it is first named.

        Raises:
            KeyError: a type that the subset does not have.
        """
        kind = plain(kind)
        return self._names.get(kind) or self._define(kind, self.name)

    @property
    def names_in_use(self) -> set[str]:
        """Names that types have."""
        return set(self._names.values())

    def publish(self, kind: Any, name: str = "") -> str:
        """Defines a type in the header, with those inside it, under names of their own; the name there."""
        kind = plain(kind)
        short = self._names.get(kind) or self._define(kind, self.publish, name)
        return self._public.get(short, short)

    def _define(self, kind: Any, of: Callable[[Any], str], name: str = "") -> str:
        """Defines a type whose fields have types that `of` names; where that publishes, in the header."""
        text, basis = self._view(kind) if hasattr(kind, "ndim") else self._struct(kind, of)
        choices = (basis, *(f"{basis}{i}" for i in range(2, 99)))
        short = next(choice for choice in choices if choice not in self.names_in_use)
        self._names[kind] = short
        if of != self.publish:
            self.definitions.append(text.replace("NAME;", f"{short};"))
            return short
        public = self._public[short] = name or f"{self.prefix}_{short}"
        self.header.append(text.replace("NAME;", f"{public};"))
        self.definitions.append(f"typedef {public} {short};")
        return short

    def _view(self, kind: Any) -> tuple[str, str]:
        from numba import types

        if kind.dtype != types.float64 or kind.layout != "C":
            raise KeyError(kind)
        order = ["", ", row by row", ", table by table, row by row"][kind.ndim - 1]
        return VIEW.format(order, kind.ndim, "NAME"), f"array{kind.ndim}"

    def _struct(self, kind: Any, of: Callable[[Any], str]) -> tuple[str, str]:
        if not is_struct(kind):
            raise KeyError(kind)
        cls = getattr(kind, "instance_class", None)
        notes = field_notes(cls) if cls else {}
        says = first_sentence(inspect.getdoc(cls) or "") if cls and "__doc__" in vars(cls) else ""
        fields = [(field, of(one)) for field, one in members(kind)]
        lines = (
            f"    {one} {field};" + (f" /* {notes[field]} */" if field in notes else "")
            for field, one in fields
        )
        head = f"/* {says} */\n" if cls and says and not says.startswith(f"{cls.__name__}(") else ""
        joined = "_and_".join(self.name(one).removesuffix("_t") for _, one in members(kind))
        basis = c_name(cls.__name__) if cls else joined
        return f"{head}typedef struct {{\n" + "\n".join(lines) + "\n} NAME;", basis
