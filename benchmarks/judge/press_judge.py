"""Judge a force law by its public controller: does the true force ever exceed F_max?

    python benchmarks/judge/press_judge.py --arm ur5e --case layers --runs 1000
    python benchmarks/judge/press_judge.py --arm fr3 --simulator mujoco --gains gains.toml --force-max 100

The judge shares no law, no constant and no file with palpate. It imports `palpate.force.ForceLoop` alone, and makes gains
by `palpate tune` for its own arm file, unless --gains names some. Without F_max in gains or --force-max the bound is that
of five times the force, and only the peak is judged.

Columns: the largest true force [N] (p50, p95, most); runs above F_max; runs in which the tip was faster than the approach
before any touch; runs that settle, and their settling time from the touch to within 5 % [s], p50 and p95 (a run that does
not settle counts as infinite). In cases with an error of the reading, settled is within 5 % and the largest error. The
last columns are lower bounds of p95 on the same draws, of any law that guarantees F_max: (K_eff theta/K)
ln(F_max/(F_max - F_d)), and the same with the tip's momentum, K_eff theta + sqrt(K_cap m). Exit code 1 if a run was above.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from press_draws import ARMS, JITTER, MISSED, Arm, Draw, arm_file, draw_press
from press_worlds import WORLDS, World

CASES = ("clean", "layers", "cable", "pose", "drift")
BAND = 0.05  # of the desired force, in which it has settled
AFTER_TOUCH, BEFORE_TOUCH = 5.0, 20.0  # s, longest parts of a run
REST = 0.75  # s within the band, without a sign of change, after which a run ends early
WINDOW = 0.02  # s, over which the tip's speed in free motion is averaged
FAST = 1.25  # of the approach: an inner loop overshoots by less


class Law(Protocol):
    """Force law under judgement."""

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        """Speed of the commanded position [m/s]."""


class Run(NamedTuple):
    """Outcome of a press: largest true force [N], whether free motion was too fast, settling time [s]."""

    peak: float
    fast: bool
    settling: float


def press(law: Law, world: World, draw: Draw, force: float, approach: float) -> Run:
    """Press once, tick by tick; `approach` is the law's own speed in free motion [m/s]."""
    rng, period = np.random.default_rng([draw.seed, 1]), 1 / draw.arm.rate
    command, reading, position, missed, skip = 0.0, 0.0, 0.0, 0, 0
    tips, forces, times = [0.0], [], []
    peak, fast, error, time, touch = 0.0, False, 0.0, 0.0, np.inf
    window, inside = round(WINDOW / period), 0.0
    while time < min(touch + AFTER_TOUCH, BEFORE_TOUCH + AFTER_TOUCH) and not (
        np.isinf(touch) and time > BEFORE_TOUCH
    ):
        if skip:
            skip, missed = skip - 1, missed + 1
        else:
            command += period * law.update(reading, position, missed)
            missed = 0
            lost = rng.random()
            skip = 2 if lost < MISSED / 2 else 1 if lost < MISSED else 0
        duration = period + JITTER * rng.choice((-1, 0, 1), p=(0.1, 0.8, 0.1))
        sample = world.tick(command, duration, rng.standard_normal())
        reading, position = sample.reading, sample.position
        time += duration
        peak, error = max(peak, sample.largest), max(error, abs(sample.error))
        if sample.largest > 0:
            touch = min(touch, time)
        if np.isinf(touch):
            tips.append(sample.tip)
            if len(tips) > window:
                fast |= tips[-1] - tips[-1 - window] > FAST * approach * WINDOW
        else:
            forces.append(sample.force)
            times.append(time - touch)
            inside = inside + duration if abs(sample.force - force) <= BAND * force + error else 0.0
            if inside > REST:
                break
    return Run(peak, fast, settling_time(np.array(times), np.array(forces), force, BAND * force + error))


def settling_time(times: np.ndarray, forces: np.ndarray, force: float, band: float) -> float:
    """Time from which the force stays within the band [s]; infinite if it is outside at the end."""
    outside = np.flatnonzero(np.abs(forces - force) > band)
    if len(times) == 0 or (len(outside) and outside[-1] == len(times) - 1):
        return float("inf")
    return float(times[outside[-1] + 1]) if len(outside) else 0.0


def judge(
    make: Callable[[], Law], arm: Arm, case: str, args: argparse.Namespace, approach: float
) -> dict[str, float]:
    """Press `args.runs` times; each quantity of a row of the table."""
    draws = [draw_press(arm, case, args.force, args.cap, args.seed + k) for k in range(args.runs)]
    runs = [press(make(), WORLDS[args.simulator](draw), draw, args.force, approach) for draw in draws]
    peaks, settling = np.array([r.peak for r in runs]), np.array([r.settling for r in runs])
    force_max = args.force_max or 5 * args.force  # palpate press' own default
    pushed, swung = arm.pushed(args.cap), arm.swung(args.cap)
    bounds = {"bound_p95_s": pushed, "bound_mass_p95_s": pushed + swung}
    quantile = lambda values, q: float(np.quantile(values, q, method="higher"))  # noqa: E731 -- inf has no mean
    return {
        "runs": len(runs),
        "peak_p50_N": quantile(peaks, 0.5),
        "peak_p95_N": quantile(peaks, 0.95),
        "peak_N": float(peaks.max()),
        "above": int(np.count_nonzero(peaks > force_max)),
        "fast": sum(run.fast for run in runs),
        "settled": int(np.count_nonzero(np.isfinite(settling))),
        "settling_p50_s": quantile(settling, 0.5),
        "settling_p95_s": quantile(settling, 0.95),
        **{
            name: quantile([draw.least_time(args.force, force_max, slope) for draw in draws], 0.95)
            for name, slope in bounds.items()
        },
    }


def tune(arm: Arm, args: argparse.Namespace, folder: Path) -> Path:
    """Make gains by `palpate tune` for the judge's own arm file."""
    file, gains = folder / "arm.toml", folder / "gains.toml"
    file.write_text(arm_file(arm, f"The judge's {args.arm}"), encoding="utf-8")
    command = [Path(sys.executable).with_name("palpate"), "tune", "--arm", file, "--out", gains]
    command += ["--force", f"{args.force}:N", "--stiffness", f"100:{args.cap}"]
    command += ["--force-max", f"{args.force_max}:N"] if args.force_max else []
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)  # noqa: S603
    if not gains.exists():
        sys.exit(f"palpate tune: {done.stderr.strip() or done.stdout.strip()}")
    return gains


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arm", choices=ARMS, default="ur5e")
    parser.add_argument("--case", choices=[*CASES, "all"], default="all")
    parser.add_argument("--simulator", choices=WORLDS, default="axis")
    parser.add_argument("--runs", type=int, default=100, help="presses of each case")
    parser.add_argument("--seed", type=int, default=0, help="of the first press; the next has the next")
    parser.add_argument("--force", type=float, default=20.0, help="desired force [N]")
    parser.add_argument("--force-max", type=float, help="F_max of `palpate tune` [N]")
    parser.add_argument("--cap", type=float, default=1e5, help="stiffest surface [N/m]")
    parser.add_argument(
        "--gains", type=Path, help="file of `palpate tune`, for an arm within the judge's intervals"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    from palpate.force import ForceLoop

    arm = ARMS[args.arm]
    with tempfile.TemporaryDirectory() as folder:
        path = args.gains or tune(arm, args, Path(folder))
        gains = tomllib.loads(path.read_text(encoding="utf-8"))
        args.force_max = args.force_max or gains.get("force_max")
        chosen = CASES if args.case == "all" else (args.case,)
        rows = {c: judge(lambda: ForceLoop.load(path), arm, c, args, gains["approach"]) for c in chosen}
    bounded = args.force_max is not None
    if args.json:
        cases = {
            c: {name: value if np.isfinite(value) else None for name, value in row.items()}
            for c, row in rows.items()
        }
        print(
            json.dumps({"arm": args.arm, "theta_s": arm.theta, "force_max": args.force_max, "cases": cases})
        )
    else:
        show(rows, args, f"theta {arm.theta * 1000:.1f} ms", bounded)
    sys.exit(int(bounded and any(row["above"] for row in rows.values())))


def show(rows: dict[str, dict[str, float]], args: argparse.Namespace, theta: str, bounded: bool) -> None:
    """Print a row of the table for each case."""
    limit = f"{args.force_max or 5 * args.force:g} N{'' if bounded else ', which these gains do not promise'}"
    print(f"{args.arm}, {args.simulator}, {args.force:g} N, cap {args.cap:g} N/m, {theta}, F_max {limit}")
    print(f"{'case':8}{'runs':>6}{'peak':>8}{'p95':>7}{'most':>7}{'above':>7}{'fast':>6}{'settled':>9}"
          f"{'p50':>7}{'p95':>7}{'bound':>8}{'+ mass':>8}")  # fmt: skip
    for case, row in rows.items():
        print(f"{case:8}{row['runs']:6}{row['peak_p50_N']:8.1f}{row['peak_p95_N']:7.1f}{row['peak_N']:7.1f}"
              f"{row['above']:7}{row['fast']:6}{row['settled']:9}{row['settling_p50_s']:7.2f}"
              f"{row['settling_p95_s']:7.2f}{row['bound_p95_s']:8.2f}{row['bound_mass_p95_s']:8.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
