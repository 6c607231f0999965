"""Judge a force law by its public controller: does the true force ever exceed F_max?

    python benchmarks/judge/press_judge.py --arm ur5e --case layers --runs 1000
    python benchmarks/judge/press_judge.py --arm fr3 --simulator mujoco --gains gains.toml --force-max 100

The judge shares no law, no constant and no file with palpate. It imports `palpate.force.ForceLoop` alone and makes
gains by `palpate tune` from its own arm file, unless --gains names some. `--law stop` judges in its place the simplest
law with an F_max: at the ceiling (F_max - F_d - 4 N)/(K_eff theta + sqrt(K m)) to F_d, then back only. Without F_max,
in the gains or by --force-max, five times the force takes its place in the columns, and no run is condemned.

Columns: the largest true force [N] (p50, p95, most); runs above F_max; runs in which the tip was faster than the
approach before any touch; runs that settle, and the time from the touch until the force stays within 5 % [s] (p50, p95;
infinite if it does not settle; where the reading has an error, its largest is added to the 5 %). The last columns are
lower bounds of p95, on the same draws, of any law that guarantees F_max: (K_eff theta/K) ln(F_max/(F_max - F_d)), and
with K_eff theta + sqrt(K_cap m) in place of K_eff theta. Exit code 1 if a run was above.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from press_draws import ACCURACY, ARMS, JITTER, MAX_TOOL, MISSED, Arm, Draw, arm_file, draw_press
from press_simulators import SIMULATORS, Axis, Engine

CASES = ("clean", "layers", "cable", "pose", "drift")
BAND = 0.05  # of the desired force, in which it has settled
AFTER_TOUCH, BEFORE_TOUCH = 5.0, 20.0  # s, longest parts of a run
REST = 0.75  # s in the band, after which a run ends early
WINDOW = 0.02  # s, over which the tip's speed in free motion is averaged
FAST = 1.25  # of the approach: an inner loop overshoots by less
BACKWARDS = 1e-4  # m/s per newton, at which the simplest law withdraws
SIMILAR = 0.15  # relative difference of the gains' arm from the judge's, up to which nothing is said


class Law(Protocol):
    """Force law under judgement."""

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        """Speed of the commanded position [m/s]."""


class StopLaw:
    """Constant speed up to the first reading at the desired force; from then on backwards only."""

    def __init__(self, speed: float, force: float) -> None:
        self._speed, self._force, self._reached = speed, force, False

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        """Speed of the commanded position [m/s]."""
        self._reached |= force >= self._force
        return min(0.0, BACKWARDS * (self._force - force)) if self._reached else self._speed


def ceiling(arm: Arm, force: float, force_max: float, cap: float) -> float:
    """Largest speed that keeps F_max with readings within ACCURACY [m/s]."""
    return (force_max - force - ACCURACY) / (arm.pushed(cap) + arm.swung(cap))


class Run(NamedTuple):
    """Outcome of a press."""

    peak: float  # largest true force [N]
    fast: bool  # faster than the approach before any touch
    settling: float  # s


def press(law: Law, simulator: Axis | Engine, draw: Draw, force: float, approach: float) -> Run:
    """Press once, tick by tick; `approach` is the law's own speed in free motion [m/s]."""
    rng, period = np.random.default_rng([draw.seed, 1]), 1 / draw.arm.rate
    command, reading, position, missed, skip = 0.0, 0.0, 0.0, 0, 0
    tips, forces, times = [0.0], [], []
    peak, fast, error, time, touch, inside = 0.0, False, 0.0, 0.0, np.inf, 0.0
    window, ticks = round(WINDOW / period), int((BEFORE_TOUCH + AFTER_TOUCH) / period * 1.1)
    jitter = JITTER * rng.choice((-1, 0, 1), ticks, p=(0.1, 0.8, 0.1))
    noise, lost = rng.standard_normal(ticks), rng.random(ticks)
    skips = (lost < MISSED).astype(int) + (lost < MISSED / 2)
    tick = 0
    while time < min(touch, BEFORE_TOUCH) + AFTER_TOUCH * np.isfinite(touch) and inside < REST:
        if skip:
            skip, missed = skip - 1, missed + 1
        else:
            command += period * law.update(reading, position, missed)
            missed, skip = 0, int(skips[tick])
        duration = period + float(jitter[tick])
        sample = simulator.tick(command, duration, float(noise[tick]))
        reading, position, time, tick = sample.reading, sample.position, time + duration, tick + 1
        peak, error = max(peak, sample.largest), max(error, abs(sample.error))
        touch = min(touch, time) if sample.largest > 0 else touch
        if np.isinf(touch):
            tips.append(sample.tip)
            fast |= tips[-1] - tips[max(-1 - window, -len(tips))] > FAST * approach * WINDOW
        else:
            forces.append(sample.force)
            times.append(time - touch)
            inside = inside + duration if abs(sample.force - force) <= BAND * force + error else 0.0
    return Run(peak, fast, settling_time(np.array(times), np.array(forces), force, BAND * force + error))


def settling_time(times: np.ndarray, forces: np.ndarray, force: float, band: float) -> float:
    """Time from which the force stays within the band [s]; infinite if it is outside at the end."""
    outside = np.flatnonzero(np.abs(forces - force) > band)
    if len(times) == 0 or (len(outside) and outside[-1] == len(times) - 1):
        return float("inf")
    return float(times[outside[-1] + 1]) if len(outside) else 0.0


def judge(make: Callable[[], Law], case: str, args: argparse.Namespace, approach: float) -> dict[str, float]:
    """Press `args.runs` times; the quantities of a row of the table."""
    arm = ARMS[args.arm]
    draws = [draw_press(arm, case, args.force, args.cap, args.seed + k) for k in range(args.runs)]
    runs = [press(make(), SIMULATORS[args.simulator](draw), draw, args.force, approach) for draw in draws]
    peaks, settling = np.array([r.peak for r in runs]), np.array([r.settling for r in runs])
    force_max = args.force_max or 5 * args.force
    slopes = arm.pushed(args.cap), arm.pushed(args.cap) + arm.swung(args.cap)
    bounds = [[draw.least_time(args.force, force_max, slope) for draw in draws] for slope in slopes]
    row = {"runs": len(runs), "peak_p50_N": quantile(peaks, 0.5), "peak_p95_N": quantile(peaks, 0.95)}
    row |= {"peak_N": float(peaks.max()), "above": int(np.count_nonzero(peaks > force_max))}
    row |= {"fast": sum(run.fast for run in runs), "settled": int(np.count_nonzero(np.isfinite(settling)))}
    row |= {"settling_p50_s": quantile(settling, 0.5), "settling_p95_s": quantile(settling, 0.95)}
    return row | {"bound_p95_s": quantile(bounds[0], 0.95), "bound_mass_p95_s": quantile(bounds[1], 0.95)}


def quantile(values: list[float] | np.ndarray, fraction: float) -> float:
    """Quantile that is one of the values: some are infinite."""
    return float(np.quantile(values, fraction, method="higher"))


def tune(args: argparse.Namespace, folder: Path) -> Path:
    """Make gains by `palpate tune` for the judge's own arm file."""
    file, gains = folder / "arm.toml", folder / "gains.toml"
    file.write_text(arm_file(ARMS[args.arm], f"The judge's {args.arm}"), encoding="utf-8")
    command = [Path(sys.executable).with_name("palpate"), "tune", "--arm", file, "--out", gains]
    command += ["--force", f"{args.force}:N", "--stiffness", f"100:{args.cap}"]
    command += ["--force-max", f"{args.force_max}:N"] if args.force_max else []
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)  # noqa: S603
    if not gains.exists():
        sys.exit(f"palpate tune: {done.stderr.strip() or done.stdout.strip()}")
    return gains


def differences(inner: dict[str, float], arm: Arm) -> list[str]:
    """Numbers of the gains' arm that are far from the judge's: then the theorem's assumptions are not met."""
    middle = {"mass": arm.mass + MAX_TOOL / 2, "stiffness": arm.stiffness, "delay": arm.delay}
    middle["damping"] = arm.ratio if arm.kind == "position" else arm.damping
    stated = {name: (inner.get(name, 0.0), value) for name, value in middle.items()}
    return [f"{name} {a:g}, judged with {b:g}" for name, (a, b) in stated.items() if abs(a / b - 1) > SIMILAR]


def show(rows: dict[str, dict[str, float]], args: argparse.Namespace) -> None:
    """Print a row of the table for each case."""
    limit = f"{args.force_max:g} N" if args.force_max else f"none, in its place {5 * args.force:g} N"
    theta = 1000 * ARMS[args.arm].theta
    print(
        f"{args.arm}, {args.simulator}: {args.force:g} N, cap {args.cap:g} N/m, theta {theta:.1f} ms, F_max {limit}"
    )
    head = ("runs", "peak", "p95", "most", "above", "fast", "settled", "p50", "p95", "bound", "+ mass")
    print(f"{'case':8}" + "".join(f"{name:>8}" for name in head))
    for case, row in rows.items():
        numbers = [
            f"{row[key]:.{1 if key.endswith('N') else 2 if key.endswith('_s') else 0}f}" for key in row
        ]
        print(f"{case:8}" + "".join(f"{number:>8}" for number in numbers))


def judge_stop_law(args: argparse.Namespace, cases: Sequence[str]) -> dict[str, dict[str, float]]:
    """Rows of the simplest law with an F_max."""
    args.force_max = args.force_max or 5 * args.force
    speed = ceiling(ARMS[args.arm], args.force, args.force_max, args.cap)
    return {case: judge(lambda: StopLaw(speed, args.force), case, args, speed) for case in cases}


def judge_palpate(args: argparse.Namespace, cases: Sequence[str]) -> dict[str, dict[str, float]]:
    """Rows of palpate's law with the given gains, or with its own for the judge's arm."""
    from palpate.force import ForceLoop

    with tempfile.TemporaryDirectory() as folder:
        path = args.gains or tune(args, Path(folder))
        gains = tomllib.loads(path.read_text(encoding="utf-8"))
        for text in differences(gains["arm"]["inner"], ARMS[args.arm]):
            print(f"the gains' arm has {text}", file=sys.stderr)
        args.force_max = args.force_max or gains.get("force_max")
        return {case: judge(lambda: ForceLoop.load(path), case, args, gains["approach"]) for case in cases}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arm", choices=ARMS, default="ur5e")
    parser.add_argument("--case", choices=[*CASES, "all"], default="all")
    parser.add_argument("--simulator", choices=SIMULATORS, default="axis")
    parser.add_argument("--runs", type=int, default=100, help="presses of each case")
    parser.add_argument("--seed", type=int, default=0, help="of the first press; the next has the next")
    parser.add_argument("--force", type=float, default=20.0, help="desired force [N]")
    parser.add_argument("--force-max", type=float, help="F_max of `palpate tune` [N]")
    parser.add_argument("--cap", type=float, default=1e5, help="stiffest surface [N/m]")
    parser.add_argument(
        "--gains", type=Path, help="file of `palpate tune`, for an arm within the judge's intervals"
    )
    parser.add_argument("--law", choices=("palpate", "stop"), default="palpate")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    chosen = CASES if args.case == "all" else (args.case,)
    rows = (judge_stop_law if args.law == "stop" else judge_palpate)(args, chosen)
    if args.json:
        finite = {c: {k: v if np.isfinite(v) else None for k, v in row.items()} for c, row in rows.items()}
        answer = {"arm": args.arm, "theta_s": ARMS[args.arm].theta, "force_max": args.force_max}
        print(json.dumps(answer | {"cases": finite}))
    else:
        show(rows, args)
    sys.exit(int(bool(args.force_max) and any(row["above"] for row in rows.values())))


if __name__ == "__main__":
    main()
