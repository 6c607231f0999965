"""The values of a parameter, and their effect on an experiment: dotted paths are read, set, multiplied or added to."""

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import msgspec
import numpy as np

from palpate.bench import with_values
from palpate.bench.from_experiment import AnyExperiment
from palpate.errors import InputError
from palpate_studies.study import StudyParameter, flat

Tables = dict[str, Any]


def tables_of(experiment: AnyExperiment) -> Tables:
    """An experiment as nested tables that may be changed; lists in place of tuples."""
    return _thaw(msgspec.to_builtins(experiment))


def experiment_of(base: AnyExperiment, tables: Tables) -> AnyExperiment:
    """The experiment with these tables.

    Raises:
        InputError: a key that does not exist, or a value out of range.
    """
    before = tables_of(base)
    changes = {key: value for key, value in tables.items() if value != before[key]}
    try:
        return with_values(base, changes)
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
    value = _thaw(value)
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


def combine(before: Any, value: float, by: Callable[[float, float], float], path: str) -> Any:
    """`by` of what stood there and a number, in every component of a list; whole numbers stay whole."""
    if isinstance(before, list):
        return [combine(one, value, by, path) for one in before]
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


def _thaw(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _thaw(one) for key, one in value.items()}
    return [_thaw(one) for one in value] if isinstance(value, list | tuple) else value


Label = float | int | bool | str
"""A value as it stands in a table of results."""


UNITS = {
    **dict.fromkeys(("surface.stiffness", "surface.branch_stiffness", "wall.side_stiffness"), "N/m"),
    **dict.fromkeys(("surface.damping", "wall.side_damping"), "N s/m"),
    **dict.fromkeys(
        ("force.first", "force.second", "force.amplitude", "force_sensor.noise", "approach.switch"), "N"
    ),
    **dict.fromkeys(("force_sensor.cutoff", "filters.motion", "filters.force", "force.frequency"), "Hz"),
    **dict.fromkeys(("force.period", "surface.branch_time", "run.press"), "s"),
    "surface.mass": "kg",
    "wall.x": "m",
    "approach.step": "m",
}
"""Of parameters that stand for a quantity whatever the experiment is; gains have another unit in each law."""


@dataclass(frozen=True)
class Axis:
    """One parameter of a study.

    Args:
        name: as the study has it.
        parameter: its table.
        whole: its values are whole numbers, because what they set is.
        settings: the values as they are set, in order; none where they are drawn from a range.
    """

    name: str
    parameter: StudyParameter
    whole: bool
    settings: tuple[Any, ...]

    @property
    def drawn(self) -> bool:
        """Whether its values come from a range without points: by Sobol's sequence, or in a search."""
        return not self.settings

    @property
    def title(self) -> str:
        """Name in figures and tables: its label, or its name with its known unit."""
        unit = UNITS.get(self.name, "")
        return self.parameter.label or (f"{self.name} [{unit}]" if unit else self.name)

    def labels(self) -> tuple[Label, ...]:
        """The values as they stand in a table."""
        return tuple(map(label, self.settings))

    def between(self, share: float) -> float | int:
        """The value at this share of the range, 0 ... 1."""
        p = self.parameter
        low, high = p.log or p.range or (0.0, 0.0)
        inside = low * (high / low) ** share if p.log else low + (high - low) * share
        value = high if share == 1.0 else inside
        return round(value) if self.whole else float(value)

    def apply(self, tables: Tables, value: Any) -> None:
        """Changes the tables of an experiment as this value asks for."""
        p = self.parameter
        if p.cases is not None:
            for path, one in flat(p.cases[value]).items():
                if path != "experiment":
                    put(tables, path, one)
            return
        used = value * p.factor if p.factor != 1.0 else value
        for path in p.times:
            put(tables, path, combine(value_at(tables, path), used, operator.mul, path))
        for path in p.plus:
            put(tables, path, combine(value_at(tables, path), used, operator.add, path))
        for path in self.targets:
            if path != "seed":
                put(tables, path, used)

    @property
    def targets(self) -> tuple[str, ...]:
        """The paths that take the value as it is."""
        p = self.parameter
        return p.sets or (() if p.times or p.plus or p.cases is not None else (self.name,))

    def experiment(self, value: Any) -> str | None:
        """The experiment that a case takes; None where it changes the study's."""
        cases = self.parameter.cases
        return None if cases is None else cases[value].get("experiment")


def axis(name: str, parameter: StudyParameter, some: Sequence[Tables]) -> Axis:
    """The axis of a parameter.

    Args:
        name: of the parameter.
        parameter: its table.
        some: the tables of every experiment that it may have to change.

    Raises:
        InputError: a path that no experiment has, values that cannot be what they are used for.
    """
    bare = Axis(name, parameter, False, ())
    whole = (
        bool(bare.targets) and all(_whole(path, some) for path in bare.targets) and parameter.factor == 1.0
    )
    for path in (*parameter.times, *parameter.plus):
        _first(path, some)
    for changes in (parameter.cases or {}).values():
        for path in flat(changes):
            if path != "experiment":
                _first(path, some)
    bare = Axis(name, parameter, whole, ())
    return Axis(name, parameter, whole, tuple(_settings(bare)))


def label(value: Any) -> Label:
    """A value as it stands in a table: numbers and texts as they are, lists as 12-12, tables by their kind."""
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return ", ".join(f"{v}" if k == "kind" else f"{k} {v}" for k, v in value.items())
    return "-".join(f"{one:g}" if isinstance(one, float) else str(one) for one in value)


def _settings(axis: Axis) -> Sequence[Any]:
    p = axis.parameter
    if p.cases is not None:
        return list(p.cases)
    if p.values is not None:
        _check_used(axis.name, p)
        return p.values
    if p.points is None:
        return []
    shares = np.linspace(0.0, 1.0, p.points).tolist() if p.points > 1 else [0.5]
    return list(dict.fromkeys(map(axis.between, shares)))


def _check_used(name: str, p: StudyParameter) -> None:
    used = p.times or p.plus or p.factor != 1.0
    odd = [v for v in p.values or () if used and (isinstance(v, bool) or not isinstance(v, int | float))]
    if odd:
        raise InputError(
            f"the parameter {name!r} is multiplied or added; its values are numbers, got {odd[0]!r}"
        )


def _whole(path: str, some: Sequence[Tables]) -> bool:
    return path == "seed" or type(_first(path, some)) is int


def _first(path: str, some: Sequence[Tables]) -> Any:
    """Value at the path in the first experiment that has it."""
    trouble: InputError | None = None
    for tables in some:
        try:
            return value_at(tables, path) if path != "seed" else 0
        except InputError as error:
            trouble = trouble or error
    raise trouble or InputError(f"unknown parameter {path!r}")
