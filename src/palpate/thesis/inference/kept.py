"""Judged and bred laboratories, saved in files, so that they are not computed again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import Protocol, TypeVar

import msgspec

from palpate.errors import InputError
from palpate.files import signed, write_json
from palpate.thesis.inference import judge, search
from palpate.thesis.inference.contradictions import Table
from palpate.thesis.inference.directed import Bred, bred
from palpate.thesis.inference.judge import Judged, judged
from palpate.thesis.inference.search import Runner
from palpate.thesis.laboratory.laboratory import Laboratory

T = TypeVar("T")


class Progress(Protocol):
    """Told what is under way, and how many laboratories of how many are done in it."""

    def __call__(self, what: str, done: int, of: int, /) -> None:
        """Once for each laboratory."""
        ...


class _Row(msgspec.Struct):
    key: str
    held: dict[str, int]


class _Rows(msgspec.Struct):
    rows: list[_Row]


class Book:
    """Laboratories that were judged, kept in a file."""

    def __init__(self, path: Path, threads: int, told: Progress):
        self._path, self._threads, self._told = path, threads, told
        self._stamp = search.stamp()
        self._rows = {row.key: row.held for row in _kept(path, _Rows, _Rows([])).rows}

    def judged(self, laboratory: Laboratory) -> Judged:
        """A laboratory over all seeds; what the file knows is not done again."""
        key = f"{self._stamp} {sorted((k, str(v)) for k, v in asdict(laboratory).items())}"
        if key not in self._rows:
            self._rows[key] = self._over_seeds(laboratory)
            rows = [{"key": k, "held": held} for k, held in self._rows.items()]
            write_json(self._path, signed({"rows": rows}))
        return Judged(laboratory, len(judge.SEEDS), self._rows[key])

    def _over_seeds(self, laboratory: Laboratory) -> dict[str, int]:
        done = count()
        of = len(judge.SEEDS)

        def told() -> None:
            self._told(f"laboratory {len(self._rows) + 1} over {of} seeds", next(done) + 1, of)

        return dict(judged(laboratory, judge.SEEDS, threads=self._threads, told=told).held)


class _Brood(msgspec.Struct):
    key: str
    tries: int
    most: int
    shares: tuple[float, ...]


class _Broods(msgspec.Struct):
    rows: list[_Brood]


class Nest:
    """Bred laboratories, saved in a file."""

    def __init__(self, path: Path, among: Table, runner: Runner, seed: int):
        self._path, self._among, self._runner, self._seed = path, among, runner, seed
        self._from = f"{search.stamp()} {len(among.true)} laboratories, seed {seed}"
        self._rows = {row.key: row for row in _kept(path, _Broods, _Broods([])).rows}

    def bred(self, wanted: Sequence[str], tries: int) -> Bred:
        """For these sentences; what the file knows is not done again."""
        key = f"{self._from}, {tries} for {' + '.join(wanted)}"
        if key not in self._rows:
            found = bred(wanted, self._among, self._runner, tries, self._seed)
            self._rows[key] = _Brood(key, found.tries, found.most, found.shares)
            write_json(
                self._path, signed({"rows": [msgspec.to_builtins(row) for row in self._rows.values()]})
            )
        row = self._rows[key]
        return Bred(row.tries, row.most, row.shares)


def _kept(path: Path, kind: type[T], none: T) -> T:
    """Content of a file; nothing if there is none.

    Raises:
        InputError: it is spoiled.
    """
    if not path.exists():
        return none
    try:
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except msgspec.DecodeError as error:
        raise InputError(f"{path} is damaged ({error}); remove it, and it is rebuilt") from error
