"""Numbers of a result: over all presses, and on each stiffness; as values, as a table, in a sentence."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from palpate.bench.summary import BAND
from palpate.benchmark.metrics import (
    CABLE,
    LAYER,
    LINES,
    MAX_OVERSHOOT,
    PERIOD,
    STEP_HEIGHT,
    SWAY,
    SWAY_FORCE,
    ForcePlan,
    RunMetrics,
)
from palpate.benchmark.simulated import ForceResult
from palpate.units import plain

HIGHEST = LINES[-1] / PERIOD
"""Highest frequency of the plan [Hz]."""


def summarise_runs(runs: Sequence[RunMetrics]) -> dict[str, Any]:
    """Summary of some presses: medians of times, largest overshoots, sums of losses; None where there is none.

    A time that some presses did not reach counts as infinite: the median is None where half of them did not.
    """
    touches = [r.touch for r in runs]
    steps = [s for r in runs for s in (r.up, r.down)]
    bandwidths = [r.bandwidth for r in runs if r.bandwidth is not None]
    return {
        "presses": len(runs),
        "passed": sum(t.passed for t in touches),
        "settled": sum(t.settling is not None for t in touches),
        "settling_s": _median(t.settling for t in touches),
        "settling_worst_s": _finite(max(_or_infinite(t.settling) for t in touches)),
        "overshoot": max(t.overshoot for t in touches),
        "bounces": sum(t.bounces for t in touches),
        "lost": sum(t.lost for t in touches),
        "steady_error_N": _finite(np.sqrt(np.mean([t.error**2 for t in touches]))),
        "deviation_N": _finite(np.sqrt(np.mean([t.deviation**2 for t in touches]))),
        "step_rise_s": _median(s.rise for s in steps),
        "step_settling_s": _median(s.settling for s in steps),
        "step_overshoot": _finite(max(s.overshoot for s in steps)),
        "bandwidth_Hz": float(np.median(bandwidths)) if len(bandwidths) > len(runs) / 2 else None,
        "resonance": _finite(max(r.resonance for r in runs)),
        "disturbance": _median(r.disturbance for r in runs),
        "layers_settling_s": _median(r.layers.settling for r in runs),
        "layers_overshoot": _finite(max(r.layers.overshoot for r in runs)),
        "cable_settling_s": _median(r.cable.settling for r in runs),
        "cable_overshoot": _finite(max(r.cable.overshoot for r in runs)),
    }


def _or_infinite(value: float | None) -> float:
    return math.inf if value is None else value


def _median(values: Iterable[float | None]) -> float | None:
    return _finite(np.median([_or_infinite(value) for value in values]))


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def as_values(results: Sequence[ForceResult]) -> dict[str, Any]:
    """Everything as plain JSON values, the best entry first."""
    return {
        "test": describe_plan(results[0].plan),
        "entries": [
            {
                "title": result.name,
                "arm": result.arm,
                **summarise_runs(result.runs),
                "surfaces": [
                    {"stiffness_N_per_m": stiffness, **summarise_runs(runs)}
                    for stiffness, runs in result.surfaces.items()
                ],
            }
            for result in best_first(results)
        ],
    }


def describe_plan(plan: ForcePlan) -> dict[str, Any]:
    """The test in numbers, so that a result can be compared with another."""
    return {
        "version": 2,
        "force_N": plan.force,
        "band": BAND,
        "overshoot_limit": MAX_OVERSHOOT,
        "step": STEP_HEIGHT,
        "frequencies_Hz": [k / PERIOD for k in LINES],
        "sway_Hz": SWAY,
        "sway_force": SWAY_FORCE,
        "layer_force": LAYER,
        "cable_force": CABLE,
    }


def best_first(results: Sequence[ForceResult]) -> list[ForceResult]:
    """The best entry first: by presses that did not pass, by settling of the slowest tenth, by overshoot."""

    def key(result: ForceResult) -> tuple[float, float, float]:
        times = [_or_infinite(r.touch.settling) for r in result.runs]
        late = float(np.quantile(times, 0.9, method="higher"))
        return 1.0 - result.passes / len(times), late, max(r.touch.overshoot for r in result.runs)

    return sorted(results, key=key)


def sentence(results: Sequence[ForceResult]) -> str:
    """The answer: the best entry, and how many presses of it passed."""
    best, *others = best_first(results)
    numbers = summarise_runs(best.runs)
    time = numbers["settling_s"]
    slowest = numbers["settling_worst_s"]
    settles = f"settling {time:.2f} s in the middle" if time is not None else "most do not settle"
    worst = "" if slowest is None else f", {slowest:.2f} s at most"
    first = f"best of {len(results)}: {best.name}" if others else best.name
    return (
        f"{first}, {best.arm}: {best.passes} of {len(best.runs)} presses settle within {100 * BAND:g} %, go at most"
        f" {100 * MAX_OVERSHOOT:g} % over and keep contact; {settles}{worst},"
        f" {_percent(numbers['overshoot'])} over at most"
    )


def table_rows(results: Sequence[ForceResult]) -> list[dict[str, str]]:
    """Cells by column: a row an entry, the best first; of one entry a row a stiffness."""
    if len(results) > 1:
        return [{"entry": result.name, **_cells(result.runs)} for result in best_first(results)]
    surfaces = results[0].surfaces.items()
    return [{"kN/m": f"{stiffness / 1e3:.3g}", **_cells(runs)} for stiffness, runs in surfaces]


def _cells(runs: Sequence[RunMetrics]) -> dict[str, str]:
    """Text of each column."""
    numbers = summarise_runs(runs)
    highest = "-" if numbers["resonance"] is None else f"> {HIGHEST:g}"
    hidden = {
        name: f"{_percent(numbers[f'{name}_overshoot'])}, {_seconds(numbers[f'{name}_settling_s'])}"
        for name in ("layers", "cable")
    }
    return {
        "passed": f"{numbers['passed']} of {numbers['presses']}",
        "settling": _seconds(numbers["settling_s"]),
        "over": _percent(numbers["overshoot"]),
        "Hz": highest if numbers["bandwidth_Hz"] is None else plain(numbers["bandwidth_Hz"], 2),
        "sway": plain(numbers["disturbance"], 2),
        **hidden,
    }


def _seconds(time: float | None) -> str:
    return "-" if time is None else f"{time:.2f} s"


def _percent(fraction: float | None) -> str:
    return "-" if fraction is None or not math.isfinite(fraction) else f"{100 * fraction:.1f} %"
