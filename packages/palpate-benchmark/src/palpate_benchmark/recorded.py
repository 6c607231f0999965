"""The test over a wire: presses of `palpate press --wire ... --record`, judged by their records.

The arm moves under the guards of `palpate press` and nothing else. A press that lowers its force now and then has three
steps down and up in its middle third; the force before is that of the touch. A force has settled when
its mean over the loop's lag has, as palpate press says it; peaks, losses and rises are those of single readings.
"""

from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import RECORD
from palpate.logs import read_record
from palpate.press.sequence import Plan
from palpate.records import Record
from palpate_benchmark.metrics import ForceStep, RunMetrics, step, touch
from palpate_benchmark.plan import ForcePlan
from palpate_benchmark.simulated import ForceResult, OnSurface

FREE = 4.0
"""Standard deviations of the noise that count as free motion."""


def judge(paths: tuple[Path, ...]) -> ForceResult:
    """ForceResult of presses over a wire.

    Args:
        paths: folders of `palpate press --record`, or their records.

    Raises:
        InputError: no record of a press over a wire, one that met no surface, or records of several arms.
    """
    records = [_read(path) for path in paths]
    titles, forces = ({r.meta["wire"][key] for r in records} for key in ("title", "desired_N"))
    if len(titles) > 1 or len(forces) > 1:
        raise InputError(
            f"the records are of different arms or forces ({', '.join(map(str, [*titles, *forces]))}); judge each alone"
        )
    rate = _rate(records[0])
    runs = tuple(_run(record, path) for record, path in zip(records, paths, strict=True))
    own = OnSurface(np.nan, runs, records[0]["force_sampled"])
    title = str(titles.pop())
    return ForceResult("cautious, over its wire", title, ForcePlan(float(forces.pop()), rate), (own,))


def _read(path: Path) -> Record:
    record = read_record(path / RECORD if path.is_dir() else path)
    about = record.meta.get("wire")
    known = isinstance(about, dict) and {"desired_N", "hold_s", "probe", "title"} <= set(about)
    if not known or "phase" not in record.columns or len(record) < 3:
        raise InputError(f"{path} is no record of palpate press --wire; record one with --record")
    return record


def _rate(record: Record) -> float:
    """Readings a second [Hz]."""
    return 1.0 / float(np.median(np.diff(record["t"])))


def _noise(force: Array) -> float:
    """Standard deviation of a reading in free motion by second differences, which no drift changes [N]."""
    return float(np.sqrt(np.mean(np.diff(force, 2) ** 2) / 6.0)) if len(force) > 2 else 0.0


def _run(record: Record, path: Path) -> RunMetrics:
    force, phase, t = record["force_sampled"], record["phase"], record["t"]
    rate, about = _rate(record), record.meta["wire"]
    if not (phase > 0.0).any():
        raise InputError(f"{path}: the press met no surface")
    plan = Plan(float(about["desired_N"]), float(about["hold_s"]), float(about["probe"]))
    begin = int(np.argmax(phase > 0.0))
    since = t[begin:] - t[begin]
    held = since < plan.seconds
    force, before = force[begin:][held], force[:begin]
    wanted = np.array([plan.force_at(s) for s in since[held]])
    first = since[held] < plan.seconds / 3.0
    lag = float(about.get("theta_s", 0.0))
    met = touch(np.concatenate([before, force[first]]), plan.force, rate, FREE * _noise(before), lag)
    steps = _steps(force, wanted, rate, lag)
    none = ForceStep(None, None, np.nan)
    down, up = ([s for s, lower in steps if lower is side] or [none] for side in (True, False))
    return RunMetrics(met, _slowest(up), _slowest(down), None, np.nan, None)


def _steps(force: Array, wanted: Array, rate: float, lag: float) -> list[tuple[ForceStep, bool]]:
    """Each step of the desired force, and whether it lowers the force."""
    at = np.flatnonzero(np.diff(wanted)) + 1
    ends = [*at[1:], len(wanted)]
    return [
        (step(force[i:end], wanted[i - 1], wanted[i], rate, lag), bool(wanted[i] < wanted[i - 1]))
        for i, end in zip(at, ends, strict=True)
    ]


def _slowest(steps: list[ForceStep]) -> ForceStep:
    return max(steps, key=lambda s: np.inf if s.settling is None else s.settling)
