"""Figure 6.10: the hybrid controller alone, without integral, on foam."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.bench import changed
from palpate.bench.metrics.following import SHARE
from palpate.records import Record
from palpate.thesis.claims import Claim, decided, often, spread
from palpate.thesis.conditions import stops_holding
from palpate.thesis.force_control.panels import dots_panel, force_panel, panels
from palpate.thesis.force_control.tracking import FOAM, RUBBER, robustness, since_contact, slot
from palpate.thesis.runs import Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBER = "6.10"
TITLE = "Hybrid controller alone on foam: steps between 10 and 20 N"
CAPTION = (
    "The hybrid controller with K_fp = 0.25 and no integral, with steps of the desired force between 10 and 20 N. The "
    "thesis says that the force cannot reach the desired one. Below: the remaining error at the end of the intervals."
)
HYBRID = {"controller": {"kind": "hybrid", "kp": 400.0, "kv": 80.0, "kf": 0.25, "ki": 0.0}}
PARAMETERS = changed(FOAM, {**HYBRID, "run.press": 15.0})
SHOWN, FROM = (5.0, 15.0), 5.0


@dataclass(frozen=True)
class Ends:
    """Mean error of the true force in the last second of the intervals [N]; negative: too little."""

    high: float  # at 20 N
    low: float  # at 10 N


@dataclass(frozen=True)
class Data:
    """Measured values for `check` and `plot`."""

    shown: Record
    nominal: list[Ends]
    varied: dict[str, list[Ends]]
    rubber: list[Ends]


def run(runs: Runs) -> Data:
    """Fifteen seconds of contact; the same on rubber and under the variations."""
    nominal = runs.over_seeds(PARAMETERS, ends_of)
    varied = robustness(runs, PARAMETERS, nominal, ends_of)
    rubber = changed(RUBBER, {**HYBRID, "run.press": 15.0})
    varied["rubber"] = runs.over_seeds(rubber, ends_of)
    return Data(slot(runs.one(PARAMETERS), *SHOWN), nominal, varied, varied["rubber"])


def check(data: Data) -> Sequence[Claim]:
    """At both levels the error has to be more than a tenth of the desired force."""
    return [
        Claim(
            id="hybrid-alone-falls-short",
            source="fig. 6.10, sec. 6.3",
            claim="The hybrid controller alone (K_fp 0.25, no integral) cannot reach the force of the 10/20 N steps.",
            thesis="cannot reach the desired force",
            measured=(
                f"at 20 N {spread([e.high for e in data.nominal], 'N')}, at 10 N "
                f"{spread([e.low for e in data.nominal], 'N')}; on rubber at 20 N "
                f"{spread([e.high for e in data.rubber], 'N')}"
            ),
            tolerance=(
                "in 9 of 10 runs: the true force's mean over the last second of the intervals is off by "
                f"more than {SHARE:.0%} of the desired force, at 20 N and at 10 N"
            ),
            verdict=decided(often(map(misses, data.nominal))),
            note=(
                "Too little at 20 N and too much at 10 N: the error is the friction of the joints, which opposes the "
                "motion and which the gain of 1 + K_fp = 1.25 hardly reduces. The levels of friction are chosen. The "
                "claim depends on them and on the surface, because on stiff rubber the tip hardly moves and friction "
                f"stays elastic. {stops_holding(data.varied, misses)}"
            ),
        )
    ]


def plot(data: Data) -> Figure:
    """Two cycles, and the ends of the intervals of all runs."""
    drawing, ((force,), (dots,)) = panels([3.2, 2.0])
    force_panel(force, data.shown)
    dots_panel(
        dots,
        data.varied,
        lambda e: abs(e.high),
        misses,
        limit=20.0 * SHARE,
        label="error at 20 N [N]",
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
