"""Hybrid and neural force control on foam and rubber, with one set of gains and with gains tuned to each surface."""

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate_thesis.force_control.tracking import FOAM, RUBBER, Tracking, slot, tracking
from palpate_thesis.runs import Runs

SURFACES = {
    "foam": with_values(FOAM, {"run.press": 15.0}),
    "rubber": with_values(RUBBER, {"run.press": 15.0}),
}
JUDGED, SHOWN = (10.0, 15.0), (9.5, 13.5)
TUNING_SEED = 10_000
"""Noise of the runs that gains are tuned on; the judged runs have other seeds."""


def hybrid(kf: float, ki: float) -> dict[str, Any]:
    """Changes that put the hybrid controller with these force gains in place of the neural one."""
    return {"controller": {"kind": "hybrid", "kp": 400.0, "kv": 80.0, "kf": kf, "ki": ki}}


def neural(rate: float) -> dict[str, Any]:
    """Changes of the neural controller's learning rate, the only gain that it is tuned by."""
    return {"controller.learning_rate": rate}


ONE_SET = {
    "hybrid, foam's gains": (hybrid(1.0, 0.003), "K_fp 1, K_fi 0.003"),
    "hybrid, rubber's gains": (hybrid(0.25, 0.0015), "K_fp 0.25, K_fi 0.0015"),
    "neural": ({}, "K_fp 0.25, η 5e-5"),
}
"""One set for both surfaces: those that section 6 gives for identification, and the neural controller's."""
TUNED = {
    "hybrid, tuned": {
        f"K_fp {kf:g}, K_fi {ki:g}": hybrid(kf, ki)
        for kf, ki in product((0.25, 0.5, 1.0, 2.0), (0.0015, 0.003, 0.006, 0.012, 0.024))
    },
    "neural, tuned": {
        f"K_fp 0.25, η {rate:g}": neural(rate) for rate in (1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4)
    },
}
"""Gains that are tried on each surface."""


class ForceComparison(NamedTuple):
    """Tracking errors by controller and surface."""

    runs: dict[tuple[str, str], list[Tracking]]
    gains: dict[tuple[str, str], str]  # in words
    shown: dict[tuple[str, str], Record]  # some seconds of the first seed


def compare(runs: Runs) -> ForceComparison:
    """Tune on one seed, then judge every controller on every surface over all seeds."""
    measure = tracking(*JUDGED)
    tried = {
        (name, surface, gains): with_values(e, changes)
        for name, grid in TUNED.items()
        for surface, e in SURFACES.items()
        for gains, changes in grid.items()
    }
    results = runs.over([(e, TUNING_SEED) for e in tried.values()], measure)
    judged: dict[tuple[str, str], Experiment] = {}
    gains: dict[tuple[str, str], str] = {}
    for name, (changes, text) in ONE_SET.items():
        for surface, e in SURFACES.items():
            judged[name, surface], gains[name, surface] = with_values(e, changes), text
    for name, surface in product(TUNED, SURFACES):
        errors = {key: run for key, run in zip(tried, results, strict=True) if key[:2] == (name, surface)}
        best = best_gains(errors)
        judged[name, surface], gains[name, surface] = tried[best], best[2]
    shown = {key: slot(runs.record(e), *SHOWN) for key, e in judged.items()}
    return ForceComparison(runs.by_name(judged, measure), gains, shown)


def best_gains(errors: Mapping[tuple[str, str, str], Tracking]) -> tuple[str, str, str]:
    """Key of the run that kept contact with the least RMS error, steps included."""
    return min(errors, key=lambda key: errors[key].rms if errors[key].kept else np.inf)
