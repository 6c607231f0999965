"""C types of what laws pass on: numbers, parts as structs with their fields' units, tuples, and views of arrays."""

from __future__ import annotations

import inspect
from typing import Any

from palpate.native.source import field_notes, first_sentence

LARGE = 4
"""Numbers that a struct passes by value at most: two registers' worth more than a vector; larger ones go by pointer."""
VIEW = (
    "/* View of {0} numbers in memory of the caller: {1}. */\n"
    "typedef struct {{\n    double *at;\n    int64_t shape[{2}];\n}} array{2};"
)


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


_OF_THE_LANGUAGE = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
"""
_OF_ITS_LIBRARY = """
    main exp log pow sin cos sqrt floor fmod fabs isnan isfinite copysign y0 y1 yn j0 j1 jn gamma signal index memset
    nan NAN INFINITY I
"""
_KEYWORDS, _LIBRARY = frozenset(_OF_THE_LANGUAGE.split()), frozenset(_OF_ITS_LIBRARY.split())


def c_name(name: str, field: bool = False) -> str:
    """A name of Python as one of C: no leading underscore, none that the language or its library has."""
    bare = name.strip("_") or "unnamed"
    taken = bare in _KEYWORDS or (not field and bare in _LIBRARY)
    return f"{bare}_" if taken or bare != name else bare


class Structs:
    """The struct types of one translation, each defined after those inside it.

    Args:
        prefix: of the names of those in the header, as `palpate_force`.
    """

    def __init__(self, prefix: str):
        self.prefix = prefix
        self._names: dict[Any, str] = {}
        self._public: dict[str, str] = {}
        self.definitions: list[str] = []
        self.header: list[str] = []

    def name(self, kind: Any) -> str:
        """The C name of a type; a struct is defined when it is first named.

        Raises:
            KeyError: a type that the subset does not have.
        """
        from numba import types

        kind = plain(kind)
        scalars = {types.float64: "double", types.int64: "int64_t", types.boolean: "bool", types.none: "void"}
        if kind in scalars:
            return scalars[kind]
        if kind not in self._names:
            if isinstance(kind, types.Array):
                self._names[kind] = self._define_view(kind)
            elif is_struct(kind):
                self._names[kind] = self._define(kind)
            else:
                raise KeyError(kind)
        return self._names[kind]

    @property
    def names_in_use(self) -> set[str]:
        """Names that types have."""
        return set(self._names.values())

    def publish(self, kind: Any, name: str = "") -> str:
        """Defines a type in the header, with those inside it, under names of their own; the name there."""
        from numba import types

        kind = plain(kind)
        if isinstance(kind, types.Array) and kind not in self._names:
            short = self._define_view(kind)
            public = f"{self.prefix}_{short}"
            self.header.append(self.definitions.pop().replace(f"}} {short};", f"}} {public};"))
            self.definitions.append(f"typedef {public} {short};")
            self._names[kind], self._public[short] = short, public
        if not is_struct(kind):
            name = self.name(kind)
            return self._public.get(name, name)
        if kind not in self._names:
            inner = [(field, self.publish(one)) for field, one in members(kind)]
            short = self._free_name(self._basis(kind))
            public = name or f"{self.prefix}_{short}"
            self.header.append(self._text(kind, inner, public))
            self.definitions.append(f"typedef {public} {short};")
            self._names[kind], self._public[short] = short, public
        return self._public[self._names[kind]]

    def _define_view(self, kind: Any) -> str:
        from numba import types

        if kind.dtype != types.float64 or kind.layout != "C":
            raise KeyError(kind)
        order = {1: "", 2: ", row by row", 3: ", table by table, row by row"}[kind.ndim]
        self.definitions.append(VIEW.format("so many", f"one behind the other{order}", kind.ndim))
        return f"array{kind.ndim}"

    def _define(self, kind: Any) -> str:
        inner = [(field, self.name(one)) for field, one in members(kind)]
        short = self._free_name(self._basis(kind))
        self.definitions.append(self._text(kind, inner, short))
        return short

    def _basis(self, kind: Any) -> str:
        cls = getattr(kind, "instance_class", None)
        if cls is not None:
            return c_name(cls.__name__)
        return "_and_".join(self.name(one).removesuffix("_t") for _, one in members(kind))

    def _free_name(self, basis: str) -> str:
        return next(
            name for name in (basis, *(f"{basis}{i}" for i in range(2, 99))) if name not in self.names_in_use
        )

    def _text(self, kind: Any, inner: list[tuple[str, str]], name: str) -> str:
        cls = getattr(kind, "instance_class", None)
        notes = field_notes(cls) if cls is not None else {}
        says = first_sentence(inspect.getdoc(cls) or "") if cls is not None and "__doc__" in vars(cls) else ""
        if cls is None or says.startswith(f"{cls.__name__}("):
            says = ""
        lines = [f"    {of} {field};" + _comment(notes.get(field, "")) for field, of in inner]
        return (f"/* {says} */\n" if says else "") + "typedef struct {\n" + "\n".join(lines) + f"\n}} {name};"


def _comment(text: str) -> str:
    return f" /* {text} */" if text else ""
