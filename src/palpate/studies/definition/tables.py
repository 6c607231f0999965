"""The tables of a study's file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from palpate.signals.types import Positive, Table

Points = Annotated[int, Meta(ge=1, le=1_000_000)]
Seed = Annotated[int, Meta(ge=0)]
Path = str


class Parameter(Table, frozen=True):
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
    sets: tuple[Path, ...] = ()
    """Paths that are set to the value; by default the parameter's own name."""
    times: tuple[Path, ...] = ()
    """Paths that are multiplied by the value."""
    plus: tuple[Path, ...] = ()
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
        """The metric's name."""
        return self.least or self.most


class Search(Table, frozen=True):
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
    parameters: dict[str, Parameter] = msgspec.field(default_factory=dict)


class Study(Table, frozen=True, kw_only=True):
    """A whole study."""

    title: str
    about: str = ""
    experiment: str
    """A name, or a TOML file beside the study's."""
    fixed: dict[str, Any] = msgspec.field(default_factory=dict)
    """Changes of the experiment in every run."""
    parameters: dict[str, Parameter]
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
    search: Search | None = None
    maps: list[Map] = msgspec.field(default_factory=list)
    curves: list[Curves] = msgspec.field(default_factory=list)
    keep_records: bool = False
    """Keep the record of every run, some 600 kB for each second of it."""
