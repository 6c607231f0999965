"""Figure 4.2: the force through the switch from position to hybrid control."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT, LOST
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.drawing import STATED, Figure, panels
from palpate_thesis.least_squares import press_runs
from palpate_thesis.runs import Runs

NUMBER = "4.2"
PARAMETERS = {
    "foam": press_runs.nearer(with_values(load("foam-hybrid"), {"run.press": 4.0})),
    "rubber": press_runs.nearer(with_values(load("rubber-hybrid"), {"run.press": 4.0})),
}
THRESHOLDS = (0.8, 1.2, 1.6, 2.0, 3.0, 5.0)
CHOSEN = 5.0
DESIRED, NEAR, OVERSHOOT = 20.0, 1.0, 0.25
BEFORE, AFTER = 0.6, 1.5


class Switch(NamedTuple):
    """The switch of one run."""

    true_force: float  # at the change-over [N]
    lost: bool  # whether the contact was lost afterwards
    last: float  # mean force of the last second [N]
    most: float  # largest force [N]

    @property
    def clean(self) -> bool:
        """Contact kept, no large overshoot, and the desired force reached."""
        reached = abs(self.last - DESIRED) <= NEAR and self.most <= (1.0 + OVERSHOOT) * DESIRED
        return self.true_force > 0.0 and not self.lost and reached


class Data(NamedTuple):
    """The force around the switch, and what became of each run."""

    shown: dict[str, tuple[Array, Array]]  # time from the switch [s], measured force [N]
    switches: dict[str, list[Switch]]  # at 5 N, over the seeds
    by_threshold: dict[float, list[Switch]]  # on foam


def run(runs: Runs) -> Data:
    """One run a seed on each surface; thresholds varied on foam."""
    foam = PARAMETERS["foam"]
    short = {"run.press": 0.5, "run.duration": 20.0}
    thresholds = {f: with_values(foam, {"approach.switch": f, **short}) for f in THRESHOLDS}
    return Data(
        shown={name: _around(runs.record(e)) for name, e in PARAMETERS.items()},
        switches=runs.by_name(PARAMETERS, measure_switch),
        by_threshold=runs.by_name(thresholds, measure_switch),
    )


def _start(record: Record) -> int:
    return int(np.argmax(record["phase"] == CONTACT))


def _around(record: Record) -> tuple[Array, Array]:
    t = record["t"] - record["t"][_start(record)]
    shown = (t >= -BEFORE) & (t <= AFTER)
    return t[shown], record["force_measured"][shown]


def measure_switch(record: Record) -> Switch:
    """Change-over of a run from position to hybrid control."""
    force = record["force_measured"]
    lost = bool((record["phase"] == LOST).any())
    return Switch(record["force"][_start(record)], lost, float(force[-1000:].mean()), float(force.max()))


def check(data: Data) -> Sequence[ThesisClaim]:
    """The switch is clean, and 5 N is a threshold that noise does not reach."""
    early = max((f for f, switches in data.by_threshold.items() if _false(switches) > 0.0), default=0.0)
    enough = min((f for f in data.by_threshold if f > early), default=CHOSEN)
    chosen, listing = data.by_threshold[CHOSEN], data.by_threshold[THRESHOLDS[0]]
    return [
        claim(
            "switch-at-5N",
            all(2 * sum(s.clean for s in each) > len(each) for each in data.switches.values()),
            **data.switches,
        ),
        claim(
            "switch-at-5N.threshold",
            _false(chosen) == 0.0,
            chosen=100 * _false(chosen),
            listing=100 * _false(listing),
            early=early,
            enough=enough,
        ),
    ]


def _false(switches: Sequence[Switch]) -> float:
    """Fraction of the runs that switched before the surface was touched."""
    return sum(s.true_force <= 0.0 for s in switches) / len(switches)


def plot(data: Data) -> Figure:
    """The force around the switch."""
    drawing, ((axis,),) = panels([3.4])
    for name, (t, force) in data.shown.items():
        axis.plot(t, force, linewidth=1.0, label=name)
    axis.plot([0.0, AFTER], [DESIRED, DESIRED], **style.KNOWN, label="desired")
    axis.axvspan(-BEFORE, 0.0, color=style.MEASURED, alpha=0.10, linewidth=0.0)
    axis.text(-0.98 * BEFORE, 21.0, "position control", color=style.INK)
    axis.text(0.02, 23.2, "hybrid control", color=style.INK)
    axis.axhline(CHOSEN, **STATED)
    axis.set(xlabel="time since 5 N [s]", ylabel="force [N]", xlim=(-BEFORE, AFTER), ylim=(-2.5, 25.0))
    style.legend(axis)
    return drawing
