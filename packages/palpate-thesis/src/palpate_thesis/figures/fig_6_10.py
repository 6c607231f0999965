"""Figure 6.10: the hybrid controller alone, without integral, on foam."""

from typing import NamedTuple

import numpy as np

from palpate.bench import with_values
from palpate.records import Record
from palpate.studies.metrics.following import SHARE
from palpate_thesis.force_control.tracking import FOAM, RUBBER, ForceStudy, since_contact

HYBRID = {
    "controller": {"kind": "hybrid", "kp": 400.0, "kv": 80.0, "kf": 0.25, "ki": 0.0},
    "run.press": 15.0,
}
PARAMETERS = with_values(FOAM, HYBRID)
SHOWN, FROM = (5.0, 15.0), 5.0


class Ends(NamedTuple):
    """Mean error of the true force in the last second of the intervals [N]; negative: too little."""

    high: float  # at 20 N
    low: float  # at 10 N


def misses(ends: Ends) -> bool:
    """True if both levels are missed by more than a tenth."""
    return abs(ends.high) > 20.0 * SHARE and abs(ends.low) > 10.0 * SHARE


def interval_ends(record: Record) -> Ends:
    """Mean errors at the end of the intervals of a run."""
    t = since_contact(record)
    late = (t >= FROM) & (np.mod(t + 5e-7, 2.5) >= 1.5)
    error, desired = record["force"] - record["force_desired"], record["force_desired"]
    return Ends(float(error[late & (desired == 20.0)].mean()), float(error[late & (desired == 10.0)].mean()))


STUDIES = (
    ForceStudy(
        "6.10",
        "hybrid-alone-falls-short",
        PARAMETERS,
        interval_ends,
        misses,
        size=lambda run: abs(run.high),
        label="error at 20 N [N]",
        limit=20.0 * SHARE,
        numbers=lambda data: {"foam": data.nominal, "rubber": data.varied["rubber"], "share": SHARE},
        shown=SHOWN,
        others={"rubber": with_values(RUBBER, HYBRID)},
    ),
)
