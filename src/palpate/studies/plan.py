"""All runs of a study by their number: the grid of its parameters, times the points drawn, times the seeds."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from palpate.bench import Experiment, build, load
from palpate.bench.toml_parts import ROLES
from palpate.errors import InputError, PluginError
from palpate.plugins import Plugin, is_plugin, plugin
from palpate.studies.parameters import Axis, Label, Tables, axis, experiment_of, label, put, tables_of
from palpate.studies.study import Study, flatten


class Sobol:
    """Points of Sobol's sequence by their number; cheap when asked for one after the other."""

    def __init__(self, dimensions: int, seed: int):
        self._dimensions, self._seed = dimensions, seed
        self._engine: Any = None
        self._last: tuple[int, list[float]] = (-1, [])

    def point(self, number: int) -> list[float]:
        """The coordinates of a point, each in [0, 1)."""
        if self._last[0] != number:
            self._last = (number, self._draw(number))
        return self._last[1]

    def _draw(self, number: int) -> list[float]:
        from scipy.stats import qmc

        if self._engine is None or self._engine.num_generated > number:
            self._engine = qmc.Sobol(self._dimensions, scramble=True, rng=self._seed)
        if self._engine.num_generated < number:
            self._engine.fast_forward(number - self._engine.num_generated)
        point: list[float] = self._engine.random(1)[0].tolist()
        return point


MAX_TRIED = 2000
"""Number of combinations of values that are tried before a study is refused because none is valid."""


@dataclass(frozen=True)
class RunSetting:
    """One run before it is run.

    Args:
        run: its number.
        at: the parameters' values as they stand in a table, the seed among them.
        experiment: to run; None if the values are refused.
        seed: of the noise.
        refused: the reason for which the values are refused.
    """

    run: int
    at: dict[str, Label]
    experiment: Experiment | None
    seed: int
    refused: str = ""


@dataclass(frozen=True)
class RunPlan:
    """All runs of a study: a base experiment and the axes over it.

    Args:
        study: as it was read.
        bases: experiments by name, with what is fixed; "" is the study's own.
        axes: cases first, since they may bring what others change.
        seeds: of each setting.
    """

    study: Study
    bases: Mapping[str, Experiment]
    axes: tuple[Axis, ...]
    seeds: tuple[int, ...]

    @property
    def grid(self) -> list[Axis]:
        """The axes with values of their own."""
        return [a for a in self.axes if not a.drawn]

    @property
    def random_axes(self) -> list[Axis]:
        """The axes whose values are drawn."""
        return [a for a in self.axes if a.drawn]

    @property
    def samples(self) -> int:
        """Number of points that are drawn for the random axes; 1 without any."""
        return self.study.samples or 1

    def __len__(self) -> int:
        return math.prod(len(a.settings) for a in self.grid) * self.samples * len(self.seeds)

    @cached_property
    def _sobol(self) -> Sobol:
        return Sobol(len(self.random_axes), self.study.samples_seed)

    def axis(self, name: str) -> Axis:
        """The axis of a parameter."""
        return next(a for a in self.axes if a.name == name)

    def values(self, number: int) -> dict[str, Any]:
        """The parameters' values of a setting by its number, the seeds aside."""
        values: dict[str, Any] = {}
        for grid_axis in reversed(self.grid):
            number, i = divmod(number, len(grid_axis.settings))
            values[grid_axis.name] = grid_axis.settings[i]
        if self.random_axes:
            fractions = self._sobol.point(number)
            values |= {
                a.name: a.between(fraction) for a, fraction in zip(self.random_axes, fractions, strict=True)
            }
        return {a.name: values[a.name] for a in self.axes}

    def experiment(self, values: Mapping[str, Any]) -> Experiment:
        """The experiment with these values.

        Raises:
            InputError: values that are refused.
        """
        named = [a.experiment(values[a.name]) for a in self.axes]
        experiment = self.bases[next(filter(None, named), "")]
        # Cases come first and are read at once: a case may bring a whole table, whose numbers the others change.
        for are_cases in (True, False):
            tables = tables_of(experiment)
            for one in self.axes:
                if (one.parameter.cases is not None) == are_cases:
                    one.apply(tables, values[one.name])
            experiment = experiment_of(experiment, tables)
        return experiment

    def setting(self, run: int) -> RunSetting:
        """A run by its number."""
        if not 0 <= run < len(self):
            raise IndexError(run)
        number, s = divmod(run, len(self.seeds))
        values, seed = self.values(number), self.seeds[s]
        for a in self.axes:
            if a.is_seed:
                seed = values[a.name]
        at = {name: label(value) for name, value in values.items()} | {"seed": seed}
        try:
            return RunSetting(run, at, self.experiment(values), seed)
        except InputError as error:
            return RunSetting(run, at, None, seed, str(error))

    @cached_property
    def plugins(self) -> tuple[Plugin, ...]:
        """The user's own parts and metrics that the study names."""
        study = self.study
        values = [study.fixed, *((p.values, p.cases) for p in study.parameters.values())]
        bases = [msgspec.to_builtins(base) for base in self.bases.values()]
        tables = [base[key] for base in bases for key in ROLES if base.get(key) is not None]
        named = {*study.metrics, *_texts(values), *(table.get("kind") for table in tables)}
        return tuple(plugin(name) for name in sorted(filter(is_plugin, named)))

    @property
    def columns(self) -> dict[str, type]:
        """Name and type (int, float, bool or str) of each column that tells a run apart."""
        columns = {}
        for a in self.axes:
            types: set[type] = {int if a.whole else float} if a.drawn else set(map(type, a.labels()))
            columns[a.name] = _common(types)
        return columns | {"seed": int}


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | list | tuple):
        for inner in value.values() if isinstance(value, Mapping) else value:
            yield from _texts(inner)


def _common(types: set[type]) -> type:
    if len(types) == 1:
        return next(iter(types))
    return float if types == {int, float} else str


def plan_runs(study: Study, where: str = "") -> RunPlan:
    """The runs of a study.

    Args:
        study: as it was read.
        where: the study's file or name; experiments in TOML files are looked for beside it.

    Raises:
        InputError: no such experiment, a path that no experiment has, values that are refused whatever the others are.
    """
    folder = Path(where).parent if where.endswith(".toml") else Path()
    seeds = tuple(range(study.seeds)) if isinstance(study.seeds, int) else tuple(study.seeds)
    cases = [case for p in study.parameters.values() for case in (p.cases or {}).values()]
    others = {case["experiment"] for case in cases if "experiment" in case}
    named = {name: _load(name, folder) for name in others} | {"": _load(study.experiment, folder)}
    bases = {name: _fix(base, flatten(study.fixed), name or study.experiment) for name, base in named.items()}
    experiments = [tables_of(base) for base in bases.values()] + list(_case_tables(bases, cases))
    ordered = sorted(study.parameters.items(), key=lambda item: item[1].cases is None)
    axes = tuple(axis(name, parameter, experiments) for name, parameter in ordered)
    if any(a.is_seed for a in axes):
        seeds = seeds[:1]
    planned = RunPlan(study, bases, axes, seeds)
    _check_values(planned)
    return planned


def _load(name: str, folder: Path) -> Experiment:
    return load(str(folder / name) if name.endswith(".toml") else name)


def _fix(base: Experiment, fixed: Mapping[str, Any], name: str) -> Experiment:
    """An experiment with its constants."""
    tables = tables_of(base)
    try:
        for path, value in fixed.items():
            put(tables, path, value)
        return experiment_of(base, tables)
    except InputError as error:
        raise type(error)(f"[fixed] does not fit the experiment {name}: {error}") from error


def _case_tables(bases: Mapping[str, Experiment], cases: list[dict[str, Any]]) -> Iterator[Tables]:
    """The tables of the experiment of each case that makes one by itself."""
    for case in cases:
        changes = {key: value for key, value in case.items() if key != "experiment"}
        try:
            yield tables_of(_fix(bases[case.get("experiment", "")], flatten(changes), ""))
        except InputError:  # a case that is wrong is reported when it is used
            continue


def _check_values(plan: RunPlan) -> None:
    """Refuse parameters of which no values make an experiment: a mistake, not a result."""
    first_error: InputError | None = None
    for values in islice(corner_values(plan), MAX_TRIED):
        try:
            build(plan.experiment(values))
        except PluginError:
            raise
        except InputError as error:
            first_error = first_error or error
        else:
            return
    if first_error is not None:
        raise InputError(f"none of the parameters' values make an experiment: {first_error}")


def corner_values(plan: RunPlan) -> Iterator[dict[str, Any]]:
    """All first values, all last ones, and each value of each parameter with all others at their first or last."""
    settings = {a.name: a.settings or (a.between(0.0), a.between(1.0)) for a in plan.axes}
    ends = [{name: values[i] for name, values in settings.items()} for i in (0, -1)]
    yield from ends
    for name, values in settings.items():
        yield from ({**end, name: value} for value in values for end in ends)


def decisive_bytes(plan: RunPlan) -> bytes:
    """Everything in a study's file that decides its rows; title, text, ranking and figures do not."""
    shown = {"title", "about", "best", "maps", "curves"}
    decides = {key: value for key, value in msgspec.to_builtins(plan.study).items() if key not in shown}
    bases = {name: msgspec.to_builtins(base) for name, base in sorted(plan.bases.items())}
    return msgspec.json.encode([decides, bases], order="sorted")
