"""Figure 6.10: the hybrid controller alone, without integral, on foam."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.bench import with_values
from palpate.records import Record
from palpate_studies.metrics.following import SHARE
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.conditions import stops_holding
from palpate_thesis.force_control.panels import dots_panel, force_panel, panels
from palpate_thesis.force_control.tracking import FOAM, RUBBER, robustness, since_contact, slot
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "6.10"
HYBRID = {"controller": {"kind": "hybrid", "kp": 400.0, "kv": 80.0, "kf": 0.25, "ki": 0.0}}
PARAMETERS = with_values(FOAM, {**HYBRID, "run.press": 15.0})
SHOWN, FROM = (5.0, 15.0), 5.0


class Ends(NamedTuple):
    """Mean error of the true force in the last second of the intervals [N]; negative: too little."""

    high: float  # at 20 N
    low: float  # at 10 N


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    shown: Record
    nominal: list[Ends]
    varied: dict[str, list[Ends]]


def run(runs: Runs) -> Data:
    """Fifteen seconds of contact; the same on rubber and under the variations."""
    nominal = runs.over_seeds(PARAMETERS, ends_of)
    varied = robustness(runs, PARAMETERS, nominal, ends_of)
    rubber = with_values(RUBBER, {**HYBRID, "run.press": 15.0})
    varied["rubber"] = runs.over_seeds(rubber, ends_of)
    return Data(slot(runs.one(PARAMETERS), *SHOWN), nominal, varied)


def check(data: Data) -> Sequence[ThesisClaim]:
    """At both levels the error has to be more than a tenth of the desired force."""
    return [
        claim(
            "hybrid-alone-falls-short",
            often(map(misses, data.nominal)),
            foam=data.nominal,
            rubber=data.varied["rubber"],
            share=SHARE,
            where=stops_holding(data.varied, misses),
        )
    ]


def plot(data: Data) -> Figure:
    """Two cycles, and the ends of the intervals of all runs."""
    drawing, ((force,), (dots,)) = panels([3.2, 2.0])
    force_panel(force, data.shown)
    dots_panel(dots, data.varied, lambda e: abs(e.high), misses, 20.0 * SHARE)
    dots.set(
        ylabel="error at 20 N [N]",
        title="end of the 20 N intervals, a dot misses both levels, as claimed, a cross does not; dashed: 10 %",
    )
    return drawing


def misses(ends: Ends) -> bool:
    """Whether both levels are missed by more than a tenth."""
    return abs(ends.high) > 20.0 * SHARE and abs(ends.low) > 10.0 * SHARE


def ends_of(record: Record) -> Ends:
    """Where the intervals of a run end."""
    t = since_contact(record)
    late = (t >= FROM) & (np.mod(t + 5e-7, 2.5) >= 1.5)
    error, desired = record["force"] - record["force_desired"], record["force_desired"]
    return Ends(float(error[late & (desired == 20.0)].mean()), float(error[late & (desired == 10.0)].mean()))
