"""Faults in mid-press, on each wire: does an arm still move afterwards? 70 kinds, each over the maker's protocol.

Signals to palpate, halts and ends of its processes, faults of the law, arms that fall silent, garbage and losses on the
way, sensors and clocks that lie. The simulated arm keeps a trace of what it is commanded: after the end its command
must not change any more, and never was one faster than the limit.

    python benchmarks/arms/faults.py --wire sim --wire rtde        # into build/wire-faults.json, resumable
    python benchmarks/arms/faults.py                            # all that is missing, and the tables

A slow arm, of a lag of some 0.2 s, so that a busy machine is in time. Exit code 1 if an arm still moves.
"""

import argparse
import contextlib
import json
import os
import pty
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np
from faulty_arm import CLOCKS, LIES
from faulty_press import FAULTS as OF_THE_LAW

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TESTS = ROOT / "tests" / "wires"
sys.path.insert(0, str(TESTS))
from slow_cell import ALONE, WORDS, child, rows_came, slower_cell  # noqa: E402

from palpate.logs import read_record  # noqa: E402
from palpate.wires.outcome import UNITS  # noqa: E402

STATE = ROOT / "build" / "wire-faults.json"
WIRES = ("sim", "rtde", "franka", "ros2")
ARM, NEAR, DOMAIN = "127.0.0.61", "127.0.0.62", 63
ROS2 = "?wrench=/ft/wrench&pose=/tcp/pose&command=/command&as=twist&wrench-frame=tool&force-sign=reaction"
SPEED, STIFFNESS = 0.05, 4000.0
STILL = 1e-6
"""Change of the commanded position [m] below which it rests: a thousandth of what the slowest approach does."""
LONGEST = 25.0
"""For which a press may go on after its fault [s]."""
TRIES = 3
"""Of a run that a busy machine ends before its fault."""
LAST = 0.3
"""Of the trace, that is looked at for motion [s]."""


@dataclass(frozen=True)
class Fault:
    """One kind.

    Args:
        group: of kinds.
        name: of this one.
        way: how it is injected: `signals`, `process`, `law`, `lie`, `relay` or `output`.
        what: of that way.
        wires: that can have it.
    """

    group: str
    name: str
    way: str
    what: object
    wires: tuple[str, ...] = WIRES


@dataclass(frozen=True)
class Result:
    """What came of it.

    Args:
        code: exit code; None of a press that did not end by itself.
        ended: why, in the press's own words.
        moves: whether the arm is still commanded to move.
        rest: from the fault to the last change of the command [s]; None where nothing changed after it.
        fastest: command after the fault [m/s].
        force: the largest on the surface after the fault [N].
        kept: readings in the record, less those that the press counted; None where it could not count.
    """

    code: int | None
    ended: str
    moves: bool
    rest: float | None
    fastest: float
    force: float
    kept: int | None


_SIGNALS = (
    "INT", "TERM", "HUP", "QUIT", "TSTP", "USR1", "USR2", "ALRM", "VTALRM", "PROF", "XCPU", "IO", "PWR", "STKFLT",
    "RTMIN",
)  # fmt: skip
APART = ("rtde", "franka", "ros2")
FAULTS = (
    *(Fault("signal", f"SIG{name}", "signals", (name,)) for name in _SIGNALS),
    Fault("signal", "Ctrl-C, five times", "signals", ("INT",) * 5),
    Fault("signal", "SIGTERM to all processes of palpate", "process", "term all"),
    Fault("signal", "SIGINT to all processes of palpate", "process", "int all"),
    Fault("signal", "the terminal hangs up", "output", "hang up"),
    Fault("signal", "the reader of the output has gone", "output", "close"),
    Fault("process", "SIGKILL", "process", "kill"),
    Fault("process", "SIGSEGV", "process", "segv"),
    Fault("process", "SIGSTOP for 1.5 s", "process", "stop"),
    Fault("process", "SIGSTOP for ever", "process", "stop for ever"),
    Fault("process", "SIGKILL of the library's process", "process", "kill helper", APART),
    Fault("process", "SIGSTOP of the library's process, for ever", "process", "stop helper", APART),
    Fault("process", "SIGKILL of both", "process", "kill all", APART),
    Fault("process", "SIGSTOP of both, for 1.5 s", "process", "stop all", APART),
    *(Fault("law", name, "law", name) for name in OF_THE_LAW),
    Fault("arm", "falls silent (SIGSTOP)", "process", "silent"),
    Fault("arm", "its process is killed", "process", "dies"),
    Fault("arm", "killed, and another in its place at once", "process", "again"),
    Fault("way", "all samples 0.8 s late", "relay", "delay", APART),
    Fault("way", "samples up to 60 ms late", "relay", "jitter", ("ros2",)),
    Fault("way", "a tenth of the packets lost", "relay", "loss", ("rtde", "franka")),
    Fault("way", "random bytes in each packet", "relay", "garbage", ("rtde", "franka")),
    *(Fault("sensor", name, "lie", name) for name in LIES if not name.startswith("quaternion")),
    *(
        Fault("sensor", name, "lie", name, ("sim", "rtde", "ros2"))
        for name in LIES
        if name.startswith("quaternion")
    ),
    *(Fault("clock", name, "lie", name) for name in CLOCKS),
    *(Fault("contact", f"{name}, in contact", "lie", name) for name in CLOCKS),
    *(
        Fault("contact", f"{name} on the way, in contact", "relay", name, ("rtde", "franka", "ros2"))
        for name in ("flip", "replay", "reorder", "delay")
    ),
    Fault("contact", "garbage on the way, in contact", "relay", "garbage", ("rtde", "franka")),
)


class Stand:
    """A press under way, and the arm that it moves.

    Args:
        kind: of the wire.
        fault: to come.
        folder: with the cells.
    """

    def __init__(self, kind: str, fault: Fault, folder: Path):
        self.kind, self.fault = kind, fault
        self.own = Path(tempfile.mkdtemp(dir=folder))
        self.cell = folder / ("franka" if kind == "franka" else "others")
        self.trace = self.own / "trace"
        self.again: list[subprocess.Popen] = []

    def run(self) -> Result | None:
        """All of it; None where a busy machine ended the press before its fault, or the arm had not moved."""
        with contextlib.ExitStack() as stack:
            arm, at = stack.enter_context(self._arm())
            relay = stack.enter_context(self._relay()) if self.fault.way == "relay" else None
            at = relay[1] if relay else at
            press, reader = self._press(at)
            try:
                if not rows_came(self.own / "rec" / "rows.f64", self._rows()) or press.poll() is not None:
                    return None
                begun = self._inject(press, arm, relay, reader)
                code, out = self._ended(press, begun)
                time.sleep(2.0 * LAST)
                return self._judged(begun, code, out)
            finally:
                for one in (press, *self.again):
                    one.kill()
                    one.wait()
                for pid in self._helpers:
                    with contextlib.suppress(OSError):
                        os.kill(pid, signal.SIGKILL)

    def _arm(self):
        where = ("--domain", DOMAIN) if self.kind == "ros2" else ("--address", ARM)
        where = () if self.kind == "sim" else where
        bias = ("--bias", "0", "0", "1") if self.kind == "sim" else ()
        stays = self._in_contact or self.fault.what in {"jitter", "loss"}
        name = self.fault.what if self.fault.way == "lie" else "none"
        words = (
            HERE / "faulty_arm.py",
            name,
            self.trace,
            f"{self.kind}_arm",
            "--arm",
            self.cell / "arm.toml",
        )
        more = ("--seconds", 120, "--gap", 0.002 if stays else 0.05, "--stiffness", STIFFNESS, *bias)
        return child(*words, *more, *where)

    @property
    def _in_contact(self) -> bool:
        """True if the fault comes while the arm presses, and not on the way to the surface."""
        return self.fault.group in {"sensor", "contact"}

    def _relay(self):
        if self.kind == "ros2":
            return child(TESTS / "dds_relay.py", DOMAIN, DOMAIN + 1, self.fault.what)
        return child(TESTS / "relay.py", self.kind, NEAR, ARM, self.fault.what)

    def _rows(self) -> int:
        """Readings before the fault."""
        slow = 20 if self.fault.way == "law" else 250 if self._in_contact else 40
        return slow * (10 if self.kind == "franka" and slow > 40 else 1)

    def _press(self, at: str):
        words = [sys.executable, "-m", "palpate"]
        if self.fault.way == "law":
            words = [sys.executable, str(HERE / "faulty_press.py"), str(self.fault.what)]
        at += ROS2 if self.kind == "ros2" else ""
        words += ["press", "--wire", at, "--gains", str(self.cell / "gains.toml"), *WORDS]
        words += ["--yes", "--record", "rec", "--seconds", "3"]
        ours, theirs = pty.openpty() if self.fault.what == "hang up" else os.pipe()
        if self.fault.what == "hang up":
            words = [sys.executable, "-c", CONTROLLED, *words[2:]]
        with (self.own / "err").open("w") as err:
            press = subprocess.Popen(  # noqa: S603 - our own
                words, cwd=self.own, stdout=theirs, stderr=err, start_new_session=True,
                stdin=theirs if self.fault.what == "hang up" else subprocess.DEVNULL,
            )  # fmt: skip
        os.close(theirs)
        self._helpers: list[int] = []
        return press, ours

    def _inject(self, press, arm, relay, reader) -> float:
        self._helpers = children_of(press.pid)
        begun = time.monotonic()
        if self.fault.way == "signals":
            for name in self.fault.what:
                press.send_signal(getattr(signal, f"SIG{name}"))
                time.sleep(0.01)
        elif self.fault.way == "lie":
            arm.send_signal(signal.SIGUSR1)
        elif self.fault.way == "relay":
            relay[0].send_signal(signal.SIGUSR1)
        elif self.fault.way == "output":
            os.close(reader)
        elif self.fault.way == "process":
            self._act(press, arm)
        return begun

    def _act(self, press, arm) -> None:
        def to(pids, *numbers):
            for number in numbers:
                for pid in pids:
                    os.kill(pid, number)
                time.sleep(1.5 if number == signal.SIGSTOP and len(numbers) > 1 else 0.0)

        own, helpers = [press.pid], self._helpers
        assert helpers or self.kind == "sim"

        def restart():
            arm.kill()
            arm.wait()
            self.again.append(subprocess.Popen(arm.args, stdout=subprocess.DEVNULL))  # noqa: S603 - as it was started

        stop, kill = signal.SIGSTOP, signal.SIGKILL
        acts: dict[str, Callable[[], None]] = {
            "term all": lambda: to([*helpers, *own], signal.SIGTERM),
            "int all": lambda: to([*helpers, *own], signal.SIGINT),
            "kill": lambda: to(own, kill),
            "segv": lambda: to(own, signal.SIGSEGV),
            "stop": lambda: to(own, stop, signal.SIGCONT),
            "stop for ever": lambda: to(own, stop),
            "kill helper": lambda: to(helpers, kill),
            "stop helper": lambda: to(helpers, stop),
            "kill all": lambda: to([*own, *helpers], kill),
            "stop all": lambda: to([*own, *helpers], stop, signal.SIGCONT),
            "silent": lambda: to([arm.pid], stop),
            "dies": arm.kill,
            "again": restart,
        }
        acts[str(self.fault.what)]()

    def _ended(self, press, begun: float) -> tuple[int | None, str]:
        end = begun + (4.0 if self.fault.what == "stop for ever" else LONGEST)
        while press.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        try:
            told = json.loads((self.own / "rec" / "press.json").read_text())
        except (OSError, ValueError):
            told = {}
        return press.poll(), str(told.get("ended", "-"))

    def _judged(self, begun: float, code: int | None, ended: str) -> Result | None:
        """Judgement of the trace; None of an arm that did not move before the fault: it shows nothing."""
        trace = np.fromfile(self.trace)
        times, command, _, force = trace[: len(trace) // 4 * 4].reshape(-1, 4).T
        after = times > begun
        if np.ptp(command[~after]) <= STILL:
            return None
        gaps = (
            np.diff(times, prepend=times[0]) > 0.5
        )  # between an arm that was killed and another in its place
        steps = np.abs(np.diff(command, prepend=command[0])) * (times > begun) * ~gaps
        own = np.cumsum(gaps) == np.count_nonzero(gaps)  # of the arm that is there at the end
        last = (times > times[-1] - LAST) & after & own
        moved = np.flatnonzero(steps > 1e-3 * STILL)
        tick = 0.001 if self.kind == "franka" else 0.01
        return Result(
            code=code,
            ended=re.sub(r"127\.[\d.]+(:\d+)?", "ADDRESS", ended),
            moves=bool(last.any() and np.ptp(command[last]) > STILL)
            and self.fault.what not in {"silent", "dies"},
            rest=float(times[moved[-1]] - begun) if len(moved) else None,
            fastest=float(steps.max() / tick),
            force=float(force[after].max()) if after.any() else 0.0,
            kept=self._kept(),
        )

    def _kept(self) -> int | None:
        rec = self.own / "rec"
        try:
            told = json.loads((rec / "press.json").read_text())
            if told.get("unfinished"):
                rows = np.fromfile(rec / "rows.f64").reshape(-1, len(UNITS))
                return int(np.count_nonzero(rows[:, 1]))
            kept = len(read_record(rec / "record.parquet"))
            return kept - told["lateness"]["ticks"] if "lateness" in told else kept
        except (OSError, ValueError, KeyError):
            return None


CONTROLLED = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, "-m", *sys.argv[1:]])
"""
"""Makes the terminal the one of this process, and becomes a module."""


def children_of(pid: int) -> list[int]:
    """Processes that a process has started."""
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@cache
def cells() -> Path:
    """Folder with the cells of both rates."""
    folder = Path(tempfile.mkdtemp())
    for name, rate in (("franka", 1000), ("others", 100)):
        (folder / name).mkdir()
        slower_cell(folder / name, rate)
    return folder


def tried(kind: str, fault: Fault) -> Result | None:
    """What came of one run; None where a busy machine did not even begin it."""
    try:
        return Stand(kind, fault, cells()).run()
    except AssertionError as error:
        print(f"{kind}: {fault.name}: not begun: {str(error)[-60:]}", file=sys.stderr)
        return None


def missing(wires: list[str], found: dict[str, dict]) -> list[tuple[str, Fault]]:
    """Runs that were not made yet."""
    return [
        (kind, fault)
        for fault in FAULTS
        for kind in wires
        if kind in fault.wires and f"{kind}: {fault.name}" not in found
    ]


def made(state: Path) -> dict[str, dict]:
    """Results that were kept."""
    try:
        return json.loads(state.read_text())
    except (OSError, ValueError):
        return {}


def summary(found: dict[str, dict]) -> list[str]:
    """A row for each group of kinds."""
    head = (
        "| faults | kinds | runs | an arm still moves | at rest after, at most [s] | fastest command [mm/s] |"
        " largest force [N] |"
    )
    lines = [head, "|" + "---|" * 7]
    total = 0
    for group in dict.fromkeys(f.group for f in FAULTS):
        kinds = [f for f in FAULTS if f.group == group]
        own = [found[key] for f in kinds for kind in f.wires if (key := f"{kind}: {f.name}") in found]
        if not own:
            continue
        total += sum(r["moves"] for r in own)
        ended = [r["rest"] for r in own if r["rest"] is not None and r["code"] != 0]
        lines.append(
            f"| {group} | {len(kinds)} | {len(own)} | {sum(r['moves'] for r in own)} | {max(ended, default=0.0):.2f} |"
            f" {1e3 * max(r['fastest'] for r in own):.1f} | {max(r['force'] for r in own):.1f} |"
        )
    lines.append(f"| **all** | {len(FAULTS)} | {len(found)} | **{total}** | | | |")
    return lines


def main() -> int:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--wire", choices=WIRES, action="append", help="some of them")
    asked.add_argument("--only", help="kinds whose name contains this")
    asked.add_argument("--again", action="store_true", help="make those that were made, too")
    asked.add_argument("--state", type=Path, default=STATE, help="where results are kept")
    words = asked.parse_args()
    os.environ["CYCLONEDDS_URI"] = ALONE
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it, and each press would inherit that
    words.state.parent.mkdir(exist_ok=True)
    found = {} if words.again else made(words.state)
    wanted = [
        one
        for one in missing(words.wire or list(WIRES), found)
        if words.only is None or words.only in one[1].name
    ]
    for kind, fault in wanted:
        result = next(filter(None, (tried(kind, fault) for _ in range(TRIES))), None)
        if result is None:
            print(
                f"{kind}: {fault.name}: the arm did not move before its fault, three times", file=sys.stderr
            )
            continue
        found[f"{kind}: {fault.name}"] = asdict(result)
        kept = (made(words.state) if not words.again else {}) | found
        words.state.write_text(json.dumps(kept, indent=1))
        print(f"{kind}: {fault.name}: {result}", file=sys.stderr)
    found = made(words.state)
    print("\n".join(summary(found)))
    return int(any(r["moves"] for r in found.values()))


if __name__ == "__main__":
    sys.exit(main())
