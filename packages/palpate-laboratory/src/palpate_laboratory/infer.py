"""The whole inference: two searches, new judgements of their results, and the findings; each piece on disk at once."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np

from palpate.files import MADE, kept_folder, with_author, write_json, write_text
from palpate_laboratory import archive, contradictions, judge, search
from palpate_laboratory.contradictions import VerdictTable
from palpate_laboratory.findings import present
from palpate_laboratory.judge import Judged, drawn_shares, judged_shares
from palpate_laboratory.laboratory import CHOSEN, Laboratory, laboratory_at, text
from palpate_laboratory.result import Contradiction, InferenceResult
from palpate_laboratory.sampler import Sample, Settings
from palpate_laboratory.search import PosteriorSearch, Runner
from palpate_laboratory.sentences import sentences, sentences_of_search

Progress = Callable[[str, int, int], None]
"""Called with the name of the work, and how many laboratories of how many are done in it."""
STATE, ALL, HALF, PREDICTED = "inference.json", "all.sqlite", "half.sqlite", "predicted.sqlite"
JUDGED, BRED = "judged.sqlite", "bred.sqlite"
PREDICTIVE = 20_000_000
"""Number of the first laboratory whose sentences are predicted, so that its noise is none that a search has seen."""
SURELY, TRIES = 6, 64
"""Sets of each size that are searched for by themselves, those that chance explains least; and laboratories for
each of them."""

CANDIDATES = 2
"""Laboratories of a posterior that are looked at over ten seeds: which of those that miss fewest sentences in one run
is best, the sentences that it was inferred from say over ten."""


@dataclass(frozen=True)
class Inference:
    """Settings of an inference.

    Args:
        folder: where everything goes.
        settings: of the sampler.
        runner: who tries laboratories.
        command: that is written into the files.
        threads: for the judgements over ten seeds.
        half: only the half that calibrates is searched for; the shorter of both searches.
        told: receives the progress.
    """

    folder: Path
    settings: Settings
    runner: Runner
    command: str
    threads: int = 1
    half: bool = False
    told: Progress = lambda _what, _done, _of: None

    def run(self, *, replace: bool = False) -> InferenceResult:
        """Goes on from where the folder stands.

        Raises:
            InputError: the folder holds something else, and `replace` is off.
        """
        with kept_folder(self.folder, STATE, replace=replace):
            write_json(self.folder / STATE, with_author({"command": self.command, "finished": False}))
            everything = self._search("all sentences", calibrating=False)
            everything.survey(self.folder / ALL)
            half = self._half()
            whole = None if self.half else everything.run(self.folder / ALL)
            result = self._result(half, whole)
            about = f"{len(sentences())} sentences of the thesis; {result.by_all.count(sentences())} hold."
            toml = text(result.by_all.laboratory, about, self.command, self.settings.seed)
            write_text(self.folder / "inferred.toml", f"{MADE} laboratory --laboratory\n{toml}")
            present(result, self.folder, self.command)
        return result

    def _search(self, name: str, *, calibrating: bool) -> PosteriorSearch:
        def progress(power: float, done: int, of: int) -> None:
            self.told(
                f"{name}, likelihood to the power of {power:.2g}" if power else f"{name}, prior", done, of
            )

        return PosteriorSearch(
            sentences_of_search(calibrating=calibrating), self.settings, self.runner, progress
        )

    def _half(self) -> Sample:
        everything, half = (
            self._search("calibrating half", calibrating=of_half) for of_half in (False, True)
        )
        lent = search.borrow(self.folder / ALL, everything.head(), everything.sentences, half.sentences)
        return replace(half, borrowed=lent).run(self.folder / HALF)

    def _result(self, half: Sample, whole: Sample | None) -> InferenceResult:
        prior, posterior, table = self._tables(half)
        sets = self._breed(table)
        bench = self._judge(CHOSEN)
        of_half = [self._judge(one) for one in best(half)]
        of_all = [] if whole is None else [self._judge(one) for one in best(whole)]
        by_half = max(of_half, key=lambda one: one.count(judge.calibration()))
        by_all = max(of_all, key=lambda one: one.count(sentences()), default=by_half)
        of = sentences_of_search(calibrating=False)
        shares = (
            drawn_shares("drawn from the prior", prior, of),
            drawn_shares("drawn from the posterior of the half", posterior, of),
            judged_shares("inferred from the half: its best", by_half, of),
            judged_shares("hand-chosen bench", bench, of),
        )
        judged = (bench, *of_half, *of_all)
        return InferenceResult(half, whole, bench, by_half, by_all, judged, shares, sets, table)

    def _tables(self, half: Sample) -> tuple[VerdictTable, VerdictTable, VerdictTable]:
        """Of the prior, of the posterior by half, and of every laboratory that was tried, each once."""

        def progress(_power: float, done: int, of: int) -> None:
            self.told("posterior of the half, by all sentences", done, of)

        predicted = PosteriorSearch(
            sentences_of_search(calibrating=False), self.settings, self.runner, progress
        )
        predicted.try_points(self.folder / PREDICTED, half.points, PREDICTIVE)
        begun = self.settings.first * self.settings.particles
        ids = tuple(s.id for s in predicted.sentences)
        of_all, of_half, drawn_ = (archive.read(self.folder / name)[1] for name in (ALL, HALF, PREDICTED))
        whole, posterior = contradictions.table(ids, of_all), contradictions.table(ids, drawn_)
        prior = contradictions.table(ids, {n: tried for n, tried in of_all.items() if n < begun})
        later = {n: tried for n, tried in of_half.items() if n >= begun}
        half_ids = tuple(s.id for s in sentences_of_search(calibrating=True))
        return (
            prior,
            posterior,
            contradictions.join(whole, posterior, contradictions.table(half_ids, later)),
        )

    def _judge(self, laboratory: Laboratory) -> Judged:
        """A laboratory over all seeds."""
        done, of = count(1), len(judge.SEEDS)

        def progress() -> None:
            self.told(f"a laboratory over {of} seeds", next(done), of)

        def count_seeds() -> dict[str, int]:
            one = judge.judge_laboratory(laboratory, judge.SEEDS, threads=self.threads, told=progress)
            return dict(one.held)

        key = f"{search.stamp()} {sorted((k, str(v)) for k, v in asdict(laboratory).items())}"
        path = self.folder / JUDGED
        return Judged(laboratory, of, archive.remember(path, key, dict[str, int], count_seeds))

    def _breed(self, table: VerdictTable) -> list[Contradiction]:
        """Each of the surest contradictions, searched for by itself."""
        never = table.never_together()
        some = [one for size in (2, 3) for one in [n for n in never if len(n.ids) == size][:SURELY]]
        seed, of = self.settings.seed, f"{search.stamp()} {len(table.true)} laboratories"
        found = []
        for i, one in enumerate(some):
            self.told("bred for sentences never true together", i, len(some))
            key = f"{of}, seed {seed}, {TRIES} for {' + '.join(one.ids)}"
            breed = partial(contradictions.breed, one.ids, table, self.runner, TRIES, seed)
            found.append(
                Contradiction(one, archive.remember(self.folder / BRED, key, contradictions.Bred, breed))
            )
        return found


def best(sample: Sample) -> list[Laboratory]:
    """The laboratories of a posterior that miss fewest sentences, no two alike; the first of equals."""
    points: list[list[float]] = []
    for i in np.argsort(-sample.likelihood, kind="stable"):
        point = sample.points[i].tolist()
        if len(points) < CANDIDATES and point not in points:
            points.append(point)
    return [laboratory_at(point) for point in points]
