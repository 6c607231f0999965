"""Hybrid and neural force control on foam and rubber, with one set of gains and with gains tuned to each surface."""

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from palpate.bench import Experiment, with_values
from palpate.records import Record
from palpate_thesis.force_control.tracking import FOAM, RUBBER, Tracking, hybrid, slot, tracking
from palpate_thesis.runs import Runs

SURFACES = {
    "foam": with_values(FOAM, {"run.press": 15.0}),
    "rubber": with_values(RUBBER, {"run.press": 15.0}),
}
JUDGED, SHOWN = (10.0, 15.0), (9.5, 13.5)
TUNING_SEED = 10_000
"""Noise of the runs that gains are tuned on; the judged runs have other seeds."""


ONE_SET: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "hybrid, foam's gains": {"K_fp 1, K_fi 0.003": hybrid(1.0, 0.003)},
    "hybrid, rubber's gains": {"K_fp 0.25, K_fi 0.0015": hybrid(0.25, 0.0015)},
    "neural": {"K_fp 0.25, η 5e-5": {}},
}
"""One set for both surfaces: those that section 6 gives for identification, and the neural controller's."""
TUNED: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "hybrid, tuned": {
        f"K_fp {kf:g}, K_fi {ki:g}": hybrid(kf, ki)
        for kf, ki in product((0.25, 0.5, 1.0, 2.0), (0.0015, 0.003, 0.006, 0.012, 0.024))
    },
    "neural, tuned": {
        f"K_fp 0.25, η {rate:g}": {"controller.learning_rate": rate}
        for rate in (1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4)
    },
}
"""Gains that are tried on each surface; the learning rate is the only gain that the neural controller is tuned by."""


class ForceComparison(NamedTuple):
    """Tracking errors by controller and surface."""

    runs: dict[tuple[str, str], list[Tracking]]
    gains: dict[tuple[str, str], str]  # in words
    shown: dict[tuple[str, str], Record]  # some seconds of the first seed


def compare(runs: Runs) -> ForceComparison:
    """Tune on one seed, then judge every controller on every surface over all seeds."""
    measure = tracking(*JUDGED)
    judged: dict[tuple[str, str], Experiment] = {}
    gains: dict[tuple[str, str], str] = {}
    for (name, grid), (surface, e) in product({**ONE_SET, **TUNED}.items(), SURFACES.items()):
        tried = {words: with_values(e, changes) for words, changes in grid.items()}
        best = next(iter(tried))
        if name in TUNED:
            errors = runs.map(lambda e: measure(runs.record(e, TUNING_SEED)), list(tried.values()))
            best = best_gains(dict(zip(tried, errors, strict=True)))
        judged[name, surface], gains[name, surface] = tried[best], best
    shown = {key: slot(runs.record(e), *SHOWN) for key, e in judged.items()}
    return ForceComparison(runs.by_name(judged, measure), gains, shown)


def best_gains(errors: Mapping[str, Tracking]) -> str:
    """Gains of the run that kept contact with the least RMS error, steps included."""
    return min(errors, key=lambda words: errors[words].rms if errors[words].kept else np.inf)
