"""Figure 6.10: the hybrid controller alone, without integral, on foam."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.bench import with_values
from palpate.records import Record
from palpate.studies.metrics.following import SHARE
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import Figure, force_figure, panels, strip
from palpate_thesis.force_control.tracking import FOAM, RUBBER, robustness, since_contact, slot
from palpate_thesis.runs import Runs, stops_holding

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
    nominal = runs.over_seeds(PARAMETERS, interval_ends)
    varied = robustness(runs, PARAMETERS, nominal, interval_ends)
    rubber = with_values(RUBBER, {**HYBRID, "run.press": 15.0})
    varied["rubber"] = runs.over_seeds(rubber, interval_ends)
    return Data(slot(runs.record(PARAMETERS), *SHOWN), nominal, varied)


def check(data: Data) -> Sequence[ThesisClaim]:
    """At both levels the error has to exceed a tenth of the desired force."""
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
    """Draw the two cycles of the figure."""
    return force_figure(data.shown)


def beside(data: Data) -> Figure:
    """Error at 20 N under each variation; dashed: a tenth of the desired force."""
    drawing, ((axis,),) = panels([2.2])
    errors = {name: [abs(ends.high) for ends in runs] for name, runs in data.varied.items()}
    strip(axis, errors, "error at 20 N [N]", 20.0 * SHARE)
    return drawing


def misses(ends: Ends) -> bool:
    """True if both levels are missed by more than a tenth."""
    return abs(ends.high) > 20.0 * SHARE and abs(ends.low) > 10.0 * SHARE


def interval_ends(record: Record) -> Ends:
    """Mean errors at the end of the intervals of a run."""
    t = since_contact(record)
    late = (t >= FROM) & (np.mod(t + 5e-7, 2.5) >= 1.5)
    error, desired = record["force"] - record["force_desired"], record["force_desired"]
    return Ends(float(error[late & (desired == 20.0)].mean()), float(error[late & (desired == 10.0)].mean()))
