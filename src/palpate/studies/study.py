"""A study: one TOML file with its experiment, parameters, metrics and figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta

from palpate.bench.toml_parts import TomlFiles, convert_table, not_finite
from palpate.errors import InputError, unknown
from palpate.files import read_toml
from palpate.plugins import look_in
from palpate.signals.types import Positive, Table
from palpate.studies.metrics import metric_of

Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Seed = Annotated[int, Meta(ge=0)]


class StudyParameter(Table, frozen=True):
    """The values of one parameter, and the numbers of the experiment that they set.

    The values are one of `values`, `range`, `log` and `cases`.
    """

    values: list[Any] | None = None
    range: tuple[float, float] | None = None
    """First and last value, evenly spaced."""
    log: tuple[Positive, Positive] | None = None
    """First and last value, evenly spaced in the logarithm."""
    points: Count | None = None
    """Number of values of a range."""
    random: bool = False
    """Drawn from the range by Sobol's sequence, jointly with all other random parameters."""
    cases: dict[str, dict[str, Any]] | None = None
    """Changes of the experiment, by name; the key `experiment` takes another experiment."""
    sets: tuple[str, ...] = ()
    """Paths that are set to the value; by default the parameter's name."""
    times: tuple[str, ...] = ()
    """Paths that are multiplied by the value."""
    label: str = ""
    """Name with unit, for figures."""


class Best(Table, frozen=True):
    """The metric by which the settings are compared."""

    least: str = ""
    most: str = ""
    each: list[str] = msgspec.field(default_factory=list)
    """Parameters whose values are not chosen: there is a best setting for each of them."""

    @property
    def metric(self) -> str:
        """Name of the metric."""
        return self.least or self.most


class Map(Table, frozen=True):
    """A figure: the median of a metric over two parameters."""

    x: str
    y: str
    metric: str
    panels: str = ""
    """A third parameter: a panel for each of its values."""


class Curves(Table, frozen=True):
    """A figure: a metric over one parameter, with its range over the other parameters."""

    x: str
    metric: str
    lines: str = ""
    """A second parameter: a line for each of its values."""
    panels: str = ""
    """A third parameter: a panel for each of its values."""


class Study(Table, frozen=True, kw_only=True):
    """Study as its file states it: runs, parameters, metrics, table and figures."""

    title: str
    about: str = ""
    experiment: str
    """A name, or a TOML file beside the study's."""
    fixed: dict[str, Any] = msgspec.field(default_factory=dict)
    """Changes of the experiment in every run."""
    parameters: dict[str, StudyParameter]
    seeds: Count | list[Seed] = 1
    """Number of seeds, from 0 on, or a list of them."""
    samples: Annotated[int, Meta(ge=1, le=2**30)] | None = None
    """Number of points that are drawn for the random parameters."""
    samples_seed: Seed = 0
    metrics: list[str]
    window: tuple[float, float] | None = None
    """Begin and end of the evaluation of the force, after the first contact [s]; the whole contact if left out."""
    best: Best | None = None
    maps: list[Map] = msgspec.field(default_factory=list)
    curves: list[Curves] = msgspec.field(default_factory=list)


T = TypeVar("T")
_KEYS = frozenset(StudyParameter.__struct_fields__)
FILES = TomlFiles("study", "a", "palpate.studies", "shipped")
names, source = FILES.names, FILES.source


def load(name: str) -> Study:
    """A study by its name, or from a TOML file.

    Raises:
        InputError: no such study or file, TOML that does not parse, an unknown key, a value out of range.
    """
    return parse(source(name), name)


def parse(text: str, where: str) -> Study:
    """A study from TOML; `where` names the text in errors, and the user's own parts and metrics lie beside it."""
    if where.endswith(".toml"):
        look_in(Path(where).parent)
    tables = read_toml(text, where)
    try:
        study = _convert(tables)
        _check(study)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    return study


def flatten(changes: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Changes by dotted path; a table with a `kind` is one value."""
    flat: dict[str, Any] = {}
    for key, value in changes.items():
        if isinstance(value, dict) and "kind" not in value:
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _convert(tables: dict[str, Any]) -> Study:
    bad_number = not_finite(tables)
    if bad_number is not None:
        raise InputError(bad_number)
    if isinstance(tables.get("parameters"), dict):
        flat = _flatten_parameters(tables["parameters"], "")
        tables["parameters"] = {
            name: _convert_part(StudyParameter, table, f"the parameter {name!r}")
            for name, table in flat.items()
        }
    for key, kind in (("maps", Map), ("curves", Curves)):
        if isinstance(tables.get(key), list):
            tables[key] = [_convert_part(kind, table, f"[[{key}]]") for table in tables[key]]
    return convert_table(tables, Study)


def _convert_part(kind: type[T], table: Any, place: str) -> T:
    if not isinstance(table, dict):
        raise InputError(f"{place} must be a table, got {table!r}")
    try:
        return convert_table(table, kind)
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _flatten_parameters(tables: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Parameters by dotted path, whether TOML has the path in quotes or as nested tables."""
    flat: dict[str, Any] = {}
    for key, value in tables.items():
        name = f"{prefix}{key}"
        if isinstance(value, list):
            flat[name] = {"values": value}
        elif not isinstance(value, dict):
            raise InputError(
                f"the parameter {name!r} needs a list of values or a range, got {value!r}; "
                f"constants belong to [fixed]"
            )
        elif _KEYS & value.keys():
            flat[name] = value
        else:
            flat |= _flatten_parameters(value, f"{name}.")
    return flat


def _check(study: Study) -> None:
    if not study.metrics:
        raise InputError("metrics is empty; name at least one metric, such as 'force_rms'")
    if not study.parameters:
        raise InputError("[parameters] is empty; name at least one parameter")
    for name, parameter in study.parameters.items():
        _check_parameter(name, parameter)
    is_random = any(parameter.random for parameter in study.parameters.values())
    if is_random and study.samples is None:
        raise InputError("random parameters need samples, the number of points to draw")
    if study.samples is not None and not is_random:
        raise InputError("samples is for random parameters, and there are none; leave it out")
    if study.seeds == []:
        raise InputError("seeds is empty; give a number or a list of them")
    if study.window is not None and not 0.0 <= study.window[0] < study.window[1]:
        raise InputError(f"window must go from a time to a later one, from 0 on, got {list(study.window)}")
    _check_metrics(study)
    _check_figures(study)


def _check_metrics(study: Study) -> None:
    best = study.best
    if best is not None and bool(best.least) == bool(best.most):
        raise InputError("[best] needs one of least and most")
    shown = [map_.metric for map_ in study.maps] + [curves.metric for curves in study.curves]
    if best is not None:
        shown.append(best.metric)
    for name in (*study.metrics, *shown):
        metric_of(name)
    for name in shown:
        if name not in study.metrics:
            raise InputError(f"{name!r} is drawn or ranked by, and is not among the metrics; add it there")


def _check_parameter(name: str, parameter: StudyParameter) -> None:
    given = [key for key in ("values", "range", "log", "cases") if getattr(parameter, key) is not None]
    if len(given) != 1:
        raise InputError(
            f"the parameter {name!r} needs one of values, range, log and cases, got {given or 'none'}"
        )
    (kind,) = given
    if not getattr(parameter, kind):
        raise InputError(f"the parameter {name!r} has no values: the grid is empty; give it at least one")
    if kind in {"range", "log"}:
        low, high = getattr(parameter, kind)
        if not low < high:
            raise InputError(f"{kind} of the parameter {name!r} must go from low to high, got {[low, high]}")
        if (parameter.points is not None) == parameter.random:
            raise InputError(f"the parameter {name!r} is a {kind}: it takes one of points and random = true")
    elif parameter.points is not None or parameter.random:
        raise InputError(f"the parameter {name!r} has {kind}: points and random belong to range and log")
    if kind == "cases" and (parameter.sets or parameter.times):
        raise InputError(f"the parameter {name!r} has cases, which name their own targets")


def _check_figures(study: Study) -> None:
    names = list(study.best.each) if study.best else []
    for map_ in study.maps:
        names += [map_.x, map_.y, map_.panels]
    for curves in study.curves:
        names += [curves.x, curves.lines, curves.panels]
    for name in filter(None, names):
        if name not in study.parameters:
            raise unknown("parameter", name, study.parameters)
