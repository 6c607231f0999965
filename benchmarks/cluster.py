"""A study of short runs on one core and on the workers of a Dask cluster of this machine, each with its processor time.

Processor seconds do not depend on how many cores the workers share: from those of a run, a worker, the scheduler and
the client follows what more machines would do at most.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

STUDY = """
title = "Short runs"
experiment = "foam-pi"
metrics = ["force_rms"]
[fixed]
run = {{ press = {press}, duration = {duration} }}
robot.start = [0.4635, 0.0, 0.0]
approach = {{ hold = 0.05, first = 0.470, step = 0.002, period = 0.1 }}
[parameters]
"controller.ki" = {{ log = [1.0, 100.0], points = {runs} }}
"""


def started(program: str, *words: str) -> psutil.Popen:
    command = [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard", *words]
    return psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def processor(*processes: psutil.Process) -> float:
    """Processor seconds of processes so far."""
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def study(folder: Path, text: str, *words: str, cores: set[int] | None = None) -> tuple[float, float, bytes]:
    """Wall and processor seconds of `palpate study`, and its table."""
    out = folder / f"out{len(list(folder.iterdir()))}"
    path = out.with_suffix(".toml")
    path.write_text(text)
    begin = time.perf_counter()
    process = psutil.Popen(
        [sys.executable, "-m", "palpate", "study", str(path), "--out", str(out), "--json", *words],
        stdout=subprocess.DEVNULL,
        preexec_fn=cores and (lambda: os.sched_setaffinity(0, cores)),
    )
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"palpate study ended with status {status}")
    return (
        time.perf_counter() - begin,
        usage.ru_utime + usage.ru_stime,
        (out / "results.parquet").read_bytes(),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--press", type=float, default=0.2, help="contact of a run [s]")
    parser.add_argument("--warm", type=int, default=50, help="runs of a worker before it is measured")
    parser.add_argument("--workers", type=int, default=8)
    parser.add_argument("--machines", type=int, default=100, help="of one core, for the calculation")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def text(runs: int) -> str:
            return STUDY.format(runs=runs, press=given.press, duration=given.press + 1.3)

        study(folder, text(2))  # compiles
        idle = study(folder, text(2), cores={0})
        wall, alone, table = study(folder, text(given.runs), cores={0})
        file = folder / "scheduler.json"
        scheduler = started(
            "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)
        )
        while not file.exists() or not file.read_text().endswith("}"):
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        words = (address, "--nthreads", "1", "--no-nanny")
        workers = [started("dask_worker", *words) for _ in range(given.workers)]
        try:
            # Afterwards every worker has imported and compiled.
            study(folder, text(given.warm * given.workers), "--scheduler", address)
            before = processor(scheduler), processor(*workers)
            many, client, same = study(folder, text(given.runs), "--scheduler", address)
            after = processor(scheduler), processor(*workers)
        finally:
            for process in (*workers, scheduler):
                process.kill()
                process.wait()
    assert same == table, "the cluster's table differs"
    own, sent = (alone - idle[1]) / given.runs, (client - idle[1]) / given.runs
    scheduled, worked = ((b - a) / given.runs for a, b in zip(before, after, strict=True))
    rate = min(given.machines / worked, 1.0 / max(scheduled, sent))
    print(f"| runs of {1e3 * own:.1f} ms on | {given.runs} runs | a run, of processor |\n|---|---|---|")
    print(f"| one core | {wall:.1f} s | {1e3 * own:.1f} ms |")
    print(
        f"| {given.workers} workers on {os.cpu_count()} cores | {many:.1f} s | worker {1e3 * worked:.1f}, scheduler "
        f"{1e3 * scheduled:.2f}, client {1e3 * sent:.2f} ms |"
    )
    print(f"| {given.machines} machines of one core, calculated | {given.runs / rate:.1f} s | |")


if __name__ == "__main__":
    main()
