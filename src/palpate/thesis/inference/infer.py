"""The whole inference: two searches, what they found judged anew, and what follows; each piece on disk at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.files import MADE, kept_folder, signed, write_json, write_text
from palpate.thesis.inference import archive, contradictions, judge, search
from palpate.thesis.inference.contradictions import Table
from palpate.thesis.inference.findings import Result, present
from palpate.thesis.inference.judge import Judged, judged
from palpate.thesis.inference.sampler import Sample, Settings
from palpate.thesis.inference.search import Runner, Search
from palpate.thesis.inference.sentences import searched, sentences
from palpate.thesis.laboratory.files import text
from palpate.thesis.laboratory.laboratory import CHOSEN, Laboratory, drawn

STATE, ALL, HALF, JUDGED = "inference.json", "all.jsonl", "half.jsonl", "judged.json"


@dataclass(frozen=True)
class Inference:
    """What is to be done.

    Args:
        folder: where everything goes.
        settings: of the sampler.
        runner: who tries laboratories.
        command: that is told in the files.
        threads: for what is looked at over ten seeds.
        half: only the half that calibrates is searched for; the shorter of both searches.
        told: what is under way, and how many laboratories are done in it.
    """

    folder: Path
    settings: Settings
    runner: Runner
    command: str
    threads: int = 1
    half: bool = False
    told: Callable[[str, int], None] = field(default=lambda _, __: None)

    def run(self, *, force: bool = False) -> Result:
        """Goes on from where the folder stands.

        Raises:
            InputError: the folder holds something else, and `force` is off.
        """
        with kept_folder(self.folder, STATE, force=force):
            write_json(self.folder / STATE, signed({"command": self.command, "finished": False}))
            everything = self._search(calibrating=False)
            everything.survey(self.folder / ALL)
            half = self._search(calibrating=True).run(self.folder / HALF)
            whole = None if self.half else everything.run(self.folder / ALL)
            result = self._result(half, whole)
            about = f"{len(sentences())} sentences of the thesis; {result.by_all.count(sentences())} hold."
            toml = text(result.by_all.laboratory, about, self.command, self.settings.seed)
            write_text(self.folder / "inferred.toml", f"{MADE} laboratory --laboratory\n{toml}")
            present(result, self.folder, self.command)
        return result

    def _search(self, *, calibrating: bool) -> Search:
        of, everything = searched(calibrating=calibrating), searched(calibrating=False)
        name = "calibrating half" if calibrating else "all sentences"

        def progress(count: int) -> None:
            self.told(name, count)

        other = {}
        if calibrating:
            head = Search(everything, self.settings, self.runner).head()
            other = search.borrowed(self.folder / ALL, head, everything, of)
        return Search(of, self.settings, self.runner, progress, other)

    def _table(self) -> Table:
        """Of every laboratory that was tried; those of the prior once, by all sentences."""
        (of_all, whole, _), (of_half, half, _) = (archive.read(self.folder / name) for name in (ALL, HALF))
        begun = self.settings.first * self.settings.particles
        later = {number: tried for number, tried in half.items() if number >= begun}
        return contradictions.joined(
            contradictions.table(of_all.sentences, whole), contradictions.table(of_half.sentences, later)
        )

    def _result(self, half: Sample, whole: Sample | None) -> Result:
        book = _Book(self.folder / JUDGED, self.threads, lambda n: self.told("over ten seeds", n))
        bench = book.judged(CHOSEN)
        by_half = book.judged(best(half))
        by_all = by_half if whole is None else book.judged(best(whole))
        return Result(
            half,
            whole,
            bench,
            by_half,
            by_all,
            self._table(),
        )


def best(sample: Sample) -> Laboratory:
    """The laboratory of a posterior that misses fewest sentences; the first of several."""
    return drawn(sample.points[int(np.argmax(sample.likelihood))].tolist())


class _Row(msgspec.Struct):
    key: str
    held: dict[str, int]


class _Rows(msgspec.Struct):
    rows: list[_Row]


class _Book:
    """Laboratories that were judged, kept in a file."""

    def __init__(self, path: Path, threads: int, told: Callable[[int], None]):
        self._path, self._threads, self._told = path, threads, told
        self._stamp = search.stamp()
        self._rows: dict[str, dict[str, int]] = {}
        if path.exists():
            try:
                rows = msgspec.json.decode(path.read_bytes(), type=_Rows).rows
            except msgspec.DecodeError as error:
                raise InputError(f"{path} is spoiled ({error}); remove it, and it is made anew") from error
            self._rows = {row.key: row.held for row in rows}

    def judged(self, laboratory: Laboratory) -> Judged:
        """A laboratory over all seeds; what the file knows is not done again."""
        key = f"{self._stamp} {sorted((k, str(v)) for k, v in asdict(laboratory).items())}"
        if key not in self._rows:
            one = judged(laboratory, threads=self._threads)
            self._rows[key] = dict(one.held)
            rows = [{"key": k, "held": held} for k, held in self._rows.items()]
            write_json(self._path, signed({"rows": rows}))
            self._told(len(self._rows))
        return Judged(laboratory, len(judge.SEEDS), self._rows[key])
