"""Dotted paths into an experiment: reading and setting their values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any

import msgspec

from palpate.bench import changed
from palpate.bench.any_experiment import AnyExperiment
from palpate.errors import InputError

Tables = dict[str, Any]


def tables_of(experiment: AnyExperiment) -> Tables:
    """An experiment as nested tables that may be changed; lists in place of tuples."""
    return _thawed(msgspec.to_builtins(experiment))


def experiment_of(base: AnyExperiment, tables: Tables) -> AnyExperiment:
    """The experiment with these tables.

    Raises:
        InputError: a key that does not exist, or a value out of range.
    """
    before = tables_of(base)
    changes = {key: value for key, value in tables.items() if value != before[key]}
    try:
        return changed(base, changes)
    except InputError as error:
        raise type(error)(str(error).removeprefix(f"{', '.join(changes)}: ")) from error


def value_at(tables: Tables, path: str) -> Any:
    """Value at a path.

    Raises:
        InputError: nothing does; the nearest path is named.
    """
    if path in NETWORK:
        return NETWORK[path][0](_layers(tables, path))
    here: Any = tables
    for step in path.split("."):
        if here is None:  # a table that is left out
            return None
        try:
            here = here[int(step)] if isinstance(here, list) else here[step]
        except (KeyError, IndexError, ValueError, TypeError):
            raise _unknown(path, tables) from None
    return here


def put(tables: Tables, path: str, value: Any) -> None:
    """Sets what stands at a path.

    Raises:
        InputError: nothing stands there; the nearest path is named.
    """
    before = value_at(tables, path)
    value = _thawed(value)
    if type(before) is float and type(value) is int:
        value = float(value)
    if path in NETWORK:
        put(tables, LAYERS, NETWORK[path][1](_layers(tables, path), value))
        return
    *outer, last = path.split(".")
    here = value_at(tables, ".".join(outer)) if outer else tables
    if here is None:
        put(tables, ".".join(outer), {last: value})
    elif isinstance(here, list):
        here[int(last)] = value
    else:
        here[last] = value


def combined(before: Any, value: float, by: Callable[[float, float], float], path: str) -> Any:
    """`by` of what stood there and a number, in every component of a list; whole numbers stay whole."""
    if isinstance(before, list):
        return [combined(one, value, by, path) for one in before]
    if isinstance(before, bool) or not isinstance(before, int | float):
        raise InputError(f"{path} is {before!r}, which cannot be multiplied or added to; use sets")
    return round(by(before, value)) if isinstance(before, int) else by(before, value)


def paths(tables: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """All that a parameter may name."""
    for key, value in tables.items():
        if isinstance(value, dict):
            if "kind" in value:
                yield f"{prefix}{key}"
            yield from paths(value, f"{prefix}{key}.")
        elif not (prefix == "" and isinstance(value, str)):  # title and about
            yield f"{prefix}{key}"
    if not prefix:
        yield "seed"
        yield from NETWORK if "controller" in tables else ()


LAYERS = "controller.layers"
#: The hidden layers in two numbers, where all have one size: how to read each off, and how to change it.
NETWORK: dict[str, tuple[Callable[[list[int]], int], Callable[[list[int], int], list[int]]]] = {
    "network.layers": (len, lambda layers, n: layers[:1] * n),
    "network.neurons": (lambda layers: layers[0], lambda layers, n: [n] * len(layers)),
}


def _layers(tables: Tables, path: str) -> list[int]:
    if "controller" not in tables:
        raise _unknown(path, tables)
    layers = tables["controller"].get("layers")
    if not layers:
        raise InputError(
            f"{path}: the {tables['controller']['kind']} controller has no network of such layers"
        )
    return layers


def _unknown(path: str, tables: Tables) -> InputError:
    known = sorted(set(paths(tables)))
    near = get_close_matches(path, known, n=1, cutoff=0.5) or _ends_with(path, known)
    hint = f"did you mean {near[0]!r}? " if near else ""
    table = path.partition(".")[0]
    there: Iterable[str] = [p for p in known if p.startswith(f"{table}.")] or sorted(
        {p.split(".")[0] for p in known}
    )
    return InputError(f"unknown parameter {path!r}; {hint}there are: {', '.join(there)}")


def _ends_with(path: str, known: list[str]) -> list[str]:
    """A key named without its table."""
    return [p for p in known if p.rpartition(".")[2] == path.rpartition(".")[2]]


def _thawed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _thawed(one) for key, one in value.items()}
    return [_thawed(one) for one in value] if isinstance(value, list | tuple) else value
