"""`make attack`: hostile inputs, faults of the disk, kills, long runs; the last result stands in docs/reliability.md.

    python benchmarks/attack/run.py --inputs 10000 --faults 200 --kills 300 --seconds 3600 --write
    python benchmarks/attack/run.py --minutes 2

The first resumes where it was stopped, as long as neither palpate nor the attack was changed. The second begins with a
new seed each time, prints it, and takes as much of each part as there is time for; `--seed` repeats it.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path

import msgspec
from faults import COMMANDS, OPTIONAL, faulted
from killing import KINDS
from lasting import Lasted, lasted
from reading import GOOD, Told, attack, kinds
from samples import ROOT, sources

PAGE, STATE = ROOT / "docs" / "reliability.md", ROOT / "build" / "attack.json"
SLICE, FEW = 25, 25
"""Inputs, and kills, after which what was found is saved."""
FAR = 1_000_000
"""Between the first inputs of two seeds: no input of the one is an input of the other."""


@dataclass
class Found:
    """What was found so far; slices by the name of their kind and their first seed.

    Args:
        of: hash of the sources that were attacked.
        read: of spoiled files.
        faulted: of commands whose disk failed at one change.
        killed: of commands that were killed.
        lasted: of long runs, by experiment and its seconds.
        minutes: that it took.
    """

    of: str
    read: dict[str, Told] = field(default_factory=dict)
    faulted: dict[str, Counter[str]] = field(default_factory=dict)
    killed: dict[str, Counter[str]] = field(default_factory=dict)
    lasted: dict[str, Lasted] = field(default_factory=dict)
    minutes: float = 0.0


@dataclass(frozen=True)
class Part:
    """A slice of the attack: where its finding is kept, under which name, and what finds it."""

    kept: str
    name: str
    find: Callable[[Path], object]


@dataclass(frozen=True)
class Amount:
    """How much is attacked.

    Args:
        inputs: hostile ones, of all kinds together.
        faults: of the disk, of each command.
        kills: of all commands together.
        seconds: simulated, of each experiment.
        seed: of all of it.
    """

    inputs: int
    faults: int
    kills: int
    seconds: float
    seed: int = 0


def parts(amount: Amount) -> list[Part]:
    """All slices, each kind's spread evenly, so that an attack that is stopped has seen something of all."""
    shares = kinds()
    share, start = amount.inputs / sum(shares.values()), FAR * amount.seed
    found: list[list[Part]] = []
    for kind, own in shares.items():
        count = round(share * own)
        seeds = [range(start + first, start + min(first + SLICE, count)) for first in range(0, count, SLICE)]
        found.append(
            [Part("read", f"{kind} {s.start}", lambda f, k=kind, s=s: attack(k, s, f)) for s in seeds]
        )
    if amount.faults:
        found += [
            [Part("faulted", f"{k} {amount.seed}", lambda f, k=k: faulted(k, amount.faults, f, amount.seed))]
            for k in COMMANDS
            if find_spec("palpate_thesis") or k not in OPTIONAL
        ]
    there = {k: own for k, own in KINDS.items() if find_spec("palpate_thesis") or k not in OPTIONAL}
    share = amount.kills / sum(own for own, _ in there.values())
    for kind, (own, kill) in there.items():
        count = math.ceil(share * own)
        counts = {start + first: min(FEW, count - first) for first in range(0, count, FEW)}
        found.append(
            [
                Part("killed", f"{kind} {n}", lambda f, v=kill, c=c, n=n: _many(v, c, f, n))
                for n, c in counts.items()
            ]
        )
    if amount.seconds:
        from palpate.bench import names

        found += [
            [Part("lasted", f"{e} {amount.seconds:g}", lambda _, e=e: lasted(e, amount.seconds))]
            for e in names()
        ]
    spread = [((i + 0.5) / len(own), part) for own in found for i, part in enumerate(own)]
    return [part for _, part in sorted(spread, key=lambda placed: placed[0])]


def _many(
    violence: Callable[[int, Path, int], Counter[str]], count: int, folder: Path, seed: int
) -> Counter[str]:
    return Counter(times=count) + violence(count, folder, seed)


def gone_on() -> Found:
    """What was found before, if it was of the same sources."""
    try:
        found = msgspec.json.decode(STATE.read_bytes(), type=Found, dec_hook=lambda _, told: Counter(told))
    except (OSError, msgspec.DecodeError):
        return Found(sources())
    return found if found.of == sources() else Found(sources())


def run(found: Found, wanted: list[Part], until: float = float("inf")) -> None:
    """Finds what is not found yet, and saves it slice by slice, until a moment of the clock."""
    STATE.parent.mkdir(exist_ok=True)
    for number, part in enumerate(wanted, 1):
        kept, begun = getattr(found, part.kept), time.monotonic()
        if part.name in kept:
            continue
        if begun > until:
            break
        with tempfile.TemporaryDirectory() as folder:
            kept[part.name] = part.find(Path(folder))
        took = (time.monotonic() - begun) / 60.0
        found.minutes += took
        STATE.write_bytes(msgspec.json.encode(found))
        print(f"{number} of {len(wanted)}, {60 * took:.0f} s: {part.name}", flush=True)


def reading(found: Found) -> tuple[list[str], list[str]]:
    """A row for each kind of file, and what went wrong."""
    rows = [
        "| input | inputs | read | refused in one line | neither | slowest, processor |",
        "|---|---|---|---|---|---|",
    ]
    everything: list[Told] = []
    for kind in kinds():
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


def faulting(found: Found) -> tuple[list[str], list[str]]:
    """A row for each command, and what went wrong."""
    rows, defects = ["| command | changes on the disk | failed | outcome |", "|---|---|---|---|"], []
    for name, told in found.faulted.items():
        listed = [
            f"{count} {word}"
            for word, count in told.items()
            if word not in {"changes", "times"} and "defect" not in word
        ]
        own = [word for word in told if word.startswith("defect")]
        defects += [f"{name}: {word}" for word in own]
        bad = f", {len(own)} defects" if own else ""
        rows.append(
            f"| {name.rpartition(' ')[0]} | {told['changes']} | {told['times']} | {', '.join(listed)}{bad} |"
        )
    return rows, defects


def killing(found: Found) -> tuple[list[str], list[str]]:
    """A row for each kind of violence, and what went wrong."""
    rows, defects = ["| event | times | outcome |", "|---|---|---|"], []
    for kind in KINDS:
        own = {name: told for name, told in found.killed.items() if name.rpartition(" ")[0] == kind}
        if not own:
            continue
        told = sum(own.values(), Counter[str]())
        defects += [
            f"{kind}: {count} times {word}" for word, count in told.items() if word.startswith("defect")
        ]
        listed = ", ".join(
            f"{count} {word}" for word, count in told.most_common() if word not in {"times", "killed"}
        )
        event = f"{kind}: SIGKILL, Ctrl-C or full disk" if kind in COMMANDS else kind
        rows.append(f"| {event} | {told['times']} | {listed} |")
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


def total_inputs(found: Found) -> str:
    """Sentence with the sums over all kinds of input."""
    counts = sum((told.counts for told in found.read.values()), Counter[str]())
    read, refused = (counts[word] for word in GOOD)
    names = {name.rpartition(" ")[0] for name in found.read}
    return (
        f"{counts.total()} inputs of {len(names)} kinds: {read} read, {refused} refused in one line, "
        f"{counts.total() - read - refused} neither; the slowest took "
        f"{max(told.worst for told in found.read.values()):.1f} s of processor time."
    )


def total_events(events: dict[str, Counter[str]], template: str) -> str:
    """Sentence with the number of faults or kills, and of the kinds of them."""
    names = {name.rpartition(" ")[0] for name in events}
    return template.format(sum(told["times"] for told in events.values()), len(names))


def total_runs(found: Found) -> str:
    """Sentence with the extremes of the long runs."""
    runs = found.lasted.values()
    return (
        f"{len(runs)} experiments of {max(one.seconds for one in runs):g} s each: largest torque "
        f"{100 * max(one.over for one in runs):.2f} % of its limit, memory grown by at most "
        f"{max(one.grown for one in runs):.1f} MB."
    )


SECTIONS = {
    "inputs": ("read", reading, total_inputs),
    "faults": (
        "faulted",
        faulting,
        lambda found: total_events(found.faulted, "{} failed changes in {} commands."),
    ),
    "kills": ("killed", killing, lambda found: total_events(found.killed, "{} events of {} kinds.")),
    "long runs": ("lasted", lasting, total_runs),
}
"""Attribute of `Found`, the table that is printed, and the sentence that stands in the page, by section."""


def report(found: Found, command: str) -> tuple[dict[str, list[str]], dict[str, list[str]], int]:
    """Tables and short texts of the sections that have results, and the number of broken promises."""
    tables: dict[str, list[str]] = {}
    texts: dict[str, list[str]] = {}
    total = 0
    for title, (attribute, table, sentence) in SECTIONS.items():
        if not getattr(found, attribute):
            continue
        rows, broken = table(found)
        total += len(broken)
        last = f"`{command}`, {datetime.now(UTC):%Y-%m-%d}; {len(broken)} promises broken."
        end = [last, *(f"- {defect}" for defect in broken[:40])]
        tables[title], texts[title] = [*rows, "", *end], [sentence(found), *end]
    return tables, texts, total


def write(texts: dict[str, list[str]]) -> None:
    """Put the short text of each section into the page, and leave the others as they are."""
    page = PAGE.read_text(encoding="utf-8")
    for title, lines in texts.items():
        begin, end = f"<!-- attack, {title}: begin -->", f"<!-- attack, {title}: end -->"
        head, _, rest = page.partition(begin)
        _, _, tail = rest.partition(end)
        assert tail, f"the page has no place for {title}"
        page = f"{head}{begin}\n\n" + "\n".join(lines) + f"\n\n{end}{tail}"
    PAGE.write_text(page, encoding="utf-8")


def main() -> int:
    """Runs what is asked for; 1 if anything broke a promise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=10000, help="hostile inputs, of all kinds together")
    parser.add_argument("--faults", type=int, default=200, help="of the disk, of each command")
    parser.add_argument("--kills", type=int, default=300, help="of all commands together")
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated, of each experiment")
    parser.add_argument(
        "--minutes", type=float, help="stop after so long; with a new seed, unless one is given"
    )
    parser.add_argument("--seed", type=int, help="of all of it")
    parser.add_argument("--only", nargs="+", help="these kinds and commands alone")
    parser.add_argument("--write", action="store_true", help="put the result into docs/reliability.md")
    asked = parser.parse_args()
    seed = (
        asked.seed
        if asked.seed is not None
        else 0
        if asked.minutes is None
        else random.SystemRandom().randrange(10**6)
    )
    command = (
        f"benchmarks/attack/run.py --inputs {asked.inputs} --faults {asked.faults} --kills {asked.kills}"
    )
    command += f" --seconds {asked.seconds:g} --seed {seed}"
    command += f" --only {' '.join(asked.only)}" if asked.only else ""
    print(command, flush=True)
    amount = Amount(asked.inputs, asked.faults, asked.kills, asked.seconds, seed)
    found, wanted = gone_on() if asked.minutes is None else Found(sources()), parts(amount)
    if asked.only:
        wanted = [part for part in wanted if part.name.rpartition(" ")[0] in asked.only]
    until = time.monotonic() + 60.0 * asked.minutes if asked.minutes is not None else float("inf")
    if asked.minutes is not None:  # some of each, and nothing that takes longer than there is time
        wanted = [part for part in wanted if part.name.rpartition(" ")[0] not in OPTIONAL]
        random.Random(seed).shuffle(wanted)
    try:
        run(found, wanted, until)
    except KeyboardInterrupt:
        print("interrupted; the same command resumes")
    missing = sum(part.name not in getattr(found, part.kept) for part in wanted)
    tables, texts, broken = report(
        found, command + (f", {missing} of {len(wanted)} parts not run" if missing else "")
    )
    for title, lines in tables.items():
        print("\n".join([f"### {title}", "", *lines, ""]))
    print(f"{broken} promises broken; {command} --minutes 1e9 repeats it" if broken else "0 promises broken")
    if asked.write:
        write(texts)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
