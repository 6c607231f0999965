"""The law's numbers and its state as flat arrays: what a compiled call from Python takes without boxing.

Which number stands where follows from the fields of the parts alone: functions that read and write them are made of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, get_type_hints

import numpy as np

from palpate._jit import law
from palpate.arrays import Array
from palpate.force.law import Cautious, CautiousState


def flattened(tree: Any) -> Array:
    """Every number of nested tuples, in their order, shape (n,)."""
    return np.array(list(_leaves(tree)))


def _leaves(tree: Any) -> Iterator[float]:
    for branch in tree:
        if isinstance(branch, tuple):
            yield from _leaves(branch)
        else:
            yield float(branch)


def places(part: type, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Names of every number of a part, from the outermost field in, in their order."""
    fields = get_type_hints(part) if part is not float else {}
    return [place for name, kind in fields.items() for place in places(kind, (*path, name))] or [path]


def _made(name: str, text: str, names: dict[str, Any]) -> Callable[..., Any]:
    exec(compile(text, __file__, "exec"), names)  # noqa: S102 -- made of fields of our own parts alone
    return law(names[name])


def _parts(part: type) -> dict[str, type]:
    found = {part.__name__: part}
    for kind in get_type_hints(part).values():
        found |= _parts(kind) if kind is not float else {}
    return found


def _built(part: type, numbers: Iterator[int]) -> str:
    """The call that makes a part of the next numbers of an array."""
    kinds = get_type_hints(part).values()
    arguments = (f"a[{next(numbers)}]" if kind is float else _built(kind, numbers) for kind in kinds)
    return f"{part.__name__}({', '.join(arguments)})"


def reader(name: str, part: type) -> Callable[..., Any]:
    """A law that makes a part of an array of its numbers."""
    text = f"def {name}(a):\n    return {_built(part, iter(range(len(places(part)))))}\n"
    return _made(name, text, {**_parts(part)})


def writer(name: str, part: type) -> Callable[..., Any]:
    """A law that puts a part's numbers into an array."""
    lines = (f"    a[{i}] = part.{'.'.join(place)}\n" for i, place in enumerate(places(part)))
    return _made(name, f"def {name}(a, part):\n{''.join(lines)}", {})


law_in = reader("law_in", Cautious)
state_in = reader("state_in", CautiousState)
put_state = writer("put_state", CautiousState)

_PLACES = places(CautiousState)
STATE = len(_PLACES)
"""Numbers of a state."""
LAST, VARIANCE, TIDE = (_PLACES.index(("watch", name)) for name in ("last", "variance", "tide"))
PHASE = _PLACES.index(("stage", "phase"))
SINCE = _PLACES.index(("known", "since"))
FOUND, STD = (_PLACES.index(("known", name, "x")) for name in ("found", "std"))
BOUND = _PLACES.index(("bound", "used"))
