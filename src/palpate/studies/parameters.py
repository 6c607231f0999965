"""The values of a parameter, and their effect on an experiment: numbers at dotted paths are set or multiplied."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from palpate.bench import Experiment, with_values
from palpate.errors import InputError, unknown
from palpate.studies.study import StudyParameter, flatten

Tables = dict[str, Any]
Label = float | int | bool | str
"""A value as it stands in a table of results."""


def tables_of(experiment: Experiment) -> Tables:
    """An experiment as nested tables that may be changed; lists in place of tuples."""
    return _thaw(msgspec.to_builtins(experiment))


def experiment_of(base: Experiment, tables: Tables) -> Experiment:
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
    """Value at a path; None in a table that is left out.

    Raises:
        InputError: there is no such path; the nearest one is named.
    """
    here: Any = tables
    for step in path.split("."):
        if here is None:
            return None
        try:
            here = here[int(step)] if isinstance(here, list) else here[step]
        except (KeyError, IndexError, ValueError, TypeError):
            raise unknown("parameter", path, set(paths(tables))) from None
    return here


def put(tables: Tables, path: str, value: Any) -> None:
    """Set the value at a path.

    Raises:
        InputError: there is no such path; the nearest one is named.
    """
    before = value_at(tables, path)
    value = _thaw(value)
    if type(before) is float and type(value) is int:
        value = float(value)
    *outer, last = path.split(".")
    table = value_at(tables, ".".join(outer)) if outer else tables
    if table is None:
        put(tables, ".".join(outer), {last: value})
    elif isinstance(table, list):
        table[int(last)] = value
    else:
        table[last] = value


def multiply(before: Any, factor: float, path: str) -> Any:
    """The product of a number, or of each number of a list, with a factor; whole numbers stay whole."""
    if isinstance(before, list):
        return [multiply(number, factor, path) for number in before]
    if isinstance(before, bool) or not isinstance(before, int | float):
        raise InputError(f"{path} is {before!r}, which cannot be multiplied; use sets")
    return round(before * factor) if isinstance(before, int) else before * factor


def paths(tables: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """All paths that a parameter may name."""
    for key, value in tables.items():
        if isinstance(value, dict):
            if "kind" in value:
                yield f"{prefix}{key}"
            yield from paths(value, f"{prefix}{key}.")
        elif prefix or not isinstance(value, str):  # title and about are no parameters
            yield f"{prefix}{key}"
    if not prefix:
        yield "seed"


def _thaw(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _thaw(inner) for key, inner in value.items()}
    return [_thaw(inner) for inner in value] if isinstance(value, list | tuple) else value


@dataclass(frozen=True)
class Axis:
    """One parameter of a study.

    Args:
        name: as the study has it.
        parameter: its table.
        whole: True if its values are whole numbers, because the numbers that they set are.
        settings: the values as they are set, in order; none if they are drawn from a range.
    """

    name: str
    parameter: StudyParameter
    whole: bool = False
    settings: tuple[Any, ...] = ()

    @property
    def drawn(self) -> bool:
        """True if the values are drawn from a range by Sobol's sequence."""
        return not self.settings

    @property
    def title(self) -> str:
        """Name in figures and tables."""
        return self.parameter.label or self.name

    @property
    def targets(self) -> tuple[str, ...]:
        """The paths that are set to the value."""
        parameter = self.parameter
        if parameter.sets or parameter.times or parameter.cases is not None:
            return parameter.sets
        return (self.name,)

    @property
    def is_seed(self) -> bool:
        """True if the values are seeds of the noise."""
        return "seed" in self.targets

    def labels(self) -> tuple[Label, ...]:
        """The values as they stand in a table."""
        return tuple(map(label, self.settings))

    def between(self, fraction: float) -> float | int:
        """The value at a fraction of the range, 0 ... 1."""
        parameter = self.parameter
        low, high = parameter.log or parameter.range or (0.0, 0.0)
        value = low * (high / low) ** fraction if parameter.log else low + (high - low) * fraction
        if fraction == 1.0:
            value = high
        return round(value) if self.whole else float(value)

    def apply(self, tables: Tables, value: Any) -> None:
        """Change the tables of an experiment."""
        parameter = self.parameter
        if parameter.cases is not None:
            for path, changed in flatten(parameter.cases[value]).items():
                if path != "experiment":
                    put(tables, path, changed)
            return
        for path in parameter.times:
            put(tables, path, multiply(value_at(tables, path), value, path))
        for path in self.targets:
            if path != "seed":
                put(tables, path, value)

    def experiment(self, value: Any) -> str:
        """Name of the experiment that a case takes; "" if it changes the study's."""
        cases = self.parameter.cases
        return "" if cases is None else cases[value].get("experiment", "")


def axis(name: str, parameter: StudyParameter, experiments: Sequence[Tables]) -> Axis:
    """The axis of a parameter.

    Args:
        name: of the parameter.
        parameter: its table.
        experiments: tables of every experiment that it may have to change.

    Raises:
        InputError: a path that no experiment has, values that cannot be what they are used for.
    """
    targets = Axis(name, parameter).targets
    whole = bool(targets) and all(type(_first_value(path, experiments)) is int for path in targets)
    for path in parameter.times:
        _first_value(path, experiments)
    for changes in (parameter.cases or {}).values():
        for path in flatten(changes):
            if path != "experiment":
                _first_value(path, experiments)
    bare = Axis(name, parameter, whole)
    return Axis(name, parameter, whole, tuple(_settings(bare)))


def label(value: Any) -> Label:
    """A value as it stands in a table: numbers and texts as they are, lists as 12-12, tables by their kind."""
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return ", ".join(f"{inner}" if key == "kind" else f"{key} {inner}" for key, inner in value.items())
    return "-".join(f"{inner:g}" if isinstance(inner, float) else str(inner) for inner in value)


def _settings(axis: Axis) -> Sequence[Any]:
    parameter = axis.parameter
    if parameter.cases is not None:
        return list(parameter.cases)
    if parameter.values is not None:
        for value in parameter.values if parameter.times else ():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(
                    f"the parameter {axis.name!r} is a factor; its values are numbers, got {value!r}"
                )
        return parameter.values
    if parameter.points is None:
        return []
    fractions = np.linspace(0.0, 1.0, parameter.points).tolist() if parameter.points > 1 else [0.5]
    return list(dict.fromkeys(map(axis.between, fractions)))


def _first_value(path: str, experiments: Sequence[Tables]) -> Any:
    """Value at a path in the first experiment that has it."""
    if path == "seed":
        return 0
    first_error: InputError | None = None
    for tables in experiments:
        try:
            return value_at(tables, path)
        except InputError as error:
            first_error = first_error or error
    raise first_error or InputError(f"unknown parameter {path!r}")
