"""Numbers of a result: over all presses, and on each stiffness; as values, as tables, in a sentence."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from palpate.report.page import Table
from palpate.units import plain
from palpate_benchmark.metrics import BAND, OVER, RunMetrics
from palpate_benchmark.plan import LINES, PERIOD, STEP_HEIGHT, SWAY, SWAY_FORCE, ForcePlan
from palpate_benchmark.simulated import ForceResult

HIGHEST = LINES[-1] / PERIOD
"""Highest frequency of the plan [Hz]."""


def numbers_of(runs: Sequence[RunMetrics]) -> dict[str, Any]:
    """Summary of some presses: medians of times, largest overshoots, sums of losses; None where there is none.

    A time that some presses did not reach counts as infinite: the median is None where half of them did not.
    """
    touches, steps = [r.touch for r in runs], [s for r in runs for s in (r.up, r.down)]
    above = [r.bandwidth for r in runs if r.bandwidth is not None]
    return {
        "presses": len(runs),
        "passed": sum(t.passed for t in touches),
        "settled": sum(t.settling is not None for t in touches),
        "settling_s": _median(t.settling for t in touches),
        "settling_worst_s": _worst(t.settling for t in touches),
        "overshoot": max(t.overshoot for t in touches),
        "bounces": sum(t.bounces for t in touches),
        "lost": sum(t.lost for t in touches),
        "steady_error_N": _finite(np.sqrt(np.mean([t.error**2 for t in touches]))),
        "deviation_N": _finite(np.sqrt(np.mean([t.deviation**2 for t in touches]))),
        "step_rise_s": _median(s.rise for s in steps),
        "step_settling_s": _median(s.settling for s in steps),
        "step_overshoot": _finite(max(s.overshoot for s in steps)),
        "bandwidth_Hz": float(np.median(above)) if len(above) > len(runs) / 2 else None,
        "resonance": _finite(max(r.resonance for r in runs)),
        "disturbance": _median(r.disturbance for r in runs),
    }


def _median(values: Iterable[float | None]) -> float | None:
    return _finite(np.median([math.inf if v is None else v for v in values]))


def _worst(values: Iterable[float | None]) -> float | None:
    return _finite(max(math.inf if v is None else v for v in values))


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def as_values(results: Sequence[ForceResult]) -> dict[str, Any]:
    """Everything as plain JSON values, the best entry first."""
    return {
        "test": description(results[0].plan),
        "entries": [
            {
                "title": one.name,
                "arm": one.arm,
                **numbers_of(one.runs),
                "surfaces": [
                    {"stiffness_N_per_m": _finite(own.stiffness), **numbers_of(own.runs)}
                    for own in one.surfaces
                ],
            }
            for one in best_first(results)
        ],
    }


def description(plan: ForcePlan) -> dict[str, Any]:
    """The test in numbers, so that a result can be compared with another."""
    return {
        "version": 1,
        "force_N": plan.force,
        "band": BAND,
        "overshoot_limit": OVER,
        "step": STEP_HEIGHT,
        "frequencies_Hz": [k / PERIOD for k in LINES],
        "sway_Hz": SWAY,
        "sway_force": SWAY_FORCE,
    }


def best_first(results: Sequence[ForceResult]) -> list[ForceResult]:
    """The best entry first: by presses that did not pass, by settling of the slowest tenth, by overshoot."""

    def key(one: ForceResult) -> tuple[float, float, float]:
        times = [math.inf if r.touch.settling is None else r.touch.settling for r in one.runs]
        late = float(np.quantile(times, 0.9, method="higher"))
        return 1.0 - one.passes / len(one.runs), late, max(r.touch.overshoot for r in one.runs)

    return sorted(results, key=key)


def sentence(results: Sequence[ForceResult]) -> str:
    """The answer: the best entry, and how many presses of it passed."""
    best, *others = best_first(results)
    own = numbers_of(best.runs)
    time = own["settling_s"]
    settles = f"settling {time:.2f} s in the middle" if time is not None else "most do not settle"
    slowest = own["settling_worst_s"]
    worst = "" if slowest is None else f", {slowest:.2f} s at most"
    first = f"best of {len(results)}: {best.name}" if others else best.name
    return (
        f"{first}, {best.arm}: {best.passes} of {len(best.runs)} presses settle within {100 * BAND:g} %, go at most"
        f" {100 * OVER:g} % over and keep contact; {settles}{worst}, {_percent(own['overshoot'])} over at most"
    )


def leaderboard(results: Sequence[ForceResult], *, narrow: bool = False) -> Table:
    """A row an entry, the best first; `narrow` leaves out what a terminal has no room for."""
    rows = [(one.name, numbers_of(one.runs)) for one in best_first(results)]
    return _table(f"All presses, {results[0].arm}", "entry", rows, narrow)


def by_surface(one: ForceResult, *, narrow: bool = False) -> Table:
    """A row a stiffness; `narrow` leaves out what a terminal has no room for."""
    known = {own.stiffness: f"{own.stiffness / 1e3:.3g}" for own in one.surfaces}
    rows = [
        (known[own.stiffness] if math.isfinite(own.stiffness) else "not known", numbers_of(own.runs))
        for own in one.surfaces
    ]
    return _table(one.name, "kN/m", rows, narrow)


def _table(title: str, first: str, rows: Sequence[tuple[str, dict[str, Any]]], narrow: bool) -> Table:
    cells = [{first: name, **_cells(found)} for name, found in rows]
    kept = [key for key in cells[0] if not (narrow and key in _WIDE)]
    return Table(title, kept, [[row[key] for key in kept] for row in cells])


_WIDE = {"error [N]", "deviation [N]", "rise", "step over", "bounces; lost"}
"""Columns of the page alone."""


def _cells(found: dict[str, Any]) -> dict[str, str]:
    """Text of each column."""
    highest = "-" if found["resonance"] is None else f"> {HIGHEST:g}"
    return {
        "passed": f"{found['passed']} of {found['presses']}",
        "settling": _seconds(found["settling_s"]),
        "over": _percent(found["overshoot"]),
        "bounces; lost": f"{found['bounces']}; {found['lost']}",
        "error [N]": plain(found["steady_error_N"], 2),
        "deviation [N]": plain(found["deviation_N"], 2),
        "rise": _seconds(found["step_rise_s"]),
        "step over": _percent(found["step_overshoot"]),
        "Hz": highest if found["bandwidth_Hz"] is None else plain(found["bandwidth_Hz"], 2),
        "sway": plain(found["disturbance"], 2),
    }


def _percent(share: float | None) -> str:
    return "-" if share is None or not math.isfinite(share) else f"{100 * share:.1f} %"


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} s"
