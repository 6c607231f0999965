"""Presses for the least-squares figures, and their estimates."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import CONTACT
from palpate.records import Record

PRESS = 8.0
"""Seconds of contact: the first four as in figures 6.1, 6.3 and 6.4, and the slot of 6.2 and 6.5."""
FIRST = 4.0
"""Length of the figures' first slot [s]."""
MASS_FROM = 10
"""First sample of a mass that sets the scale of its panel."""
SLOT = (6.0, 8.0)
"""Chosen: "some time after" the first slot [s]."""
MOVING = 0.5
"""Seconds after the change-over in which the surface moves enough for B and M to be looked for."""
LEAST_VELOCITY, LEAST_ACCELERATION = 1e-4, 0.05
"""Least of a sample that counts [m/s, m/s^2]: below are an encoder count in ten ticks, and the filter's residue."""
QUANTILES = (10.0, 50.0, 90.0)


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
    *("t", "force", "force_sampled", "force_measured", "displacement", "vx_raw", "ax_measured"),
    *(f"{key}_{front}" for front in ("thesis", "raw", "matched") for key in "MBK"),
)


def own_values(surface: Mapping[str, Any]) -> dict[str, float]:
    """K, B and M of a surface; B at 20 N if it grows with the depth, that of the dashpot if the surface relaxes."""
    K, B = float(surface["stiffness"]), float(surface["damping"])
    at_20_newtons = B * 20.0 / K if surface["kind"] == "hunt-crossley" else B
    return {"K": K, "B": at_20_newtons, "M": float(surface["mass"])}


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
    true_B: float  # damping of the surface: see `own_values` [N s/m]
    samples: dict[str, tuple[float, ...]]  # quantiles of K, B, M by single samples: see `by_ratios`

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
    last = round((SLOT[1] - 0.002) * 1000)

    def at_end(column: str) -> float:
        return float(press[column][last]) if last < len(press) else float("nan")

    values = {name: at_end(f"{name}_thesis") for name in "MBK"}
    raw = {f"{name}_raw": at_end(f"{name}_raw") for name in "MBK"}
    settled = {f"settled_{name}": settled_after(press[f"{name}_thesis"]) for name in "BK"}
    settled["settled_M"] = mass_settled_after(press["M_thesis"])
    damping = own_values(record.meta["experiment"]["surface"])["B"]
    return PressEstimates(ratio(press), **values, **raw, **settled, true_B=damping, samples=by_ratios(press))


def by_ratios(press: Record) -> dict[str, tuple[float, ...]]:
    """Quantiles of single-sample estimates by the three ratios of sec. 5.1, each using the result of the previous one.

    K = f/x where all rests; B = (f - K x)/v while the surface moves, of the half of the samples with the smaller
    acceleration, for the thesis asks for none; M = (f - K x - B v)/a. A ratio needs its denominator: samples in which
    the encoders show no motion are left out.
    """
    rest, moving = between(press, *SLOT), between(press, 0.0, MOVING)
    f, x = press["force_measured"], press["displacement"]
    v, a = press["vx_raw"][moving], press["ax_measured"][moving]
    stiffness = _quantiles(f[rest] / x[rest])
    rest_force = f[moving] - stiffness[1] * x[moving]
    used = (np.abs(v) > LEAST_VELOCITY) & (np.abs(a) <= np.median(np.abs(a)))
    damping = _quantiles(rest_force[used] / v[used])
    rest_force = rest_force - damping[1] * v
    used = np.abs(a) > LEAST_ACCELERATION
    return {"K": stiffness, "B": damping, "M": _quantiles(rest_force[used] / a[used])}


def _quantiles(values: Array) -> tuple[float, ...]:
    if not len(values):
        return (float("nan"),) * len(QUANTILES)
    return tuple(map(float, np.percentile(values, QUANTILES)))
