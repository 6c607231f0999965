"""`make attack`: spoiled files, kills, full disks, long runs; the last result stands in docs/reliability.md.

python benchmarks/attack/run.py --inputs 6000 --kills 64 --seconds 3600 --write
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

from killing import KINDS
from lasting import lasted
from reading import GOOD, attack
from samples import SAMPLES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reliability.md"
BEGIN, END = "<!-- attack: begin -->", "<!-- attack: end -->"


def reading(inputs: int) -> tuple[list[str], list[str]]:
    """A row for each kind of file, and what went wrong."""
    rows = ["| file | inputs | read | refused in one line | neither | slowest |", "|---|---|---|---|---|---|"]
    defects: list[str] = []
    each, total, bad = -(-inputs // len(SAMPLES)), 0, 0
    for kind in SAMPLES:
        with tempfile.TemporaryDirectory() as folder:
            told = attack(kind, range(each), Path(folder))
        read, refused = (told.counts[word] for word in GOOD)
        rows.append(f"| {kind} | {told.inputs} | {read} | {refused} | {told.bad} | {told.worst:.1f} s |")
        defects += told.defects
        total, bad = total + told.inputs, bad + told.bad
        print(rows[-1], flush=True)
    rows.append(f"| all | {total} | | | {bad} | |")
    return rows, defects


def killing(kills: int) -> tuple[list[str], list[str]]:
    """A row for each kind of violence, and what went wrong."""
    rows, defects = ["| what | times | what was found afterwards |", "|---|---|---|"], []
    for name, kind in KINDS.items():
        with tempfile.TemporaryDirectory() as folder:
            told: Counter[str] = kind(kills, Path(folder))
        defects += [f"{name}: {word}" for word in told if word.startswith("defect")]
        found = ", ".join(f"{count} {word}" for word, count in told.most_common())
        rows.append(f"| {name} | {kills} | {found} |")
        print(rows[-1], flush=True)
    return rows, defects


def lasting(seconds: float) -> tuple[list[str], list[str]]:
    """A row for each shipped experiment, and what went wrong."""
    from palpate.bench import names

    rows, defects = (
        ["| experiment | simulated | largest torque of its limit | memory grown |", "|---|---|---|---|"],
        [],
    )
    for name in names():
        one = lasted(name, seconds)
        rows.append(f"| {name} | {one.seconds:g} s | {100 * one.over:.2f} % | {one.grown:.1f} MB |")
        if not one.good:
            defects.append(f"{one}")
        print(rows[-1], flush=True)
    return rows, defects


def main() -> int:
    """Runs what is asked for; 1 if anything broke a promise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=6000, help="spoiled files, of all kinds together")
    parser.add_argument("--kills", type=int, default=64, help="of each kind of violence")
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated, of each experiment")
    parser.add_argument("--write", action="store_true", help="put the result into docs/reliability.md")
    asked = parser.parse_args()
    begun, parts, defects = time.monotonic(), [], []
    for title, rows, found in (
        ("Spoiled files", *reading(asked.inputs)),
        ("Kills, Ctrl-C and full disks", *killing(asked.kills)),
        ("Long runs", *lasting(asked.seconds)),
    ):
        parts += [f"### {title}", "", *rows, ""]
        defects += found
    command = (
        f"benchmarks/attack/run.py --inputs {asked.inputs} --kills {asked.kills} --seconds {asked.seconds:g}"
    )
    took = (time.monotonic() - begun) / 60.0
    parts.append(
        f"`{command}`, {datetime.now(UTC):%Y-%m-%d}, {took:.0f} minutes; {len(defects)} promises broken."
    )
    parts += [f"- {defect}" for defect in defects[:40]]
    print("\n".join(parts))
    if asked.write:
        text = PAGE.read_text(encoding="utf-8")
        head, _, rest = text.partition(BEGIN)
        _, _, tail = rest.partition(END)
        PAGE.write_text(f"{head}{BEGIN}\n\n" + "\n".join(parts) + f"\n\n{END}{tail}", encoding="utf-8")
    return 1 if defects else 0


if __name__ == "__main__":
    sys.exit(main())
