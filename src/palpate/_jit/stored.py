"""Parts whose numbers lie one behind the other in an array: read and written at once, not number by number.

To name each of a hundred numbers in a kernel costs the compiler as much as the law that they are for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import repeat
from typing import Any, get_type_hints

from palpate._jit.registry import stored

_known: set[Callable[..., Any]] = set()
"""Those that Numba knows."""


def places(part: type, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Names of every number of a part, from the outermost field in, in their order."""
    fields = get_type_hints(part) if part is not float else {}
    return [place for name, kind in fields.items() for place in places(kind, (*path, name))] or [path]


def leaves(tree: Any) -> Iterator[float]:
    """Every number of nested tuples, in their order."""
    for branch in tree:
        if isinstance(branch, tuple):
            yield from leaves(branch)
        else:
            yield float(branch)


def reader(part: type) -> Callable[[Any], Any]:
    """A law that makes a part, of numbers and parts of them, of an array that begins with its numbers."""

    def read(a: Any) -> Any:
        return _make_part(part, iter(a))

    stored[read] = part, True
    return read


def writer(part: type) -> Callable[[Any, Any], None]:
    """A law that puts a part's numbers at the beginning of an array."""

    def write(a: Any, value: Any) -> None:
        for i, number in enumerate(leaves(value)):
            a[i] = number

    stored[write] = part, False
    return write


def _make_part(part: type, numbers: Iterator[Any]) -> Any:
    kinds = get_type_hints(part).values()
    return part(*(float(next(numbers)) if kind is float else _make_part(kind, numbers) for kind in kinds))


def kind_of(part: type) -> Any:
    """Numba's type of a part of numbers and parts of them."""
    import numba

    return numba.typeof(_make_part(part, repeat(0.0)))


def hand_over() -> None:
    """Tells Numba what those registered since the last time do: a load, or a store, of the whole part."""
    from numba.extending import overload

    from palpate._jit.inline_compiler import inside

    for function in [one for one in stored if one not in _known]:
        part, reads = stored[function]
        _known.add(function)
        meaning = _reading(_load(kind_of(part))) if reads else _writing(_store(kind_of(part)))
        overload(function, strict=False, jit_options=inside())(meaning)


def _reading(load: Any) -> Callable[..., Any]:
    return lambda a: lambda a: load(a)  # noqa: ARG005 - Numba goes by the names


def _writing(store: Any) -> Callable[..., Any]:
    return lambda a, value: lambda a, value: store(a, value)  # noqa: ARG005 - likewise


def _load(kind: Any) -> Any:
    from numba.extending import intrinsic

    @intrinsic
    def load(typing: Any, a: Any) -> Any:
        def lowered(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.load(_place(context, builder, signature, args, kind), align=8)

        return (kind(a), lowered) if _is_plain(a) else None

    return load


def _store(kind: Any) -> Any:
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def store(typing: Any, a: Any, value: Any) -> Any:
        def lowered(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            builder.store(args[1], _place(context, builder, signature, args, kind), align=8)
            return context.get_dummy_value()

        return (types.void(a, kind), lowered) if _is_plain(a) else None

    return store


def _is_plain(kind: Any) -> bool:
    """An array of numbers that lie one behind the other."""
    from numba import types

    return isinstance(kind, types.Array) and kind.layout == "C" and kind.dtype == types.float64


def _place(context: Any, builder: Any, signature: Any, args: Any, kind: Any) -> Any:
    """The array's memory as that of the part."""
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.bitcast(data, context.get_value_type(kind).as_pointer())
