"""Figure 6.14: the neural controller with a small learning rate, minutes later."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import with_values
from palpate.bench.summary import CONTACT, LOST
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
from palpate_thesis.runs import RELAXING_FOAM, Runs

NUMBER = "6.14"
PARAMETERS = with_values(FOAM, {**SLOW_RATE, "run.press": 190.0, "run.duration": 300.0})
CYCLE = 5.0
"""Period of the steps [s]."""
SHOWN, JUDGED = (179.5, 185.5), (180.0, 190.0)
OTHERS: Mapping[str, Mapping[str, Any]] = {
    "foam that relaxes": RELAXING_FOAM,
    "PI, K_i = 1 per second": {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": 1.0}},
}


class CycleErrors(NamedTuple):
    """Error of each cycle outside the steps [N], up to the first loss of contact."""

    error: Array  # (cycles,)
    lost: float | None  # time of the loss [s]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    shown: Record
    nominal: list[Tracking]
    courses: dict[str, list[CycleErrors]]


def run(runs: Runs) -> Data:
    """190 s of contact; on the other foam and with the plain integral controller as well."""
    both = runs.over_seeds(PARAMETERS, lambda record: (tracking(*JUDGED)(record), cycle_errors(record)))
    nominal, courses = zip(*both, strict=True)
    others = runs.by_name({n: with_values(PARAMETERS, by) for n, by in OTHERS.items()}, cycle_errors, 2)
    return Data(slot(runs.record(PARAMETERS), *SHOWN), [*nominal], {"foam": [*courses], **others})


def check(data: Data) -> Sequence[ThesisClaim]:
    """The force has to follow from 180 to 190 s."""
    first = spread([float(c.error[:2].mean()) for c in data.courses["foam"]], "N")
    plain = spread([float(c.error[-2:].mean()) for c in data.courses["PI, K_i = 1 per second"]], "N")
    lost = [c.lost for c in data.courses["foam that relaxes"] if c.lost is not None]
    other = f"loses contact after {np.median(lost):.0f} s" if lost else "keeps contact"
    return [
        claim(
            "neural-slow-rate.later",
            following(data.nominal),
            described=describe(data.nominal),
            first=first,
            follows=FOLLOWS,
            plain=plain,
            others=other,
        )
    ]


def plot(data: Data) -> Figure:
    """Six seconds after three minutes."""
    return force_figure(data.shown)


def beside(data: Data) -> Figure:
    """Error outside the steps by cycles of 5 s, beside the equivalent integral controller; crosses: contact is lost."""
    drawing, ((course,),) = panels([2.4])
    for (name, runs), color in zip(data.courses.items(), style.SERIES[:3], strict=True):
        for i, run in enumerate(runs):
            t = CYCLE * (np.arange(len(run.error)) + 0.5)
            course.plot(t, run.error, color=color, linewidth=1, alpha=0.7, label=name if i == 0 else None)
            if run.lost is not None and len(t):
                course.plot(t[-1], run.error[-1], "x", color=color, markersize=9, markeredgewidth=2)
    course.axhline(LIMIT, **LIMIT_LINE, label="limit of following")
    course.set(xlabel="time since contact [s]", ylabel="RMS error outside steps [N]")
    course.set(xlim=(0.0, None), ylim=(0.0, None))
    style.legend(course)
    return drawing


def cycle_errors(record: Record) -> CycleErrors:
    """Error of each whole cycle up to the first loss of contact."""
    t, phase = since_contact(record), record["phase"]
    losses = np.nonzero((phase[1:] == LOST) & (phase[:-1] == CONTACT))[0]
    end = float(t[losses[0]]) if len(losses) else float(t[-1]) + 1e-3
    error = record["force"] - record["force_desired"]
    settled = (t >= 0.0) & (np.mod(t + 5e-7, 2.5) >= SETTLE)
    starts = CYCLE * np.arange(int((end + 1e-6) // CYCLE))
    values = [rms(error[settled & (t >= a) & (t < a + CYCLE)]) for a in starts]
    return CycleErrors(np.array(values), end if len(losses) else None)
