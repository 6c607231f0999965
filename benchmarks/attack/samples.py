"""Small files that are right, one of each kind that palpate reads: what the mutations begin with."""

from __future__ import annotations

import contextlib
import hashlib
import io
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [
    str(ROOT / "tests"),
    *(str(ROOT / "packages" / f"palpate-{name}" / "tests") for name in ("studies", "wires")),
]

N = 200
TIME = np.arange(N) * 1e-3
PLACE = 1e-3 * np.abs(np.sin(20.0 * TIME))
FORCE = 5000.0 * PLACE
TABLE = np.column_stack([TIME, 1e3 * PLACE, FORCE])
NAMES = ("time_s", "position_mm", "force_N")


def sources() -> str:
    """Hash of what is attacked and of what attacks it."""
    hashed = hashlib.sha256()
    attacked = [file for room in ("src", "packages") for file in (ROOT / room).rglob("*.py")]
    for file in sorted([*attacked, *Path(__file__).parent.glob("*.[cp]*")]):
        if file.is_file() and file.suffix != ".pyc":
            hashed.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return hashed.hexdigest()[:16]


def csv(path: Path) -> None:
    """A table of text."""
    np.savetxt(path, TABLE, delimiter=",", header=",".join(NAMES), comments="", fmt="%.7g")


def parquet(path: Path) -> None:
    """A table of somebody else's."""
    import polars

    polars.DataFrame(dict(zip(NAMES, TABLE.T, strict=True))).write_parquet(path)


def record(path: Path) -> None:
    """A record of palpate's own."""
    from palpate.logs import write_record
    from palpate.records import Record

    units = {"time": "s", "position": "m", "force": "N"}
    write_record(Record({"time": TIME, "position": PLACE, "force": FORCE}, units, {"seed": 0}), path)


def mat(path: Path) -> None:
    """Variables of MATLAB."""
    from scipy.io import savemat

    savemat(path, {"time_s": TIME, "position_mm": 1e3 * PLACE, "force_N": FORCE})


def excel(path: Path) -> None:
    """A sheet of a spreadsheet."""
    from logs.books import spreadsheet

    spreadsheet(path, {"Press": [list(NAMES), *TABLE.tolist()]})


def bag(kind: str) -> Callable[[Path], None]:
    """A recorder's file: `bag1`, `mcap` or `sqlite`."""

    def make(path: Path) -> None:
        from logs.ros_bags import pose, storage, wrench, write_bag

        along = np.outer(np.ones(N), [0.0, 0.0, 1.0])
        sent = [wrench("/ft", TIME, FORCE[:, None] * along), pose("/pose", TIME, PLACE[:, None] * along)]
        folder = path.with_name(f"{path.name}.whole")
        storage(write_bag(folder, kind, sent)).replace(path)

    return make


def experiment(path: Path) -> None:
    """An experiment."""
    from palpate.bench import source

    path.write_text(source("foam-neural"), encoding="utf-8")


def study(path: Path) -> None:
    """A study."""
    from studies.small import SMALL

    path.write_text(SMALL, encoding="utf-8")


def journal(path: Path) -> None:
    """Finished runs of a study."""
    from palpate.studies.journal import Row, open_journal

    with open_journal(path, HEAD()) as book:
        for run in range(10):
            book.append(
                Row(run, {"a": 0.1 * run, "seed": 0}, "done", "as asked for", (1.0 / (run + 1),), 0.01)
            )


def gains(path: Path) -> None:
    """A tuned force loop."""
    _wrote(path, "tune", "--arm", "ur5e", "--force", "10", "--stiffness", "500:20000")


def certificate(path: Path) -> None:
    """A proof of where it is stable."""
    of = path.with_name("gains.toml")
    if not of.exists():
        gains(of)
    _wrote(path, "certify", str(of), "--held-only")


def _wrote(path: Path, *words: str) -> None:
    from palpate.cli import main

    silent = io.StringIO()
    with contextlib.redirect_stdout(silent), contextlib.redirect_stderr(silent):
        assert main([*words, "--out", str(path)]) == 0


def HEAD() -> object:
    """Of the journal."""
    from palpate.studies.journal import JournalHead

    return JournalHead("T", "study", "0.1.0", {"numpy": "2.2.0"}, 10)


SAMPLES: dict[str, tuple[str, Callable[[Path], None]]] = {
    "CSV": (".csv", csv),
    "Parquet": (".parquet", parquet),
    "record": (".parquet", record),
    "MATLAB": (".mat", mat),
    "Excel": (".xlsx", excel),
    "ROS 1 bag": (".bag", bag("bag1")),
    "MCAP": (".mcap", bag("mcap")),
    "SQLite bag": (".db3", bag("sqlite")),
    "experiment": (".toml", experiment),
    "study": (".toml", study),
    "journal": (".jsonl", journal),
    "gains": (".toml", gains),
    "certificate": (".json", certificate),
}
"""By kind: the ending of its name, and who makes it."""

SHARES = {
    "CSV": 12, "Parquet": 2, "record": 2, "MATLAB": 2, "Excel": 2, "ROS 1 bag": 4, "MCAP": 4, "SQLite bag": 4,
    "experiment": 20, "study": 20, "journal": 20, "gains": 8, "certificate": 2,
}  # fmt: skip
"""Of the inputs of an attack: fewer of what takes long, such as formats that are read in a process of their own."""

COVERED = {"CSV": 4, "experiment": 4, "study": 4, "gains": 3, "certificate": 1, "MCAP": 2, "SQLite bag": 2}
"""Kinds that are also spoiled by coverage, each with its share: those that are read in the process of the attack."""
