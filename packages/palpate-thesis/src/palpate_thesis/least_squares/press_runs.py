"""Presses for the least-squares figures, their estimates, and varied conditions."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate_thesis.runs import NEAREST_WALL, move_wall, rougher

PRESS = 8.0
"""Seconds of contact: the first four as in figures 6.1, 6.3 and 6.4, and the slot of 6.2 and 6.5."""
FIRST = 4.0
"""Length of the figures' first slot [s]."""
MASS_FROM = 10
"""First sample of a mass that sets the scale of its panel."""
SLOT = (6.0, 8.0)
"""Chosen: "some time after" the first slot [s]."""


def own_damping(surface: Mapping[str, Any]) -> float:
    """Damping of a surface [N s/m]: at 20 N if it grows with the depth; of a relaxing one, that of its dashpot."""
    damping = float(surface["damping"])
    return damping * 20.0 / float(surface["stiffness"]) if surface["kind"] == "hunt-crossley" else damping


def nearer(experiment: Experiment) -> Experiment:
    """The press with a shorter approach in steps of the same size: the approach takes most of a run's time."""
    wall = experiment.wall.x
    return with_values(
        experiment,
        {"approach.hold": 0.5, "robot.start": (wall - 0.005, 0.0, 0.0), "approach.first": wall - 0.001},
    )


PLAIN = nearer(with_values(load("foam-rls"), {"run.press": PRESS, "surface.stiffness": 5400.0}))
"""Foam without memory. Its K is chosen so that f/x comes out at the thesis' 6.8 kN/m."""
RELAXING = nearer(with_values(load("foam-viscoelastic"), {"run.press": PRESS}))
RUBBER = nearer(with_values(load("rubber-rls"), {"run.press": PRESS}))
COLUMNS = (
    *("t", "force", "force_sampled", "force_measured", "displacement", "x", "x_measured"),
    *("vx_raw", "ax_raw", "ax_measured", "penetration"),
    *(f"{key}_{front}" for front in ("thesis", "raw", "matched") for key in "MBK"),
)


def contact(record: Record) -> Record:
    """First press of a run: the columns for least squares, with time zero at the change-over to hybrid control."""
    pressing = record["phase"] == CONTACT
    start = int(np.argmax(pressing))
    later = np.flatnonzero(~pressing[start:])
    rows = slice(start, start + int(later[0]) if len(later) else len(record))
    columns = {name: record[name][rows] for name in COLUMNS}
    columns["t"] = columns["t"] - columns["t"][0]
    return Record(columns, {name: record.units[name] for name in COLUMNS}, record.meta)


def between(press: Record, start: float, stop: float) -> Mask:
    """Mask of the samples of a press in a time slot [s]."""
    return (press["t"] >= start) & (press["t"] < stop)


def at(press: Record, column: str, time: float) -> float:
    """Value of a column `time` seconds after the change-over; NaN if the press was shorter."""
    i = round(time * 1000)
    return float(press[column][i]) if i < len(press) else float("nan")


def ratio(press: Record) -> float:
    """Mean force over mean displacement in the later slot [N/m]: the thesis' "f/x"."""
    inside = between(press, *SLOT)
    if not inside.any():
        return float("nan")
    return float(press["force_measured"][inside].mean() / press["displacement"][inside].mean())


def settled_after(values: Array, end: float = FIRST, band: float = 0.10, tick: float = 1e-3) -> float:
    """Time from which values stay within `band` of their value at `end` [s]."""
    return _within_after(values[: round(end / tick)], band, 0.0, tick)


def mass_settled_after(values: Array, end: float = FIRST, band: float = 0.10, tick: float = 1e-3) -> float:
    """Time from which a mass stays within `band` of its largest value in the panel [s].

    A mass ends near zero, where a fraction of the value itself is no criterion: a reader of the panel sees its scale.
    The first 10 ms do not count, because the signals' lag of 7.6 ms leaves the estimate undetermined.
    """
    values = values[: round(end / tick)]
    return _within_after(values, band, float(np.abs(values[MASS_FROM:]).max(initial=0.0)), tick)


def _within_after(values: Array, band: float, scale: float, tick: float) -> float:
    outside = np.flatnonzero(np.abs(values - values[-1]) > band * max(scale, abs(values[-1])))
    return (float(outside[-1]) + 1.0) * tick if len(outside) else 0.0


def conditions(experiment: Experiment) -> dict[str, Experiment]:
    """Variations of one unstated parameter at a time: friction, pose, the surface's B and M."""
    surface = experiment.surface
    by: dict[str, Mapping[str, Any]] = {
        "friction halved": rougher(experiment, 0.5, "coulomb", "static"),
        "friction doubled": rougher(experiment, 2.0, "coulomb", "static"),
        "wall at 0.457 m": move_wall(experiment, NEAREST_WALL),
        "wall at 0.49 m": move_wall(experiment, 0.49),
        "B halved": {"surface.damping": 0.5 * surface.damping},
        "B doubled": {"surface.damping": 2.0 * surface.damping},
        "M = 0.5 kg": {"surface.mass": 0.5},
    }
    return {name: with_values(experiment, changes) for name, changes in by.items()}


class PressEstimates(NamedTuple):
    """Least-squares estimates of one press."""

    ratio: float  # f/x in the later slot [N/m]
    M: float  # at the end of the later slot, as B and K
    B: float
    K: float
    M_raw: float
    B_raw: float
    K_raw: float
    settled_M: float  # [s]
    settled_B: float
    settled_K: float
    true_B: float  # damping of the surface: see `own_damping` [N s/m]

    @property
    def apart(self) -> float:
        """Relative difference of K and f/x."""
        return self.K / self.ratio - 1.0

    @property
    def apart_raw(self) -> float:
        """Relative difference of K from raw signals and f/x."""
        return self.K_raw / self.ratio - 1.0


def press_estimates(record: Record) -> PressEstimates:
    """Estimates of the first press of a run."""
    press = contact(record)
    end = SLOT[1] - 0.002
    values = {name: at(press, f"{name}_thesis", end) for name in "MBK"}
    raw = {f"{name}_raw": at(press, f"{name}_raw", end) for name in "MBK"}
    settled = {f"settled_{name}": settled_after(press[f"{name}_thesis"]) for name in "BK"}
    settled["settled_M"] = mass_settled_after(press["M_thesis"])
    damping = own_damping(record.meta["experiment"]["surface"])
    return PressEstimates(ratio(press), **values, **raw, **settled, true_B=damping)


def median(values: Sequence[float] | Array) -> float:
    """Median of the values that are numbers."""
    return float(np.nanmedian(np.asarray(values, dtype=float)))
