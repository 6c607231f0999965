"""Figures 4.2 and 4.4: the force through the switch from position to hybrid control, and its noise."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import load, with_values
from palpate.bench.summary import CONTACT, LOST
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import MAJORITY, Sentence, ThesisClaim, claim
from palpate_thesis.drawing import STATED, Figure, panels
from palpate_thesis.least_squares.press_runs import nearer
from palpate_thesis.runs import Runs

PARAMETERS = {
    surface: nearer(with_values(load(f"{surface}-hybrid"), {"run.press": 4.0}))
    for surface in ("foam", "rubber")
}
THRESHOLDS = (0.8, 1.2, 1.6, 2.0, 3.0, 5.0)
CHOSEN = 5.0
DESIRED, NEAR, OVERSHOOT = 20.0, 1.0, 0.25
BEFORE, AFTER = 0.6, 1.5
STEADY = 2.0
"""Seconds at the end of the press in which noise is looked at [s]."""


class Switch(NamedTuple):
    """The switch of one run."""

    true_force: float  # at the change-over [N]
    lost: bool  # whether the contact was lost afterwards
    last: float  # mean force of the last second [N]
    most: float  # largest force [N]

    @property
    def early(self) -> bool:
        """True if the run switched before the surface was touched."""
        return self.true_force <= 0.0

    @property
    def clean(self) -> bool:
        """Contact kept, no large overshoot, and the desired force reached."""
        reached = abs(self.last - DESIRED) <= NEAR and self.most <= (1.0 + OVERSHOOT) * DESIRED
        return not self.early and not self.lost and reached


def _start(record: Record) -> int:
    return int(np.argmax(record["phase"] == CONTACT))


def measure_switch(record: Record) -> Switch:
    """Change-over of a run from position to hybrid control."""
    force = record["force_measured"]
    lost = bool((record["phase"] == LOST).any())
    return Switch(record["force"][_start(record)], lost, float(force[-1000:].mean()), float(force.max()))


class SwitchData(NamedTuple):
    """The force around the switch, and what became of each run."""

    shown: dict[str, Record]
    switches: dict[str, list[Switch]]  # at 5 N, over the seeds
    by_threshold: dict[float, list[Switch]]  # on foam


class SwitchFigure:
    """Figure 4.2: the switch from position to hybrid control."""

    NUMBER = "4.2"

    def run(self, runs: Runs) -> SwitchData:
        """One run a seed on each surface; thresholds varied on foam."""
        short = with_values(PARAMETERS["foam"], {"run.press": 0.5, "run.duration": 20.0})
        thresholds = {f: with_values(short, {"approach.switch": f}) for f in THRESHOLDS}
        shown = {name: runs.record(e) for name, e in PARAMETERS.items()}
        switches = runs.by_name(PARAMETERS, measure_switch)
        return SwitchData(shown, switches, runs.by_name(thresholds, measure_switch))

    def check(self, data: SwitchData) -> Sequence[ThesisClaim]:
        """The switch is clean, and 5 N is a threshold that noise does not reach."""
        false = {f: sum(s.early for s in each) / len(each) for f, each in data.by_threshold.items()}
        early = max((f for f, part in false.items() if part > 0.0), default=0.0)
        enough = min((f for f in false if f > early), default=CHOSEN)
        clean = all(2 * sum(s.clean for s in each) > len(each) for each in data.switches.values())
        numbers = {"chosen": 100 * false[CHOSEN], "listing": 100 * false[THRESHOLDS[0]]}
        return [
            claim("switch-at-5N", clean, **data.switches),
            claim("switch-at-5N.threshold", false[CHOSEN] == 0.0, early=early, enough=enough, **numbers),
        ]

    def plot(self, data: SwitchData) -> Figure:
        """The force around the switch."""
        drawing, ((axis,),) = panels([3.4])
        for name, record in data.shown.items():
            t = record["t"] - record["t"][_start(record)]
            axis.plot(t, record["force_measured"], linewidth=1.0, label=name)
        axis.plot([0.0, AFTER], [DESIRED, DESIRED], **style.KNOWN, label="desired")
        axis.axvspan(-BEFORE, 0.0, color=style.MEASURED, alpha=0.10, linewidth=0.0)
        axis.text(-0.98 * BEFORE, 21.0, "position control", color=style.INK)
        axis.text(0.02, 23.2, "hybrid control", color=style.INK)
        axis.axhline(CHOSEN, **STATED)
        axis.set(xlabel="time since 5 N [s]", ylabel="force [N]", xlim=(-BEFORE, AFTER), ylim=(-2.5, 25.0))
        style.legend(axis)
        return drawing


def half_ranges(record: Record) -> tuple[float, float]:
    """Half of peak-to-peak of the sampled and of the filtered force at the end of a run [N]."""
    sampled, filtered = (float(np.ptp(values)) / 2 for values in _steady(record)[1:])
    return sampled, filtered


def _steady(record: Record) -> tuple[Array, Array, Array]:
    """Time, sampled and filtered force of the last seconds."""
    t = record["t"]
    last = (record["phase"] == CONTACT) & (t > t[-1] - STEADY)
    return t[last], record["force_sampled"][last], record["force_measured"][last]


NOISE = Sentence("force-noise", lambda ranges: 1.5 <= ranges[0] <= 2.5, fraction=MAJORITY)


class NoiseFigure:
    """Figure 4.4: the noise of the force signal."""

    NUMBER = "4.4"
    PARAMETERS = with_values(load("foam-hybrid"), {"run.press": 8.0})

    def run(self, runs: Runs) -> tuple[Record, list[tuple[float, float]]]:
        """One steady press, and the noise of one a seed."""
        return runs.record(self.PARAMETERS), runs.over_seeds(self.PARAMETERS, half_ranges)

    def check(self, data: tuple[Record, list[tuple[float, float]]]) -> Sequence[ThesisClaim]:
        """The half-range has to be 2 N within a quarter."""
        sampled, filtered = map(list, zip(*data[1], strict=True))
        return [NOISE.judge(data[1], half_range=sampled, filtered_half_range=filtered)]

    def plot(self, data: tuple[Record, list[tuple[float, float]]]) -> Figure:
        """Half a second of both signals."""
        drawing, (axis,) = style.figure(1, height=3.0)
        t, sampled, filtered = (values[:500] for values in _steady(data[0]))
        axis.plot(t - t[0], sampled, color=style.MEASURED, linewidth=0.9, label="as sampled")
        axis.plot(t - t[0], filtered, color=style.SERIES[0], linewidth=1.4, label="filtered at 120 Hz")
        axis.set(xlabel="time [s]", ylabel="force [N]")
        style.legend(axis)
        return drawing


STUDIES = (SwitchFigure(), NoiseFigure())
