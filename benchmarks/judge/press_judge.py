"""Judge a force law by its public controller: does the true force ever exceed F_max?

    python benchmarks/judge/press_judge.py --arm ur5e --case layers --runs 1000
    python benchmarks/judge/press_judge.py --simulator axis mujoco --runs 1000 200 --rows runs/presses.jsonl

The judge shares no law, no constant and no file with palpate. It imports `palpate.force.ForceLoop` alone and makes
gains by `palpate tune` from its own arm file. `--law stop` judges in its place the simplest law with an F_max: at the
ceiling (F_max - F_d - 4 N)/(K_eff theta + sqrt(K m)) to F_d, then back only. `--rows` keeps each run as it ends: the
same command goes on where it stopped, and runs with other gains, or another form of the law, are made again.

Columns, for each simulator: runs above F_max; the largest true force [N]; runs in which the tip was faster than the
approach before any touch; runs that settle; p95 of the time from the touch until the force stays within 5 % [s]
(infinite if it does not settle; where the reading has an error, its largest is added to the 5 %). The last column is a
lower bound of it, on the draws of the first simulator, for any law that guarantees F_max:
(K_eff theta/K) ln(F_max/(F_max - F_d)). Exit code 1 if a run was above.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from press_draws import ACCURACY, ARMS, JITTER, MISSED, Arm, Draw, arm_file, draw_press
from press_simulators import SIMULATORS, Axis, Engine

CASES = ("clean", "layers", "cable", "pose", "drift")
BAND = 0.05  # of the desired force, in which it has settled
AFTER_TOUCH, BEFORE_TOUCH = 5.0, 20.0  # s, longest parts of a run
REST = 0.75  # s in the band, after which a run ends early
WINDOW = 0.02  # s, over which the tip's speed in free motion is averaged
FAST = 1.25  # of the approach: an inner loop overshoots by less
BACKWARDS = 1e-4  # m/s per newton, at which the simplest law withdraws


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


class Candidate(NamedTuple):
    """A law to be judged on an arm."""

    arm: str
    make: Callable[[], Law]  # the law in free motion
    approach: float  # m/s
    digest: str  # of everything that its runs depend on, beside the draw


def press_all(
    law: Candidate, case: str, simulator: str, draws: list[Draw], args: argparse.Namespace
) -> list[Run]:
    """Press once for each draw, but for runs that stand in the file of rows."""
    lines = args.rows.read_text(encoding="utf-8").splitlines() if args.rows and args.rows.exists() else []
    known = {tuple(key): Run(*run) for key, run in map(json.loads, lines)}
    keys = [(law.digest, simulator, case, draw.seed) for draw in draws]
    for key, draw in zip(keys, draws, strict=True):
        if key not in known:
            known[key] = press(law.make(), SIMULATORS[simulator](draw), draw, args.force, law.approach)
            if args.rows:
                with args.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps([key, known[key]]) + "\n")
    return [known[key] for key in keys]


def judge(law: Candidate, case: str, args: argparse.Namespace) -> tuple[str, int]:
    """Press in each simulator; a row of the table, and the runs above F_max."""
    arm, count = ARMS[law.arm], args.seed + max(args.runs)
    draws = [draw_press(arm, case, args.force, args.cap, seed) for seed in range(args.seed, count)]
    row, above = f"{law.arm:7}{case:7}", 0
    for simulator, runs in zip(args.simulator, args.runs, strict=True):
        made = press_all(law, case, simulator, draws[:runs], args)
        peaks, settling = np.array([run.peak for run in made]), np.array([run.settling for run in made])
        beyond, settled = np.count_nonzero(peaks > args.force_max), np.count_nonzero(np.isfinite(settling))
        row += f"{beyond:6}{peaks.max():7.1f}{sum(run.fast for run in made):6}{settled:8}"
        row += f"{quantile(settling, 0.95):7.2f}"
        above += beyond
    least = [
        draw.least_time(args.force, args.force_max, arm.pushed(args.cap)) for draw in draws[: args.runs[0]]
    ]
    row += f"{quantile(least, 0.95):7.2f}"
    return row, above


def quantile(values: list[float] | np.ndarray, fraction: float) -> float:
    """Quantile that is one of the values: some are infinite."""
    return float(np.quantile(values, fraction, method="higher"))


def tune(name: str, args: argparse.Namespace) -> str:
    """Gains by `palpate tune` for the judge's own arm file."""
    with tempfile.TemporaryDirectory() as folder:
        file, gains = Path(folder, "arm.toml"), Path(folder, "gains.toml")
        file.write_text(arm_file(ARMS[name], f"The judge's {name}"), encoding="utf-8")
        command = [Path(sys.executable).with_name("palpate"), "tune", "--arm", file, "--out", gains]
        command += ["--force", f"{args.force}:N", "--stiffness", f"100:{args.cap}"]
        command += ["--force-max", f"{args.force_max}:N"]
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)  # noqa: S603
        if not gains.exists():
            sys.exit(f"palpate tune: {done.stderr.strip() or done.stdout.strip()}")
        return gains.read_text(encoding="utf-8")


def stop_law(name: str, args: argparse.Namespace) -> Candidate:
    """The simplest law with an F_max."""
    speed = ceiling(ARMS[name], args.force, args.force_max, args.cap)
    return Candidate(
        name, lambda: StopLaw(speed, args.force), speed, f"stop {name} {speed} {args.force} {args.cap}"
    )


def palpate_law(name: str, args: argparse.Namespace) -> Candidate:
    """palpate's law with its own gains for the judge's arm."""
    from palpate.force import ForceLoop

    text = tune(name, args)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "gains.toml").write_text(text, encoding="utf-8")
        loop = ForceLoop.load(Path(folder, "gains.toml"))

    def reset() -> Law:
        loop.reset()
        return loop

    return Candidate(name, reset, tomllib.loads(text)["approach"], hashlib.sha256(text.encode()).hexdigest())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arm", nargs="+", choices=ARMS, default=[*ARMS])
    parser.add_argument("--case", nargs="+", choices=CASES, default=CASES)
    parser.add_argument("--simulator", nargs="+", choices=SIMULATORS, default=["axis"])
    parser.add_argument("--runs", nargs="+", type=int, default=[100], help="of each case, for each simulator")
    parser.add_argument("--seed", type=int, default=0, help="of the first press; the next has the next")
    parser.add_argument("--force", type=float, default=20.0, help="desired force [N]")
    parser.add_argument("--force-max", type=float, default=100.0, help="F_max of `palpate tune` [N]")
    parser.add_argument("--cap", type=float, default=1e5, help="stiffest surface [N/m]")
    parser.add_argument("--law", choices=("palpate", "stop"), default="palpate")
    parser.add_argument("--rows", type=Path, help="file of runs, to go on with")
    args = parser.parse_args()
    print(f"{args.force:g} N, F_max {args.force_max:g} N, cap {args.cap:g} N/m, from seed {args.seed}")
    print(
        " " * 14 + "".join(f"{f'{s}, {n} runs':>34}" for s, n in zip(args.simulator, args.runs, strict=True))
    )
    columns = f"{'above':>6}{'most':>7}{'fast':>6}{'settled':>8}{'p95':>7}" * len(args.simulator)
    print(f"{'arm':7}{'case':7}{columns}{'bound':>7}")
    above = 0
    for name in args.arm:
        law = (stop_law if args.law == "stop" else palpate_law)(name, args)
        for case in args.case:
            row, beyond = judge(law, case, args)
            print(row, flush=True)
            above += beyond
    sys.exit(int(above > 0))


if __name__ == "__main__":
    main()
