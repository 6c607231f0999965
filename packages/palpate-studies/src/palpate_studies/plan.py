"""All runs of a study by their number: the grid of its parameters times the points drawn, times the seeds.

The points are those of Sobol's sequence, one by one.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from palpate.bench.from_experiment import AnyExperiment, build_any, load_any
from palpate.bench.toml_parts import ROLES
from palpate.errors import InputError, PluginError, unknown
from palpate.plugins import Plugin, is_plugin, plugin
from palpate_studies.parameters import Axis, Label, Tables, axis, experiment_of, label, put, tables_of
from palpate_studies.study import Against, Study, StudyParameter, flat


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


TRIED = 2000
"""How many combinations of values are tried before a study is refused whose every value is refused."""
MAIN = "study"
"""The name of the study's own part, where it is compared with others."""


@dataclass(frozen=True)
class RunSetting:
    """One run before it is run.

    Args:
        run: its number.
        at: the parameters' values as they stand in a table, the seed among them.
        experiment: to run; None if the values are refused.
        seed: of the noise.
        refused: why.
    """

    run: int
    at: dict[str, Label]
    experiment: AnyExperiment | None
    seed: int
    refused: str = ""


@dataclass(frozen=True)
class StudyPart:
    """A study's own runs, or those of one that it is compared with: a base experiment and the axes over it.

    Args:
        name: `MAIN`, or as it stands in [against].
        bases: experiments by name, with what is fixed; "" is the part's own.
        axes: cases first, since they may bring what others change.
        seeds: of each setting.
        samples: how many points are drawn for the axes without values of their own.
        samples_seed: of these.
    """

    name: str
    bases: Mapping[str, AnyExperiment]
    axes: tuple[Axis, ...]
    seeds: tuple[int, ...]
    samples: int
    samples_seed: int

    @property
    def grid(self) -> list[Axis]:
        """The axes with values of their own."""
        return [a for a in self.axes if not a.drawn]

    @property
    def random_axes(self) -> list[Axis]:
        """The axes whose values are drawn."""
        return [a for a in self.axes if a.drawn]

    @property
    def settings(self) -> int:
        """How many there are, the seeds aside."""
        return math.prod(len(a.settings) for a in self.grid) * self.samples

    def __len__(self) -> int:
        return self.settings * len(self.seeds)

    @cached_property
    def sobol(self) -> Sobol:
        """The sequence of the points drawn."""
        return Sobol(len(self.random_axes), self.samples_seed)

    def values(self, number: int) -> dict[str, Any]:
        """The parameters' values of a setting by its number, as they are set."""
        found: dict[str, Any] = {}
        for one in reversed(self.grid):
            number, i = divmod(number, len(one.settings))
            found[one.name] = one.settings[i]
        if self.random_axes:
            shares = self.sobol.point(number)
            found |= {a.name: a.between(s) for a, s in zip(self.random_axes, shares, strict=True)}
        return {a.name: found[a.name] for a in self.axes}

    def experiment(self, values: Mapping[str, Any]) -> AnyExperiment:
        """The experiment with these values.

        Raises:
            InputError: values that are refused.
        """
        named = [a.experiment(values[a.name]) for a in self.axes]
        base = self.bases[next(filter(None, named), "")]
        # Cases first, and read: one may bring a whole table, whose numbers the rest then changes.
        for cases in (True, False):
            tables = tables_of(base)
            for one in self.axes:
                if (one.parameter.cases is not None) == cases:
                    one.apply(tables, values[one.name])
            base = experiment_of(base, tables)
        return base

    def setting(self, number: int, values: Mapping[str, Any], seed: int, compared: bool) -> RunSetting:
        """A run with these values and this seed."""
        own = next((a for a in self.axes if "seed" in a.targets), None)
        seed = seed if own is None else values[own.name]
        at: dict[str, Label] = {"part": self.name} if compared else {}
        at |= {name: label(value) for name, value in values.items()}
        at["seed"] = seed
        try:
            return RunSetting(number, at, self.experiment(values), seed)
        except InputError as error:
            return RunSetting(number, at, None, seed, str(error))


@dataclass(frozen=True)
class RunPlan:
    """All runs of a study.

    Args:
        study: as it was read.
        parts: its own, then those of [against].
    """

    study: Study
    parts: tuple[StudyPart, ...]

    def __len__(self) -> int:
        if self.study.search is not None:
            return self.study.search.trials * len(self.parts[0].seeds)
        return sum(map(len, self.parts))

    def setting(self, run: int) -> RunSetting:
        """A run by its number."""
        left = run
        for part in self.parts:
            if left < len(part):
                setting, s = divmod(left, len(part.seeds))
                return part.setting(run, part.values(setting), part.seeds[s], len(self.parts) > 1)
            left -= len(part)
        raise IndexError(run)

    def trial(self, number: int, values: Mapping[str, Any]) -> list[RunSetting]:
        """The runs of one trial of a search, one for each seed."""
        part = self.parts[0]
        first = number * len(part.seeds)
        return [part.setting(first + i, values, seed, False) for i, seed in enumerate(part.seeds)]

    @cached_property
    def plugins(self) -> tuple[Plugin, ...]:
        """The user's own parts and metrics that the study names."""
        study = self.study
        own = [(study.fixed, study.parameters), *((a.fixed, a.parameters) for a in study.against.values())]
        set_to = [[fixed, *((p.values, p.cases) for p in parameters.values())] for fixed, parameters in own]
        bases = [msgspec.to_builtins(e) for part in self.parts for e in part.bases.values()]
        tables = [base[key] for base in bases for key in ROLES if base.get(key) is not None]
        named = {*study.metrics, *_texts(set_to), *(table.get("kind") for table in tables)}
        return tuple(plugin(name) for name in sorted(filter(is_plugin, named)))

    @property
    def columns(self) -> dict[str, type]:
        """Name and type (int, float, bool or str) of each column that tells a run apart."""
        found: dict[str, set[type]] = {"part": {str}} if len(self.parts) > 1 else {}
        for part in self.parts:
            for one in part.axes:
                kinds = set(map(type, one.labels())) if not one.drawn else {int if one.whole else float}
                found.setdefault(one.name, set()).update(kinds)
        found["seed"] = {int}
        return {name: _common(kinds) for name, kinds in found.items()}


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | list | tuple):
        for one in value.values() if isinstance(value, Mapping) else value:
            yield from _texts(one)


def _common(kinds: set[type]) -> type:
    if len(kinds) == 1:
        return next(iter(kinds))
    return float if kinds == {int, float} else str


def plan(study: Study, where: str = "") -> RunPlan:
    """The runs of a study.

    Args:
        study: as it was read.
        where: the study's file or name; experiments in TOML files are looked for beside it.

    Raises:
        InputError: no such experiment, a path that no experiment has, values that are refused whatever the others are.
    """
    folder = Path(where).parent if where.endswith(".toml") else Path()
    seeds = tuple(range(study.seeds)) if isinstance(study.seeds, int) else tuple(study.seeds)
    own = Against(experiment=study.experiment, fixed=study.fixed, parameters=study.parameters)
    parts = [_part(study, MAIN, own, seeds, folder)]
    parts += [
        _part(study, name, _whole(study, other), seeds, folder) for name, other in study.against.items()
    ]
    if study.search is None and not all(map(len, parts)):
        raise InputError("the grid is empty: a parameter has no values")
    return RunPlan(study, tuple(parts))


def _whole(study: Study, other: Against) -> Against:
    """Reference runs of the study, with the parameters that they share with it."""
    for name in other.shares:
        if name not in study.parameters:
            raise unknown("parameter", name, study.parameters)
    shared = {name: study.parameters[name] for name in other.shares}
    fixed = other.fixed if other.experiment else flat(study.fixed) | flat(other.fixed)
    experiment = other.experiment or study.experiment
    return Against(experiment=experiment, fixed=fixed, parameters=shared | other.parameters)


def _part(study: Study, name: str, of: Against, seeds: tuple[int, ...], folder: Path) -> StudyPart:
    cases = [p for p in of.parameters.values() if p.cases is not None]
    others = {c["experiment"] for p in cases for c in (p.cases or {}).values() if "experiment" in c}
    named = {one: _load(one, folder) for one in others} | {"": _load(of.experiment, folder)}
    bases = {one: _fix(base, flat(of.fixed), one or of.experiment) for one, base in named.items()}
    some = _some(bases, cases)
    ordered = sorted(of.parameters.items(), key=lambda item: item[1].cases is None)
    axes = tuple(axis(key, parameter, some) for key, parameter in ordered)
    drawn = any(a.drawn for a in axes)
    if any("seed" in a.targets for a in axes):
        seeds = seeds[:1]
    found = StudyPart(name, bases, axes, seeds, study.samples or 1 if drawn else 1, study.samples_seed)
    _check_values(found, study.search is None)
    return found


def _load(name: str, folder: Path) -> AnyExperiment:
    return load_any(str(folder / name) if name.endswith(".toml") else name)


def _fix(base: AnyExperiment, fixed: Mapping[str, Any], name: str) -> AnyExperiment:
    """An experiment with its constants."""
    tables = tables_of(base)
    try:
        for path, value in fixed.items():
            put(tables, path, value)
        return experiment_of(base, tables)
    except InputError as error:
        raise type(error)(f"[fixed] does not fit the experiment {name}: {error}") from error


def _some(bases: Mapping[str, AnyExperiment], cases: Sequence[StudyParameter]) -> list[Tables]:
    """The tables of every experiment that a parameter may have to change: each base, and each case."""
    found = [tables_of(base) for base in bases.values()]
    for one in cases:
        for changes in (one.cases or {}).values():
            base = bases[changes.get("experiment", "")]
            try:
                found.append(
                    tables_of(_fix(base, flat({k: v for k, v in changes.items() if k != "experiment"}), ""))
                )
            except InputError:  # is said when the case is used
                continue
    return found


def _check_values(part: StudyPart, planned: bool) -> None:
    """Refuses parameters of which no values make an experiment: a mistake, not a result."""
    if not planned:
        return
    trouble: InputError | None = None
    for values in islice(samples(part), TRIED):
        try:
            build_any(part.experiment(values))
        except PluginError:
            raise
        except InputError as error:
            trouble = trouble or error
        else:
            return
    if trouble is not None:
        raise InputError(f"none of the parameters' values make an experiment: {trouble}")


def samples(part: StudyPart) -> Iterator[dict[str, Any]]:
    """All first values, all last ones, and each value of each parameter with all others at their first or last."""
    every = {a.name: a.settings or (a.between(0.0), a.between(1.0)) for a in part.axes}
    ends = [{name: values[i] for name, values in every.items()} for i in (0, -1)]
    yield from ends
    for name, values in every.items():
        yield from ({**end, name: value} for value in values for end in ends)


def resolve(plan: RunPlan) -> bytes:
    """Everything that decides the rows of a study, as bytes: what is only shown is left out."""
    study = plan.study
    shown = (
        {"title", "about", "best", "maps", "curves"}
        if study.search is None
        else {"title", "about", "maps", "curves"}
    )
    stamps = {one.name: one.stamp for one in plan.plugins}
    decides = {key: value for key, value in msgspec.to_builtins(study).items() if key not in shown}
    bases = [{name: msgspec.to_builtins(e) for name, e in sorted(part.bases.items())} for part in plan.parts]
    return msgspec.json.encode([decides, bases, *([stamps] if stamps else [])], order="sorted")
