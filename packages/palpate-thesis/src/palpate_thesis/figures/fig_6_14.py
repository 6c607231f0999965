"""Figure 6.14: the neural controller with a small learning rate, minutes later."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import with_values
from palpate.records import Record
from palpate.report import style
from palpate.studies.metrics.following import LIMIT
from palpate.studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.drawing import LIMIT_LINE, Figure, force_figure, panels
from palpate_thesis.figures.fig_6_11_17 import SLOW_RATE
from palpate_thesis.force_control.tracking import (
    FOAM,
    FOLLOWS,
    Tracking,
    describe,
    following,
    since_contact,
    slot,
    tracking,
)
from palpate_thesis.runs import Runs

NUMBER = "6.14"
PARAMETERS = with_values(FOAM, {**SLOW_RATE, "run.press": 190.0, "run.duration": 300.0})
CYCLE = 5.0
"""Period of the steps [s]."""
SHOWN, JUDGED = (179.5, 185.5), (180.0, 190.0)
PLAIN = {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": 1.0}}
"""The integral controller that the network equals at first."""


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    shown: Record
    nominal: list[Tracking]
    courses: dict[str, list[Array]]  # error of each cycle, by controller


def run(runs: Runs) -> Data:
    """190 s of contact; with the plain integral controller as well."""
    both = runs.over_seeds(PARAMETERS, lambda record: (tracking(*JUDGED)(record), cycle_errors(record)))
    nominal, courses = zip(*both, strict=True)
    plain = runs.by_name({"PI": with_values(PARAMETERS, PLAIN)}, cycle_errors, 2)
    return Data(slot(runs.record(PARAMETERS), *SHOWN), [*nominal], {"network": [*courses], **plain})


def check(data: Data) -> Sequence[ThesisClaim]:
    """The force has to follow from 180 to 190 s."""
    return [
        claim(
            "neural-slow-rate.later",
            following(data.nominal),
            described=describe(data.nominal),
            first=spread([float(error[:2].mean()) for error in data.courses["network"]], "N"),
            follows=FOLLOWS,
            plain=spread([float(error[-2:].mean()) for error in data.courses["PI"]], "N"),
        )
    ]


def plot(data: Data) -> Figure:
    """Six seconds after three minutes."""
    return force_figure(data.shown)


def beside(data: Data) -> Figure:
    """Error outside the steps by cycles of 5 s, beside the integral controller that the network equals at first."""
    drawing, ((course,),) = panels([2.4])
    for (name, runs), color in zip(data.courses.items(), style.SERIES[:2], strict=True):
        for i, error in enumerate(runs):
            t = CYCLE * (np.arange(len(error)) + 0.5)
            course.plot(t, error, color=color, linewidth=1, alpha=0.7, label=name if i == 0 else None)
    course.axhline(LIMIT, **LIMIT_LINE, label="limit of following")
    course.set(xlabel="time since contact [s]", ylabel="RMS error outside steps [N]")
    course.set(xlim=(0.0, None), ylim=(0.0, None))
    style.legend(course)
    return drawing


def cycle_errors(record: Record) -> Array:
    """RMS error outside the steps in each whole cycle from the first contact on [N], shape (cycles,)."""
    t, error = since_contact(record), record["force"] - record["force_desired"]
    settled = np.mod(t + 5e-7, 2.5) >= SETTLE
    starts = CYCLE * np.arange(int((float(t[-1]) + 1e-3) // CYCLE))
    return np.array([rms(error[settled & (t >= a) & (t < a + CYCLE)]) for a in starts])
