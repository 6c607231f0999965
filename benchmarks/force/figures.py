"""Every figure of the force law, by one command: makes what is missing for this form of the law, and writes the page.

    python benchmarks/force/figures.py [--only NAME ...] [--pages-only] [--out docs/force-figures.md]

Each study's output is kept under runs/figures by the law's name, so that a run that was stopped goes on with the next;
what the page has of this form of the law is not made again.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from pathlib import Path

from rich.progress import track

from palpate.force.gains import LAW

HERE = Path(__file__).parent
FIGURES = {
    "First touches: UR5e": "first_touches.py --touches 5000 --arms ur5e",
    "First touches: FR3": "first_touches.py --touches 5000 --arms fr3",
    "Wrong sensors in free motion": "free_motion.py --touches 1000",
    "Beyond the gains": "beyond.py --touches 50",
    "Laws that know the surface": "first_touches.py --touches 1000 --laws knowing told",
    "False alarms": "false_alarms.py --hours 20 --arms ur5e",
    "Wrong priors, changes, sways, curves: UR5e": "disturbed.py --touches 100 --arms ur5e",
    "Wrong priors, changes, sways, curves: FR3": "disturbed.py --touches 100 --arms fr3",
    "Hours: UR5e": "hours.py --runs 70 --arms ur5e",
    "Hours: FR3": "hours.py --runs 30 --arms fr3",
    "The thesis' arm": "on_the_bench.py --seeds 6",
    "The thesis' arm, friction twice": "on_the_bench.py --friction 2 --seeds 1 --controllers foam-cautious",
    "The thesis' arm, surfaces that sway or change": "moving_on_the_bench.py --seeds 3 --controllers foam-cautious",
    "The thesis' arm, the hardest change": "moving_on_the_bench.py --seeds 24 --told 18 36 54",
    "Proofs: UR5e": "falsify.py",
    "Proofs: FR3": "falsify.py --arms fr3",
    "The peak at the touch": "peak.py",
    "Commands in vain": "in_vain.py --touches 60",
    "A call": "update.py",
}
ABOUT = """# Figures of the force law

Of `{law}`. `make force-figures` makes this page; what the figures say stands in [force](force.md). A figure that is
missing has not been made of this form of the law."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=list(FIGURES))
    parser.add_argument("--pages-only", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("docs/force-figures.md"))
    told = parser.parse_args()
    recall(told.out)
    missing = [name for name in told.only if not kept(name).exists()]
    for name in track([] if told.pages_only else missing, "figures", transient=True):
        make(name)
    sections = [section(name) for name in FIGURES if kept(name).exists()]
    told.out.write_text("\n\n".join([ABOUT.format(law=LAW), *sections]) + "\n", encoding="utf-8")


def recall(page: Path) -> None:
    """Keeps the outputs that a page has of this form of the law and of the same command."""
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    if f"Of `{LAW}`." not in text:
        return
    for name, command in FIGURES.items():
        _, found, rest = text.partition(f"## {name}\n\n`python benchmarks/force/{command}`\n\n```text\n")
        if found and not kept(name).exists():
            kept(name).parent.mkdir(parents=True, exist_ok=True)
            kept(name).write_text(rest.partition("\n```")[0], encoding="utf-8")


def kept(name: str) -> Path:
    """Where a study's output is."""
    return Path("runs/figures") / LAW.replace(" ", "-") / f"{name}.txt"


def make(name: str) -> None:
    """Runs the study; its output is there whole or not at all."""
    script, *others = shlex.split(FIGURES[name])
    command = [sys.executable, HERE / script, *others]
    done = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603 -- our own studies
    path = kept(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(done.stdout, encoding="utf-8")


def section(name: str) -> str:
    """A study as it stands in the page."""
    text = "\n".join(line for line in kept(name).read_text(encoding="utf-8").splitlines() if line.strip())
    return f"## {name}\n\n`python benchmarks/force/{FIGURES[name]}`\n\n```text\n{text}\n```"


if __name__ == "__main__":
    main()
