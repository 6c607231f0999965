"""The values of a parameter, and their effect on an experiment."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.studies.definition.applying import Tables, combined, put, value_at
from palpate.studies.definition.study import flat
from palpate.studies.definition.tables import Parameter

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
    parameter: Parameter
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
            put(tables, path, combined(value_at(tables, path), used, operator.mul, path))
        for path in p.plus:
            put(tables, path, combined(value_at(tables, path), used, operator.add, path))
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


def axis(name: str, parameter: Parameter, some: Sequence[Tables]) -> Axis:
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


def _check_used(name: str, p: Parameter) -> None:
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
