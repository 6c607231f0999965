"""A study: one TOML file with its experiment, parameters and metrics, and its tables; checked at the edge."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta

from palpate.bench.toml_parts import TomlFiles, explain, not_finite
from palpate.errors import InputError, unknown
from palpate.files import read_toml
from palpate.plugins import look_in
from palpate.signals.types import Positive, Table
from palpate_studies.metrics import metric_of

Points = Annotated[int, Meta(ge=1, le=1_000_000)]
Seed = Annotated[int, Meta(ge=0)]
DottedPath = str


class StudyParameter(Table, frozen=True):
    """One parameter: the values that it takes, and what of the experiment they are.

    The values are one of `values`, `range` or `log` (with `points`, or drawn at `random`), or `cases`.
    """

    values: list[Any] | None = None
    """As they stand."""
    range: tuple[float, float] | None = None
    """From the first to the last, evenly."""
    log: tuple[Positive, Positive] | None = None
    """From the first to the last, evenly in the logarithm."""
    points: Points | None = None
    """Of a range: how many."""
    random: bool = False
    """Drawn from the range by Sobol's sequence, together with all other parameters that are random."""
    cases: dict[str, dict[str, Any]] | None = None
    """Changes of the experiment by a name; `experiment` in one takes another experiment."""
    sets: tuple[DottedPath, ...] = ()
    """Paths that are set to the value; by default the parameter's own name."""
    times: tuple[DottedPath, ...] = ()
    """Paths that are multiplied by the value."""
    plus: tuple[DottedPath, ...] = ()
    """Paths to which the value is added."""
    factor: float = 1.0
    """The value is multiplied by this before it is used; tables and figures show it as it was."""
    label: str = ""
    """For figures, with the unit."""


class Best(Table, frozen=True):
    """Ranking of the settings by one metric."""

    least: str = ""
    most: str = ""
    each: list[str] = msgspec.field(default_factory=list)
    """Parameters for whose values there is a best setting each."""
    over: list[str] = msgspec.field(default_factory=list)
    """Parameters that are not chosen but met, as a surface is: settings are compared for each of their values, and so
    they are for every parameter that is drawn at random."""

    @property
    def metric(self) -> str:
        """The name of the figure's metric."""
        return self.least or self.most


class OptunaSearch(Table, frozen=True):
    """A search by Optuna in place of a grid."""

    trials: Annotated[int, Meta(ge=1)]
    """How many settings are tried, each with every seed."""
    batch: Annotated[int, Meta(ge=1)] = 4
    """How many of them at a time; they do not know of each other."""
    seed: Seed = 0


class Map(Table, frozen=True):
    """A figure: a metric over two parameters, the median over seeds and all else."""

    x: str
    y: str
    metric: str
    panels: str = ""
    """A third parameter: a panel for each of its values."""
    where: dict[str, Any] = msgspec.field(default_factory=dict)
    """Only the runs with these values of other parameters."""
    bound: Literal["", "linear"] = ""
    """Draws where the linear model of the loop loses its stability."""


class Curves(Table, frozen=True):
    """A figure: a metric over one parameter, with its spread over the seeds."""

    x: str
    metric: str
    lines: str = ""
    """A second parameter: a line for each of its values."""
    panels: str = ""
    """A third one: a panel for each of its values."""
    where: dict[str, Any] = msgspec.field(default_factory=dict)
    """Only the runs with these values of other parameters."""


class Against(Table, frozen=True):
    """Runs that the study is compared with: another controller, say, with the same seeds and metrics."""

    experiment: str = ""
    """When left out it is the study's, and so is what is fixed."""
    shares: list[str] = msgspec.field(default_factory=list)
    """Parameters of the study that it has, too."""
    fixed: dict[str, Any] = msgspec.field(default_factory=dict)
    parameters: dict[str, StudyParameter] = msgspec.field(default_factory=dict)


class Study(Table, frozen=True, kw_only=True):
    """A whole study, from its file."""

    title: str
    about: str = ""
    experiment: str
    """A name, or a TOML file beside the study's."""
    fixed: dict[str, Any] = msgspec.field(default_factory=dict)
    """Changes of the experiment in every run."""
    parameters: dict[str, StudyParameter]
    seeds: Annotated[int, Meta(ge=1, le=1_000_000)] | list[Seed] = 1
    """How many, from 0 on, or which."""
    samples: Annotated[int, Meta(ge=1, le=2**30)] | None = None
    """How many points are drawn, where parameters are random."""
    samples_seed: Seed = 0
    metrics: list[str]
    window: tuple[float, float] | None = None
    """From when to when after the first contact the force is measured [s]; to the end when left out."""
    best: Best | None = None
    against: dict[str, Against] = msgspec.field(default_factory=dict)
    search: OptunaSearch | None = None
    maps: list[Map] = msgspec.field(default_factory=list)
    curves: list[Curves] = msgspec.field(default_factory=list)
    keep_records: bool = False
    """Keep the record of every run, some 600 kB for each second of it."""


T = TypeVar("T")
VALUES = frozenset(StudyParameter.__struct_fields__)


FILES = TomlFiles("study", "a", "palpate_studies", ("shipped",))
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


def flat(changes: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Changes by dotted path; a table within them is one value if it says of which kind it is."""
    found: dict[str, Any] = {}
    for key, value in changes.items():
        if isinstance(value, dict) and "kind" not in value:
            found |= flat(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


def _convert(tables: dict[str, Any]) -> Study:
    bad = not_finite(tables)
    if bad is not None:
        raise InputError(bad)
    for name, other in _tables(tables.get("against")):
        _convert_parameters(other)
        tables["against"][name] = _as(Against, other, f"[against.{name}]")
    _convert_parameters(tables)
    for key, kind in (("maps", Map), ("curves", Curves)):
        if isinstance(tables.get(key), list):
            tables[key] = [_as(kind, one, f"[[{key}]]") for one in tables[key]]
    return _as(Study, tables)


def _convert_parameters(tables: dict[str, Any]) -> None:
    if isinstance(tables.get("parameters"), dict):
        flattened = _parameters(tables["parameters"], "")
        tables["parameters"] = {
            n: _as(StudyParameter, p, f"the parameter {n!r}") for n, p in flattened.items()
        }


def _as(kind: type[T], tables: Any, where: str = "") -> T:
    try:
        return msgspec.convert(tables, kind)
    except msgspec.ValidationError as error:
        if not isinstance(tables, dict):
            raise InputError(f"{where} must be a table, got {tables!r}") from error
        raise InputError(f"{where + ': ' if where else ''}{explain(str(error), tables, kind)}") from error


def _tables(value: Any) -> list[tuple[str, dict[str, Any]]]:
    return [(k, v) for k, v in value.items() if isinstance(v, dict)] if isinstance(value, dict) else []


def _parameters(tables: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Each by its dotted path, whether TOML was given the path in quotes or as nested tables."""
    found: dict[str, Any] = {}
    for key, value in tables.items():
        name = f"{prefix}{key}"
        if isinstance(value, list):
            found[name] = {"values": value}
        elif not isinstance(value, dict):
            raise InputError(
                f"the parameter {name!r} needs a list of values or a range, got {value!r}; "
                f"constants belong to [fixed]"
            )
        elif VALUES & value.keys():
            found[name] = value
        else:
            found |= _parameters(value, f"{name}.")
    return found


def _check(study: Study) -> None:
    if not study.metrics:
        raise InputError("metrics is empty; name at least one metric, such as 'force_rms'")
    _check_metrics(study)
    searched = study.search is not None
    everywhere = [
        *study.parameters.items(),
        *(p for a in study.against.values() for p in a.parameters.items()),
    ]
    for name, parameter in everywhere:
        _check_parameter(name, parameter, searched)
    if not study.parameters:
        raise InputError("[parameters] is empty; name at least one parameter")
    if searched:
        _check_search(study)
    drawn = any(p.random for _, p in everywhere)
    if drawn and study.samples is None:
        raise InputError("random parameters need samples, the number of points to draw")
    if study.samples is not None and not drawn:
        raise InputError("samples is for random parameters, and there are none; leave it out")
    if study.seeds == []:
        raise InputError("seeds is empty; give a number or a list of them")
    if study.window is not None and not 0.0 <= study.window[0] < study.window[1]:
        raise InputError(f"window must go from a time to a later one, from 0 on, got {list(study.window)}")
    _check_figures(study)


def _check_metrics(study: Study) -> None:
    best = study.best
    if best is not None and bool(best.least) == bool(best.most):
        raise InputError("[best] needs one of least and most")
    used = [
        *(m.metric for m in study.maps),
        *(c.metric for c in study.curves),
        *([best.metric] if best else []),
    ]
    for name in (*study.metrics, *used):
        metric_of(name)
    for name in used:
        if name not in study.metrics:
            raise InputError(f"{name!r} is drawn or ranked by, and is not among the metrics; add it there")


def _check_parameter(name: str, p: StudyParameter, searched: bool) -> None:
    given = [key for key in ("values", "range", "log", "cases") if getattr(p, key) is not None]
    if len(given) != 1:
        raise InputError(
            f"the parameter {name!r} needs one of values, range, log and cases, got {given or 'none'}"
        )
    (kind,) = given
    if not getattr(p, kind):
        raise InputError(f"the parameter {name!r} has no values: the grid is empty; give it at least one")
    if kind in {"range", "log"}:
        low, high = getattr(p, kind)
        if not low < high:
            raise InputError(f"{kind} of the parameter {name!r} must go from low to high, got {[low, high]}")
        if searched == (p.points is not None or p.random) or (p.points is not None and p.random):
            how = "neither points nor random in a search" if searched else "one of points and random = true"
            raise InputError(f"the parameter {name!r} is a {kind}: it takes {how}")
    elif p.points is not None or p.random:
        raise InputError(f"the parameter {name!r} has {kind}: points and random belong to range and log")
    if kind == "cases" and (p.sets or p.times or p.plus or p.factor != 1.0):
        raise InputError(f"the parameter {name!r} has cases, which name their own targets")


def _check_search(study: Study) -> None:
    if study.best is None:
        raise InputError("[search] needs [best]: the metric to optimise")
    if study.against:
        raise InputError("[search] and [against] do not go together; measure the other in a study of its own")
    if "seed" in study.parameters:
        raise InputError("a seed cannot be searched; give the number of seeds in seeds")
    if study.best.each:
        raise InputError("a search has one best setting; leave each out of [best]")


def _check_figures(study: Study) -> None:
    for name in (*study.best.each, *study.best.over) if study.best else ():
        if name not in study.parameters:
            raise unknown("parameter", name, study.parameters)
    drawn: list[Map | Curves] = [*study.maps, *study.curves]
    for figure in drawn:
        roles = [getattr(figure, role, "") for role in ("x", "y", "lines", "panels")]
        for name in (*roles, *flat(figure.where)):
            if name and name not in study.parameters:
                raise unknown("parameter", name, study.parameters)
