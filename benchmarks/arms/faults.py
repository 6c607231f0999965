"""Faults of a wire, each injected into a press over the maker's protocol with a simulated arm in another process.

Controllers fall silent, die, start again at once; samples come late, jitter, are lost or are garbage on the way (the
relays of `tests/wires`). For each: how the press ended, how long after the fault, and whether every reading was kept.
`--markdown docs/wires.md` puts the table between the marks of that page. A slow arm, of a lag of some 0.25 s.
"""

import argparse
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pages import put, standing

TESTS = Path(__file__).parents[2] / "tests" / "wires"
sys.path.insert(0, str(TESTS))
from slow_cell import ALONE, WORDS, child, slower_cell, while_it_presses  # noqa: E402

from palpate.logs import read_record  # noqa: E402

HEAD = "| wire | fault | exit | the press ended | over after [s] | readings kept |"
ARM, NEAR, DOMAIN = "127.0.0.61", "127.0.0.62", 63
ROS2 = "?wrench=/ft/wrench&pose=/tcp/pose&command=/command&as=twist&wrench-frame=tool&force-sign=reaction"
FAULTS = {
    "rtde": ("falls silent", "dies", "starts again", "delay", "loss", "garbage"),
    "franka": ("falls silent", "dies", "starts again", "delay", "loss", "garbage"),
    "ros2": ("falls silent", "dies", "starts again", "delay", "jitter"),
}
TRIES = 5
SAID = {
    "falls silent": "the controller falls silent",
    "dies": "the controller's process is killed",
    "starts again": "killed, and another in its place at once",
    "delay": "all samples 0.8 s late, from a moment on",
    "jitter": "each sample up to 60 ms late",
    "loss": "a tenth of the packets lost",
    "garbage": "random bytes in each packet",
}
RELAYED = {("rtde", f) for f in ("delay", "loss", "garbage")} | {
    ("franka", f) for f in ("delay", "loss", "garbage")
}
RELAYED |= {("ros2", f) for f in ("delay", "jitter")}


def act_of(fault: str, process: subprocess.Popen, again: list) -> Callable[[], None]:
    """What is done to the controller's process in mid-press."""

    def restart() -> None:
        process.kill()
        process.wait()
        again.append(subprocess.Popen(process.args, stdout=subprocess.DEVNULL))  # noqa: S603 - as it was started

    return {
        "falls silent": lambda: process.send_signal(signal.SIGSTOP),
        "dies": process.kill,
        "starts again": restart,
    }[fault]


def row(kind: str, fault: str, folder: Path) -> str | None:
    """A line of the table; None if a busy machine ended the press before its fault."""
    own = Path(tempfile.mkdtemp(dir=folder))
    cell = folder / ("franka" if kind == "franka" else "others")
    where = ("--domain", DOMAIN) if kind == "ros2" else ("--address", ARM)
    stays = fault in {"jitter", "loss"}
    words = ("--arm", cell / "arm.toml", "--seconds", "60", "--gap", "0.002" if stays else "0.05")
    again: list[subprocess.Popen] = []
    with contextlib.ExitStack() as stack:
        process, at = stack.enter_context(
            child("-m", f"palpate.wires.{kind}_arm", *words, "--stiffness", "4000", *where)
        )
        act = None
        if (kind, fault) in RELAYED:
            told = (TESTS / "dds_relay.py", DOMAIN, DOMAIN + 1, fault)
            if kind != "ros2":
                told = (TESTS / "relay.py", kind, NEAR, ARM, fault)
            relay, at = stack.enter_context(child(*told))
            act = lambda: relay.send_signal(signal.SIGUSR1)  # noqa: E731
        begun = while_it_presses(own / "rec" / "rows.f64", act or act_of(fault, process, again))
        command = [sys.executable, "-m", "palpate", "press", "--wire", at + (ROS2 if kind == "ros2" else "")]
        command += [
            "--gains",
            str(cell / "gains.toml"),
            *WORDS,
            "--json",
            "--yes",
            "--record",
            "rec",
            "--seconds",
            "3",
        ]
        ran = subprocess.run(command, cwd=own, capture_output=True, text=True, check=False)  # noqa: S603
        if not begun:
            return None
        assert ran.stdout.startswith("{"), ran.stdout
        took = time.monotonic() - begun[0]
        for one in again:
            one.kill()
    found = json.loads(ran.stdout)
    ended = re.sub(r"127\.[\d.]+", "ADDRESS", found["ended"])
    kept, ticks = len(read_record(own / "rec" / "record.parquet")), found["lateness"]["ticks"]
    after = "-" if ran.returncode == 0 else f"{took:.1f}"
    return f"| {kind} | {SAID[fault]} | {ran.returncode} | {ended} | {after} | {kept} of {ticks} |"


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--wire", choices=list(FAULTS), action="append", help="some of them")
    asked.add_argument("--markdown", type=Path)
    words = asked.parse_args()
    os.environ["CYCLONEDDS_URI"] = ALONE
    lines = [HEAD, "|" + "---|" * (HEAD.count(" | ") + 1)]
    print(HEAD)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for cell, rate in (("franka", 1000), ("others", 100)):
            (folder / cell).mkdir()
            slower_cell(folder / cell, rate)
        for kind, faults in FAULTS.items():
            if words.wire and kind not in words.wire:  # its rows stay as they are
                lines += [old for old in standing(words.markdown, "faults") if old.startswith(f"| {kind} ")]
                continue
            for fault in faults:
                lines.append(next(filter(None, (row(kind, fault, folder) for _ in range(TRIES)))))
                print(lines[-1], flush=True)
    put(words.markdown, "faults", lines)


if __name__ == "__main__":
    main()
