"""Experiments of force control, and the criterion of following."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT, losses
from palpate.records import Record
from palpate.studies.metrics import Window
from palpate.studies.metrics.following import LIMIT, SHARE, interval_error
from palpate.studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import spread
from palpate_thesis.runs import SHORT

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


def hybrid(kf: float, ki: float) -> dict[str, Any]:
    """Changes that put the hybrid controller with these force gains in place of the neural one."""
    return {"controller": {"kind": "hybrid", "kp": 400.0, "kv": 80.0, "kf": kf, "ki": ki}}


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


def since_contact(record: Record) -> Array:
    """Time since the first contact [s], shape (n,); negative before."""
    pressing = record["phase"] == CONTACT
    return record["t"] - record["t"][np.argmax(pressing)]


def tracking(start: float, end: float) -> Callable[[Record], Tracking]:
    """Function that measures a record from `start` to `end` after contact [s]."""

    def measure(record: Record) -> Tracking:
        window = Window(record, (start, end))
        if not window.touched or not len(window.error):
            return Tracking(np.nan, np.nan, np.nan, np.nan, losses(record) if window.touched else 0)
        off, saturated = interval_error(window), float(window["saturated2"].mean())
        off = np.nan if off is None else off
        return Tracking(rms(window.error), rms(window.after_steps), off, saturated, losses(record))

    return measure


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
