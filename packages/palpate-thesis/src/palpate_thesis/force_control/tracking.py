"""Common parts of the force-control figures: experiments, criterion of following, varied conditions."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import CONTACT, losses
from palpate.records import Record
from palpate_studies.metrics import Window
from palpate_studies.metrics.following import LIMIT, SHARE, interval_error
from palpate_studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import often, spread
from palpate_thesis.conditions import RELAXING_FOAM, SHORT, friction_and_pose
from palpate_thesis.runs import VARIED_SEEDS, Runs

T = TypeVar("T")

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
    """How the true force kept to the desired one within a window."""

    rms: float  # of the error, steps included [N]
    settled: float  # of the error outside the first half second after each step [N]
    off: float  # largest mean error in the last second of an interval, as a share of the desired force
    saturated: float  # share of the time that motor 2 is at its limit
    lost: int  # how often contact was lost, from the start on

    @property
    def kept(self) -> bool:
        """Whether contact was kept and the run came to its end."""
        return self.lost == 0 and bool(np.isfinite(self.rms))

    @property
    def follows(self) -> bool:
        """Whether all that `FOLLOWING` asks for holds."""
        return self.lost == 0 and self.settled <= LIMIT and self.off <= SHARE


NEVER = Tracking(np.nan, np.nan, np.nan, np.nan, 0)


def since_contact(record: Record) -> Array:
    """Time since the first contact [s], shape (n,); negative before."""
    pressing = record["phase"] == CONTACT
    return record["t"] - record["t"][np.argmax(pressing)]


def tracking(start: float, end: float) -> Callable[[Record], Tracking]:
    """Measures a record from `start` to `end` after contact [s]."""

    def measure(record: Record) -> Tracking:
        look = Window(record, (start, end))
        if not look.touched:
            return NEVER
        if not len(look.error):
            return Tracking(np.nan, np.nan, np.nan, np.nan, losses(record))
        off, saturated = interval_error(look), float(look["saturated2"].mean())
        off = np.nan if off is None else off
        return Tracking(rms(look.error), rms(look.after_steps), off, saturated, losses(record))

    return measure


def following(found: Sequence[Tracking]) -> bool:
    """Whether enough runs follow."""
    return often(f.follows for f in found)


def describe(found: Sequence[Tracking]) -> str:
    """The measured column of a claim."""
    worst = spread([100 * f.off for f in found], "%", 2)
    text = f"RMS {spread([f.settled for f in found], 'N')} outside the steps, interval ends off by {worst}"
    lost = sum(f.lost > 0 for f in found)
    return f"{text}; {sum(f.follows for f in found)} of {len(found)} runs follow" + (
        f", {lost} lost contact" if lost else ""
    )


def slot(record: Record, start: float = 0.0, end: float = np.inf) -> Record:
    """A record from `start` to `end` after contact [s], its clock at zero at the first contact."""
    t = since_contact(record)
    shown = (t >= start) & (t < end)
    columns = {name: column[shown] for name, column in record.columns.items()}
    return Record({**columns, "t": t[shown]}, record.units, record.meta)


def variations(experiment: Experiment, seed: int) -> dict[str, Experiment]:
    """The experiment with other friction, at other poses, on the other foam, from other weights, as in the listing."""
    e = experiment
    by = friction_and_pose(e)
    if e.surface == FOAM.surface:
        by["relaxing\nfoam"] = RELAXING_FOAM
    if e.controller.__class__ is FOAM.controller.__class__:
        by["random\nweights"] = {"controller.weights": "random", "controller.weights_seed": seed}
        by["rate of\nthe listing"] = {"controller.learning_rate": 1e-4}
    if e.force.restart > 0.0:
        by["clock\nruns on"] = {"force.restart": 0.0}
        by["motor 2\nto 4 N m"] = {"robot.torque_limits": (16.0, 4.0, 0.6)}
    return {name: with_values(e, changes) for name, changes in by.items()}


def robustness(
    runs: Runs, experiment: Experiment, nominal: Sequence[T], measure: Callable[[Record], T]
) -> dict[str, list[T]]:
    """`measure` of each variation, the nominal case first."""
    cases: dict[str, list[tuple[Experiment, int]]] = {}
    for seed in runs.seeds[:VARIED_SEEDS]:
        for name, e in variations(experiment, seed).items():
            cases.setdefault(name, []).append((e, seed))
    return {"as\nchosen": list(nominal), **runs.map_each(lambda case: measure(runs.one(*case)), cases)}


class Tracked(NamedTuple):
    """Data of a figure of force tracking."""

    shown: Record
    nominal: list[Tracking]
    varied: dict[str, list[Tracking]]


def track(
    runs: Runs, experiment: Experiment, shown: tuple[float, float], judged: tuple[float, float]
) -> Tracked:
    """Runs an experiment over the seeds and under its variations.

    Args:
        runs: of how many seeds.
        experiment: long enough for both windows.
        shown: from when to when after contact the force is drawn [s].
        judged: from when to when it is measured [s].
    """
    measure = tracking(*judged)
    nominal = runs.over_seeds(experiment, measure)
    return Tracked(
        slot(runs.one(experiment), *shown), nominal, robustness(runs, experiment, nominal, measure)
    )
