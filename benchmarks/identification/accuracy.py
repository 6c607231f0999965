"""How near the identification comes to the Cramer-Rao bound, and how often its 95 % intervals hold the truth.

    python benchmarks/identification/accuracy.py --trials 200            # all rows
    python benchmarks/identification/accuracy.py foam-step --trials 2000

Each trial is a press on the bench with a surface, a noise and a phase of the force sensor of its own. The errors and
the half-widths are divided by the bound of their own trial, so that surfaces of all sizes can stand in one row. The
first columns are of `ci95_if_model_holds`; `ci95`, on which verdicts rest, follows: how often it is given, its width
over the other's, how often it holds the truth, and how often it does where the verdict is "identified".
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from presses import CHIRP_START, STEP_START, THESIS_START, Condition, Trial, trial

CONDITIONS = {
    "foam-step": Condition("foam-hybrid", STEP_START),
    "rubber-step": Condition("rubber-hybrid", STEP_START),
    "foam-chirp": Condition("foam-chirp", CHIRP_START),
    "rubber-chirp": Condition("rubber-chirp", CHIRP_START),
    "foam-step-lag-unknown": Condition("foam-hybrid", STEP_START, lag_known=False),
    "rubber-step-lag-unknown": Condition("rubber-hybrid", STEP_START, lag_known=False),
    "foam-chirp-lag-unknown-mass-fixed": Condition("foam-chirp", CHIRP_START, lag_known=False, mass="fixed"),
    "rubber-chirp-lag-unknown-mass-fixed": Condition(
        "rubber-chirp", CHIRP_START, lag_known=False, mass="fixed"
    ),
    "foam-chirp-lag-unknown-mass-prior": Condition("foam-chirp", CHIRP_START, lag_known=False, mass="prior"),
    "rubber-chirp-lag-unknown-mass-prior": Condition(
        "rubber-chirp", CHIRP_START, lag_known=False, mass="prior"
    ),
    "foam-chirp-thesis-pose": Condition("foam-chirp", THESIS_START),
    "rubber-chirp-thesis-pose": Condition("rubber-chirp", THESIS_START),
}
_T = 1.96


@dataclass(frozen=True)
class Line:
    """One parameter under one condition, over all trials.

    Args:
        rms: of the error, over the bound.
        bias: mean of the error over the rms of the error.
        relative: rms of error/truth.
        coverage: share of 95 % intervals that hold the truth.
        width: median of the half-width over that of the bound.
        identified: share of verdicts "identified".
        given: share of trials with a `ci95`.
        robust_width: median of its half-width over that of `ci95_if_model_holds`.
        robust_coverage: share of them that hold the truth; None if there is none.
        trusted: the same where the verdict is "identified"; None if it never is.
        error: rms, in the parameter's unit.
    """

    parameter: str
    trials: int
    rms: float
    bias: float
    relative: float
    coverage: float
    width: float
    identified: float
    given: float
    robust_width: float | None
    robust_coverage: float | None
    trusted: float | None
    error: float


def line(name: str, trials: list[Trial]) -> Line:
    """The figures of one parameter."""
    error = np.array([t.value[name] - t.truth[name] for t in trials])
    std = np.array([t.std[name] for t in trials])
    bound = np.array([t.bound[name] for t in trials])
    truth = np.array([t.truth[name] for t in trials])
    scaled = error / np.maximum(bound, 1e-300)
    rms = float(np.sqrt(np.mean(scaled**2)))
    inside = np.abs(error) <= _T * std
    identified = np.array([t.verdict.get(name) == "identified" for t in trials])
    given = np.array([name in t.robust for t in trials])
    low, high = np.array([t.robust.get(name, (np.nan, np.nan)) for t in trials]).T
    held = (low <= truth) & (truth <= high)
    return Line(
        name,
        len(trials),
        rms,
        float(np.mean(scaled)) / rms,
        float(np.sqrt(np.mean((error / truth) ** 2))),
        float(np.mean(inside)),
        float(np.median(std / np.maximum(bound, 1e-300))),
        float(np.mean(identified)),
        float(np.mean(given)),
        float(np.median(((high - low) / 2 / (_T * std))[given])) if given.any() else None,
        float(np.mean(held[given])) if given.any() else None,
        float(np.mean(held[identified])) if identified.any() else None,
        float(np.sqrt(np.mean(error**2))),
    )


def main() -> None:
    """Run the conditions asked for and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("conditions", nargs="*", default=list(CONDITIONS), metavar="CONDITION")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0, help="of the first trial")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--json", type=Path, help="write every figure there")
    asked = parser.parse_args()
    unknown = set(asked.conditions) - set(CONDITIONS)
    if unknown:
        parser.error(f"no condition {', '.join(sorted(unknown))}; there are: {', '.join(CONDITIONS)}")
    seeds = range(asked.seed, asked.seed + asked.trials)
    print(
        f"{asked.trials} trials each, seeds {seeds[0]} to {seeds[-1]}; errors and widths over the bound's deviation"
    )
    print(
        f"{'':36}{'':5}{'rms':>7}{'bias/rms':>10}{'rms/truth':>11}{'cover':>8}{'width':>7}"
        f"{'ci95 given':>12}{'times':>7}{'cover':>8}{'identified':>12}{'cover':>8}"
    )
    figures = {}
    with ProcessPoolExecutor(asked.workers, mp_context=get_context("spawn")) as pool:
        for name in asked.conditions:
            trials = list(pool.map(trial, [CONDITIONS[name]] * len(seeds), seeds, chunksize=4))
            figures[name] = _show(name, trials)
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1))


def _show(name: str, trials: list[Trial]) -> dict[str, object]:
    condition = CONDITIONS[name]
    parameters = ["K", "B", *(["M"] if condition.mass == "free" else [])]
    parameters += [] if condition.lag_known else ["lag"]
    lines = [line(parameter, trials) for parameter in parameters]
    for i, row in enumerate(lines):
        title = name if i == 0 else ""
        times = "-" if row.robust_width is None else f"{row.robust_width:.2f}"
        held, trusted = (
            "-" if share is None else f"{share:.1%}" for share in (row.robust_coverage, row.trusted)
        )
        print(
            f"{title:36}{row.parameter:5}{row.rms:7.2f}{row.bias:10.2f}{row.relative:11.3%}{row.coverage:8.1%}"
            f"{row.width:7.2f}{row.given:12.1%}{times:>7}{held:>8}{row.identified:12.1%}{trusted:>8}"
            + (f"  rms {row.error * 1e3:.3f} ms" if row.parameter == "lag" else "")
        )
    confounded = float(np.mean(["lag-damping-confounded" in t.codes for t in trials]))
    print(f"{'':36}lag-damping-confounded {confounded:.1%}")
    return {"lines": [vars(row) for row in lines], "confounded": confounded}


if __name__ == "__main__":
    main()
