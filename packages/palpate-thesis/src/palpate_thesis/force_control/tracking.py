"""Experiments of force control, the criterion of following, and varied conditions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import CONTACT, losses
from palpate.records import Record
from palpate.studies.metrics import Window
from palpate.studies.metrics.following import LIMIT, SHARE, interval_error
from palpate.studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import ThesisClaim, claim, often, spread
from palpate_thesis.drawing import Figure, force_figure, panels, strip
from palpate_thesis.runs import RELAXING_FOAM, SHORT, VARIED_SEEDS, Runs, friction_and_pose

FOLLOWING = (
    f"no loss of contact; RMS of the true force's error at most {LIMIT:g} N (10 % of the mean desired force) "
    f"outside the first {SETTLE:g} s after each step; mean error in the last second of each interval at most "
    f"{100 * SHARE:.0f} % of the desired force"
)
FOLLOWS = f"in 9 of 10 runs: {FOLLOWING}"
SINE = {"force.amplitude": 4.0, "force.frequency": 0.5, "force.restart": 5.0}
"""4 sin(pi t), its clock started anew every 5 s as the listing does; that turns the sine's sign each time."""
FOAM = with_values(load("foam-neural"), SHORT)
RUBBER = with_values(load("rubber-neural"), SHORT)


class Tracking(NamedTuple):
    """Tracking error of the true force within a window."""

    rms: float  # of the error, steps included [N]
    settled: float  # RMS of the error outside the first half second after each step [N]
    off: float  # largest mean error in the last second of an interval, as a fraction of the desired force
    saturated: float  # fraction of the time that motor 2 is at its limit
    lost: int  # losses of contact since the start

    @property
    def kept(self) -> bool:
        """True if contact was kept and the run came to its end."""
        return self.lost == 0 and bool(np.isfinite(self.rms))

    @property
    def follows(self) -> bool:
        """True if the criterion `FOLLOWING` is met."""
        return self.lost == 0 and self.settled <= LIMIT and self.off <= SHARE


NEVER = Tracking(np.nan, np.nan, np.nan, np.nan, 0)


def since_contact(record: Record) -> Array:
    """Time since the first contact [s], shape (n,); negative before."""
    pressing = record["phase"] == CONTACT
    return record["t"] - record["t"][np.argmax(pressing)]


def tracking(start: float, end: float) -> Callable[[Record], Tracking]:
    """Function that measures a record from `start` to `end` after contact [s]."""

    def measure(record: Record) -> Tracking:
        window = Window(record, (start, end))
        if not window.touched:
            return NEVER
        if not len(window.error):
            return Tracking(np.nan, np.nan, np.nan, np.nan, losses(record))
        off, saturated = interval_error(window), float(window["saturated2"].mean())
        off = np.nan if off is None else off
        return Tracking(rms(window.error), rms(window.after_steps), off, saturated, losses(record))

    return measure


def following(runs: Sequence[Tracking]) -> bool:
    """True if enough runs follow."""
    return often(run.follows for run in runs)


def describe(runs: Sequence[Tracking]) -> str:
    """Tracking errors of the runs in words, for the measured value of a claim."""
    worst = spread([100 * run.off for run in runs], "%", 2)
    settled = spread([run.settled for run in runs], "N")
    follow = f"{sum(run.follows for run in runs)} of {len(runs)} runs follow"
    lost = sum(run.lost > 0 for run in runs)
    return f"RMS {settled} outside the steps, interval ends off by {worst}; {follow}" + (
        f", {lost} lost contact" if lost else ""
    )


def slot(record: Record, start: float = 0.0, end: float = np.inf) -> Record:
    """Part of a record from `start` to `end` after contact [s]; its time starts at the first contact."""
    t = since_contact(record)
    rows = (t >= start) & (t < end)
    columns = {name: column[rows] for name, column in record.columns.items()}
    return Record({**columns, "t": t[rows]}, record.units, record.meta)


def variations(experiment: Experiment) -> dict[str, Experiment]:
    """The experiment with other friction and poses, and with a foam that relaxes in place of foam."""
    by = friction_and_pose(experiment)
    if experiment.surface == FOAM.surface:
        by["relaxing\nfoam"] = RELAXING_FOAM
    return {name: with_values(experiment, changes) for name, changes in by.items()}


class Tracked(NamedTuple):
    """Data of a figure of force control."""

    shown: Record
    nominal: list[Any]  # metric of each seed
    varied: dict[str, list[Any]]  # the same by variation


@dataclass(frozen=True, eq=False)
class ForceStudy:
    """A figure of the force: an experiment, a metric, a threshold and a panel.

    Args:
        NUMBER: of the figure.
        id: of its claim.
        PARAMETERS: experiment, long enough for all windows.
        measure: metric of a run.
        agrees: True if a run does what the thesis says.
        size: number of a run that is drawn beside the limit.
        label: of that number, with its unit.
        limit: of that number, beyond which a run does not agree.
        numbers: values of the placeholders in the claim's texts.
        shown: from when to when after contact the force is drawn [s].
        others: experiments that are measured over all seeds as well, among the variations.
    """

    NUMBER: str
    id: str
    PARAMETERS: Experiment
    measure: Callable[[Record], Any]
    agrees: Callable[[Any], bool]
    size: Callable[[Any], float]
    label: str
    limit: float
    numbers: Callable[[Tracked], dict[str, Any]]
    shown: tuple[float, float] = (9.5, 13.5)
    others: Mapping[str, Experiment] = field(default_factory=dict)

    def run(self, runs: Runs) -> Any:
        """All seeds, and the variations."""
        nominal = runs.over_seeds(self.PARAMETERS, self.measure)
        varied = runs.by_name(variations(self.PARAMETERS), self.measure, VARIED_SEEDS)
        others = runs.by_name(self.others, self.measure)
        shown = slot(runs.record(self.PARAMETERS), *self.shown)
        return Tracked(shown, nominal, {"as\nchosen": nominal, **varied, **others})

    def check(self, data: Any) -> list[ThesisClaim]:
        """Does the force do as the thesis says in enough of the runs?"""
        return [claim(self.id, often(map(self.agrees, data.nominal)), **self.numbers(data))]

    def plot(self, data: Any) -> Figure:
        """The force in the slot."""
        return force_figure(data.shown)

    def beside(self, data: Any) -> Figure:
        """Error of each run under each variation; dashed: the limit."""
        drawing, ((axis,),) = panels([2.2])
        sizes = {name: list(map(self.size, runs)) for name, runs in data.varied.items()}
        strip(axis, sizes, self.label, self.limit)
        return drawing
