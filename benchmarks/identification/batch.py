"""What the whole way from a record to an Identification costs, for a million samples of each channel.

    python benchmarks/identification/batch.py
    python benchmarks/identification/batch.py --rows 100000 --profile 15

The log: foam pressed with 15 N, and about that the bench's chirp of 5 N from 0.5 to 40 Hz in 20 s, again and again,
1 kHz, through an encoder of 5 um and the force sensor's whole chain. `wall` is the best of several calls, `CPU` the
processor's time of the same call, which another program on the machine does not lengthen so much.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.bench import ForceSensorTable, given_motion, load
from palpate.environments import KelvinVoigt
from palpate.identification import Identification, identify
from palpate.logs import read_log, write_record
from palpate.records import Record
from palpate.references import Chirp
from palpate.signals.low_pass import LowPass

RATE = 1000
MEAN, AMPLITUDE = 15.0, 5.0  # of the force [N]
LOW, HIGH, PERIOD = 0.5, 40.0, 20.0  # of the sweep [Hz], [s]
LEAD = 0.5  # in free motion and down into the surface [s]
MODEL = "kelvin-voigt-mass"


def path(rows: int, surface: KelvinVoigt) -> NDArray[np.float64]:
    """The tip's position at each row [m], shape (rows,), 0 being the surface."""
    time_ = np.arange(rows) / RATE
    u = np.clip(time_ / LEAD, 0.0, 1.0)
    rest = MEAN / surface.stiffness
    down = rest * (1.2 * u**3 * (10.0 - 15.0 * u + 6.0 * u * u) - 0.2)
    since = np.maximum(time_ - LEAD, 0.0) % PERIOD
    omega = 2.0 * np.pi * (LOW + (HIGH - LOW) * since / PERIOD)
    impedance = np.hypot(surface.stiffness - surface.mass * omega**2, surface.damping * omega)
    return down + np.where(time_ > LEAD, Chirp(LOW, HIGH, PERIOD, AMPLITUDE).at(since) / impedance, 0.0)


def press(rows: int, seed: int) -> tuple[Record, LowPass, float]:
    """A log of the motion, with the force sensor's low-pass and its whole lag [s]."""
    nominal = load("foam-chirp").surface
    surface = KelvinVoigt(nominal.stiffness, nominal.damping, nominal.mass)
    record = given_motion(surface, sensor=ForceSensorTable(phase=0.0011)).run(path(rows, surface), seed=seed)
    told = record.meta["instruments"]["force"]
    low_pass = LowPass.parse(told["filter"])
    columns = {"time": record["t"], "position": record["x_measured"], "force": record["force_sampled"]}
    log = Record(columns, {"time": "s", "position": "m", "force": "N"})
    return log, low_pass, low_pass.lag + told["delay_s"]


def tellings(low_pass: LowPass, lag: float) -> dict[str, dict[str, Any]]:
    """What the identification is given, by title."""
    return {
        "the force filter and the lag": {"force_filter": low_pass, "lag": lag},
        "the model too": {"force_filter": low_pass, "lag": lag, "model": MODEL},
        "the force filter": {"force_filter": low_pass},
        "the lag": {"lag": lag},
        "nothing": {},
        "the model": {"model": MODEL},
    }


def timed(work: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """The least of several calls by the clock, and by the processor's [s]; one before them warms up."""
    work()
    walls, busy = [], []
    for _ in range(repeats):
        clock, processor = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - clock)
        busy.append(time.process_time() - processor)
    return min(walls), min(busy)


def row(title: str, rows: int, seconds: tuple[float, float], found: Identification | None = None) -> str:
    """A line of the table: seconds for a million rows."""
    wall, busy = (1e6 * s / rows for s in seconds)
    said = ", ".join(f"{name} {p.verdict}" for name, p in found.parameters.items()) if found else ""
    return f"| {title} | {wall:.1f} s | {busy:.1f} s | {said} |"


def hot_spots(work: Callable[[], Any], count: int) -> None:
    """Prints the functions that take the most time by themselves."""
    profile = cProfile.Profile()
    profile.runcall(work)
    pstats.Stats(profile).strip_dirs().sort_stats("tottime").print_stats(count)


def main() -> None:
    """Time every telling and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--profile", type=int, default=0, metavar="N", help="show N hot spots of each")
    asked = parser.parse_args()
    log, low_pass, lag = press(asked.rows, asked.seed)
    print("| given | clock | processor | verdicts |\n|---|---|---|---|")
    for title, known in tellings(low_pass, lag).items():

        def work(known: dict[str, Any] = known) -> Identification:
            return identify(log, **known)

        print(row(title, asked.rows, timed(work, asked.repeats), work()), flush=True)
        if asked.profile:
            hot_spots(work, asked.profile)
    with TemporaryDirectory() as folder:
        file = write_record(log, Path(folder) / "press.parquet")
        seconds = timed(
            lambda: read_log(file, time="time", position="position", force="force"), asked.repeats
        )
        print(row("read from Parquet, beside that", asked.rows, seconds))


if __name__ == "__main__":
    main()
