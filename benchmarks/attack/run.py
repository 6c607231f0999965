"""`make attack`: spoiled files, kills, full disks, long runs; the last result stands in docs/reliability.md.

    python benchmarks/attack/run.py --inputs 5000 --kills 32 --seconds 3600 --write

It goes on where it was stopped, as long as neither palpate nor the attack was changed.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from killing import KINDS
from lasting import Lasted, lasted
from reading import GOOD, Told, attack
from samples import SAMPLES, SHARES

ROOT = Path(__file__).resolve().parents[2]
PAGE, STATE = ROOT / "docs" / "reliability.md", ROOT / "build" / "attack.json"
BEGIN, END = "<!-- attack: begin -->", "<!-- attack: end -->"
SLICE, FEW = 50, 4
"""Inputs, and kills, after which what was found is saved."""


@dataclass
class Found:
    """What was found so far; slices by the name of their kind and their first seed.

    Args:
        of: hash of the sources that were attacked.
        read: of spoiled files.
        killed: of commands that were killed.
        lasted: of long runs, by experiment and its seconds.
        minutes: that it took.
    """

    of: str
    read: dict[str, Told] = field(default_factory=dict)
    killed: dict[str, Counter[str]] = field(default_factory=dict)
    lasted: dict[str, Lasted] = field(default_factory=dict)
    minutes: float = 0.0


@dataclass(frozen=True)
class Part:
    """A slice of the attack: where its finding is kept, under which name, and what finds it."""

    kept: str
    name: str
    find: Callable[[Path], object]


def parts(inputs: int, kills: int, seconds: float) -> list[Part]:
    """All slices, each kind's spread evenly, so that an attack that is stopped has seen something of all."""
    from palpate.bench import names

    share = inputs / sum(SHARES.values())
    kinds: list[list[Part]] = []
    for kind in SAMPLES:
        firsts = range(0, round(share * SHARES[kind]), SLICE)
        seeds = [range(first, first + SLICE) for first in firsts]
        kinds.append(
            [Part("read", f"{kind} {s.start}", lambda f, k=kind, s=s: attack(k, s, f)) for s in seeds]
        )
    for kind, kill in KINDS.items():
        counts = {first: min(FEW, kills - first) for first in range(0, kills, FEW)}
        kinds.append(
            [
                Part("killed", f"{kind} {n}", lambda f, v=kill, c=c, n=n: _many(v, c, f, n))
                for n, c in counts.items()
            ]
        )
    kinds.append([Part("lasted", f"{e} {seconds:g}", lambda _, e=e: lasted(e, seconds)) for e in names()])
    spread = [((i + 0.5) / len(own), part) for own in kinds for i, part in enumerate(own)]
    return [part for _, part in sorted(spread, key=lambda placed: placed[0])]


def _many(
    violence: Callable[[int, Path, int], Counter[str]], count: int, folder: Path, seed: int
) -> Counter[str]:
    return Counter(times=count) + violence(count, folder, seed)


def sources() -> str:
    """Hash of what is attacked and of what attacks it."""
    hashed = hashlib.sha256()
    for file in sorted([*(ROOT / "src").rglob("*.py"), *Path(__file__).parent.glob("*.py")]):
        hashed.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return hashed.hexdigest()[:16]


def gone_on() -> Found:
    """What was found before, if it was of the same sources."""
    try:
        found = msgspec.json.decode(STATE.read_bytes(), type=Found, dec_hook=lambda _, told: Counter(told))
    except (OSError, msgspec.DecodeError):
        return Found(sources())
    return found if found.of == sources() else Found(sources())


def run(found: Found, wanted: list[Part]) -> None:
    """Finds what is not found yet, and saves it slice by slice."""
    STATE.parent.mkdir(exist_ok=True)
    for number, part in enumerate(wanted, 1):
        kept, begun = getattr(found, part.kept), time.monotonic()
        if part.name in kept:
            continue
        with tempfile.TemporaryDirectory() as folder:
            kept[part.name] = part.find(Path(folder))
        took = (time.monotonic() - begun) / 60.0
        found.minutes += took
        STATE.write_bytes(msgspec.json.encode(found))
        print(f"{number} of {len(wanted)}, {60 * took:.0f} s: {part.name}", flush=True)


def reading(found: Found) -> tuple[list[str], list[str]]:
    """A row for each kind of file, and what went wrong."""
    rows = [
        "| file | inputs | read | refused in one line | neither | slowest, processor |",
        "|---|---|---|---|---|---|",
    ]
    everything: list[Told] = []
    for kind in SAMPLES:
        own = [told for name, told in found.read.items() if name.rpartition(" ")[0] == kind]
        if own:
            rows.append(f"| {kind} | {_row(own)} | {max(told.worst for told in own):.1f} s |")
        everything += own
    rows.append(f"| all | {_row(everything)} | |")
    return rows, [defect for told in everything for defect in told.defects]


def _row(slices: list[Told]) -> str:
    counts = sum((told.counts for told in slices), Counter[str]())
    read, refused = (counts[word] for word in GOOD)
    return f"{counts.total()} | {read} | {refused} | {counts.total() - read - refused}"


def killing(found: Found) -> tuple[list[str], list[str]]:
    """A row for each kind of violence, and what went wrong."""
    rows, defects = ["| event | times | outcome |", "|---|---|---|"], []
    for kind in KINDS:
        own = {name: told for name, told in found.killed.items() if name.rpartition(" ")[0] == kind}
        told = sum(own.values(), Counter[str]())
        defects += [
            f"{kind}: {count} times {word}" for word, count in told.items() if word.startswith("defect")
        ]
        listed = ", ".join(
            f"{count} {word}" for word, count in told.most_common() if word not in {"times", "killed"}
        )
        rows.append(f"| {kind} | {told['times']} | {listed} |")
    return rows, defects


def lasting(found: Found) -> tuple[list[str], list[str]]:
    """A row for each shipped experiment, and what went wrong."""
    rows = [
        "| experiment | simulated | largest torque of its limit | memory grown |",
        "|---|---|---|---|",
        *(
            f"| {one.name} | {one.seconds:g} s | {100 * one.over:.2f} % | {one.grown:.1f} MB |"
            for one in found.lasted.values()
        ),
    ]
    return rows, [f"{one}" for one in found.lasted.values() if not one.good]


def told(found: Found, command: str) -> tuple[list[str], int]:
    """The page's lines, and how many promises were broken."""
    lines: list[str] = []
    defects: list[str] = []
    for title, of in (
        ("Spoiled files", reading),
        ("Kills, Ctrl-C and full disks", killing),
        ("Long runs", lasting),
    ):
        rows, broken = of(found)
        lines += [f"### {title}", "", *rows, ""]
        defects += broken
    lines.append(
        f"`{command}`, {datetime.now(UTC):%Y-%m-%d}, {found.minutes:.0f} minutes; {len(defects)} promises broken."
    )
    return [*lines, *(f"- {defect}" for defect in defects[:40])], len(defects)


def main() -> int:
    """Runs what is asked for; 1 if anything broke a promise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000, help="spoiled files, of all kinds together")
    parser.add_argument("--kills", type=int, default=32, help="of each kind of violence")
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated, of each experiment")
    parser.add_argument("--write", action="store_true", help="put the result into docs/reliability.md")
    asked = parser.parse_args()
    found, wanted = gone_on(), parts(asked.inputs, asked.kills, asked.seconds)
    try:
        run(found, wanted)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on from here")
    command = (
        f"benchmarks/attack/run.py --inputs {asked.inputs} --kills {asked.kills} --seconds {asked.seconds:g}"
    )
    missing = sum(part.name not in getattr(found, part.kept) for part in wanted)
    lines, broken = told(found, command + (f", {missing} of {len(wanted)} parts not run" if missing else ""))
    print("\n".join(lines))
    if asked.write:
        head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        _, _, tail = rest.partition(END)
        PAGE.write_text(f"{head}{BEGIN}\n\n" + "\n".join(lines) + f"\n\n{END}{tail}", encoding="utf-8")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
