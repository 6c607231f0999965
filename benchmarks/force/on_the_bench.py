"""The thesis' arm with LuGre friction, coarse encoders and torque limits: cautious against what the bench has.

    python benchmarks/force/on_the_bench.py [--seeds 4] [--friction 1] [--minutes 3.5]

Springs and dampers from soft to stiff, a relaxing solid, Hunt and Crossley's law: 20 N asked, 4 s of contact. None of
the surfaces was used for tuning; the gains of the others are the bench's, not retuned. Settled: within 5 % of 20 N for
good, the force a mean over 10 ms. Every run is kept as it ends: the same command goes on where it stopped.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

import numpy as np
from touches import Key, resumed

from palpate.bench.from_experiment import build
from palpate.bench.tables import load, with_values

CONTROLLERS = ("foam-cautious", "foam-hybrid", "foam-pi", "foam-neural")
PRESS = 4.0
JUDGED = ("settling", "over", "lost", "rms", "limited")
SPRINGS = list(product((600.0, 1.8e3, 9e3, 2.7e4, 8e4, 1.6e5), (0.03, 0.4)))
OTHERS = {
    "relaxing": {"kind": "standard-linear-solid", "stiffness": 4e3, "damping": 60.0, "mass": 0.1,
                 "branch_stiffness": 3e3, "branch_time": 0.3},
    "hunt-crossley": {"kind": "hunt-crossley", "stiffness": 4e5, "damping": 2e5, "exponent": 1.5, "mass": 0.05},
}  # fmt: skip


def surfaces() -> dict[str, dict[str, object]]:
    found = {
        f"{K / 1e3:g} kN/m, ratio {zeta}": {
            "kind": "kelvin-voigt", "stiffness": K, "damping": float(2.0 * zeta * np.sqrt(K)), "mass": 0.05,
        }
        for K, zeta in SPRINGS
    }  # fmt: skip
    return found | OTHERS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--friction", type=float, default=1.0)
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path, default=Path("runs/on_the_bench"))
    told = parser.parse_args()
    print(f"{len(surfaces())} surfaces, {told.seeds} seeds, friction x {told.friction:g}")
    print(
        "                 settled   p50    p95 [s]   most over   lost   rms [N]   not settled, a motor at its limit"
    )
    seeds, which = range(100, 100 + told.seeds), list(surfaces().values())

    def run(key: Key) -> dict[str, float]:
        name, seed, i = key
        return dict(zip(JUDGED, judged(name, which[i], seed, told.friction), strict=True))

    keys = [(name, seed, i) for name in told.controllers for i in range(len(which)) for seed in seeds]
    known = resumed(told.out / f"friction-{told.friction:g}.jsonl", keys, run, told.minutes)
    for name in told.controllers:
        found = [row for key, row in known.items() if key[0] == name]
        if not found:
            continue
        settling, over, lost, rms, limited = (np.array([row[key] for row in found]) for key in JUDGED)
        settled = np.isfinite(settling)
        middle, late = np.nanpercentile(settling, (50, 95)) if settled.any() else (np.nan, np.nan)
        print(
            f"{name:<16}{settled.sum():4d} of {len(found)}{middle:7.2f}{late:7.2f}{100 * over.max():11.1f} %"
            f"{int((lost > 0).sum()):7d}{np.nanmedian(rms):9.3f}{int((~settled & (limited > 0.9)).sum()):12d}"
        )


def judged(
    name: str, surface: dict[str, object], seed: int, friction: float
) -> tuple[float, float, float, float, float]:
    """Settling [s], overshoot, losses of contact, rms error in the last second [N]; its share with a motor limited."""
    own = load(name)
    changes = {"surface": surface, "run.press": PRESS, "run.losses": 1}
    for key in ("coulomb", "static"):
        changes[f"friction.{key}"] = tuple(friction * v for v in getattr(own.friction, key))
    record = build(with_values(own, changes)).run(60.0, seed=seed, press=PRESS)
    force = record["force"][record["phase"] == 1.0]
    if len(force) < 100:
        return np.nan, 0.0, 1.0, np.nan, 0.0
    smooth = np.convolve(force, np.full(10, 0.1), "valid")
    lost = float(record.meta["end"] == "lost contact" or (record["phase"] == 2.0).any())
    outside = np.flatnonzero(np.abs(smooth - 20.0) > 1.0)
    last = outside[-1] + 1 if len(outside) else 0
    settled = last < len(smooth) - 300 and not lost
    rms = float(np.sqrt(np.mean((force[-1000:] - 20.0) ** 2)))
    held = [record[f"saturated{motor}"][record["phase"] == 1.0][-1000:].mean() for motor in (1, 2, 3)]
    return last * 1e-3 if settled else np.nan, float(smooth.max() / 20.0 - 1.0), lost, rms, float(max(held))


if __name__ == "__main__":
    main()
