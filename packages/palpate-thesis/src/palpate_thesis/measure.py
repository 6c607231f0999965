"""Measure the thesis study by study: each result is on disk at once, and an interrupted measurement resumes."""

import time
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from palpate.errors import InputError
from palpate.files import check_place, kept_folder, with_author, write_json, write_text
from palpate.report import style
from palpate.report.page import data_address, render
from palpate_thesis.claims import (
    VERDICTS,
    Done,
    ThesisClaim,
    count_in_words,
    experiment_sentences,
    plausible_laboratories,
    texts,
)
from palpate_thesis.drawing import apply_look
from palpate_thesis.figure import FigureModule, is_experiment
from palpate_thesis.laboratory import BENCH, UNKNOWNS, Laboratory, load_laboratory
from palpate_thesis.runs import Runs, sources_digest

STATE = "thesis.json"


@dataclass(frozen=True)
class MeasurementFormat:
    """How a measurement is written."""

    command: str  # command line that makes it again, for its page
    laboratory: str = "bench"  # its name, for the page
    endings: tuple[str, ...] = (".png",)  # of the figures' files, besides the PNG that the page shows
    dpi: int | None = None  # of a PNG; the usual one if None
    about: str = ""  # the laboratory of the experiments, in words


@dataclass
class FolderState:
    """Content of the folder, with the digest of its sources, seeds and laboratory (`stamp`), whose values it names."""

    stamp: str
    wanted: list[str]
    written: MeasurementFormat
    values: dict[str, float] = field(default_factory=dict)
    done: dict[str, Done] = field(default_factory=dict)


def measure(
    studies: Sequence[FigureModule],
    runs: Runs,
    folder: Path,
    *,
    written: MeasurementFormat,
    replace: bool = False,
    started: Callable[[FigureModule], None] = lambda _: None,
    resumed: Callable[[int], None] = lambda _: None,
) -> list[Done]:
    """Run the studies, and write claims.json, index.html and each figure into the folder after each study.

    The figures of experiments are of the laboratory of `runs`, all others of the bench.

    A folder with an unfinished measurement of the same sources, studies and seeds is continued; `resumed` is then
    called with the number of studies that are done.

    Raises:
        InputError: the folder holds anything else, and `replace` is off; another process is writing there.
    """
    with kept_folder(folder, STATE, replace=replace):
        state = _load_state(studies, runs, folder, written)
        _save_state(state, folder)
        if state.done:
            resumed(len(state.done))
        for study in studies:
            if study.NUMBER not in state.done:
                started(study)
                state.done[study.NUMBER] = _measure_study(study, runs, folder, written)
                _write_results(state, folder)
    return [state.done[number] for number in state.wanted]


def _measure_study(study: FigureModule, runs: Runs, folder: Path, written: MeasurementFormat) -> Done:
    start = time.perf_counter()
    runs = runs_for(study.NUMBER, runs)
    data = study.run(runs)
    claims = [note_for(claim, runs.laboratory) for claim in study.check(data)]
    further = getattr(study, "tables", None)
    with apply_look():
        for ending in dict.fromkeys((".png", *written.endings)):
            style.save(study.plot(data), folder / f"{study.NUMBER}{ending}", written.dpi)
    seconds, tables = time.perf_counter() - start, further(data) if further else []
    return Done(study.NUMBER, *texts(study.NUMBER), claims, seconds, tables)


def runs_for(number: str, runs: Runs) -> Runs:
    """Runs of a study: of an experiment in the chosen laboratory, of another figure on the bench."""
    return runs if is_experiment(number) else replace(runs, laboratory=BENCH)


def note_for(claim: ThesisClaim, laboratory: Laboratory) -> ThesisClaim:
    """Add the laboratory in which a sentence holds that does not hold here, and the unknowns that decide it."""
    note = claim.note
    if claim.verdict == "reproduced in a plausible laboratory":
        elsewhere = plausible_laboratories()[claim.id]
        note += f" It holds with --laboratory {elsewhere}, which keeps the printed values too."
    if claim.id in experiment_sentences() and laboratory == load_laboratory("inferred"):
        names = ", ".join(name for name, ids in sensitivity().items() if claim.id in ids)
        note += (
            f" Unknowns that decide it, changed alone: {names}."
            if names
            else " No unknown, changed alone, decides it."
        )
    return replace(claim, note=note)


@cache
def sensitivity() -> Mapping[str, Sequence[str]]:
    """By unknown, the sentences whose truth it changes in the inferred laboratory: see `palpate laboratory`."""
    text = (resources.files("palpate_thesis") / "inference" / "sensitivity.toml").read_text("utf-8")
    return tomllib.loads(text)


def _load_state(
    studies: Sequence[FigureModule], runs: Runs, folder: Path, written: MeasurementFormat
) -> FolderState:
    wanted = [study.NUMBER for study in studies]
    stamp = f"{sources_digest()} seeds {list(runs.seeds)}"
    if runs.laboratory != BENCH:
        stamp += f" laboratory {runs.laboratory.numbers()}"
    path = folder / STATE
    if not path.exists():
        return FolderState(stamp, wanted, written, runs.laboratory.numbers())
    check_place(path)
    try:
        state = msgspec.json.decode(path.read_bytes(), type=FolderState)
    except (OSError, msgspec.DecodeError):
        raise InputError(f"{path} is no measurement of the thesis; choose another --out") from None
    if state.stamp != stamp or state.wanted != wanted or len(state.done) == len(wanted):
        raise InputError(
            f"{folder} holds a measurement already; choose another --out, or add --replace to replace it"
        )
    return state


def _save_state(state: FolderState, folder: Path) -> None:
    write_json(folder / STATE, with_author(asdict(state)))


def _write_results(state: FolderState, folder: Path) -> None:
    """Write claims.json, the page and the state, each file whole or as it was."""
    done = [state.done[number] for number in state.wanted if number in state.done]
    write_json(folder / "claims.json", [asdict(claim) for study in done for claim in study.claims])
    pictures = {
        study.number: data_address((folder / f"{study.number}.png").read_bytes(), "image/png")
        for study in done
    }
    missing = [number for number in state.wanted if number not in state.done]
    write_text(folder / "index.html", index_page(done, pictures, missing, state))
    _save_state(state, folder)


TONES = dict(zip(VERDICTS, ("ok", "part", "warn", "none"), strict=True))
CHAPTERS = {
    (3, 0): "The bench",
    (4, 0): "The controllers",
    (5, 0): "The identifiers",
    (6, 0): "Least squares",
    (6, 6): "Neural identifier",
    (6, 10): "Force control",
    (7, 0): "Conclusions",
}
"""Chapters of the page, by the place in the thesis where each begins."""


def index_page(
    done: Sequence[Done], pictures: Mapping[str, str], missing: Sequence[str], state: FolderState
) -> str:
    """The page as HTML, with the measured studies and their pictures by number; it opens without a network."""
    claims = [claim for study in done for claim in study.claims]
    verdicts = Counter(claim.verdict for claim in claims)
    titles = dict.fromkeys(chapter_of(study.number) for study in done)
    return render(
        "index.html",
        "palpate_thesis",
        room="thesis",
        title="The thesis, measured again",
        chapters={title: [s for s in done if chapter_of(s.number) == title] for title in titles},
        count=verdicts.total(),
        counts=count_in_words(claims),
        about=state.written.about,
        verdicts=verdicts,
        tones=TONES,
        pictures=pictures,
        missing=missing,
        command=state.written.command,
        laboratory=state.written.laboratory,
        unknowns=_unknowns_table(state),
        seconds=sum(study.seconds for study in done),
    )


def _unknowns_table(state: FolderState) -> list[dict[str, Any]]:
    """A row for each unknown of the laboratory, with the sentences that it decides alone."""
    decided = sensitivity() if state.values == load_laboratory("inferred").numbers() else {}
    return [
        {"of": u, "value": state.values[u.name], "sentences": decided.get(u.name, ())}
        for u in UNKNOWNS
        if u.name in state.values
    ]


def chapter_of(number: str) -> str:
    """Title of the page's chapter for the thesis' number of a figure, or for the name of an explanation."""
    if not number[0].isdigit():
        return "Explanations"
    place = tuple(map(int, number.split(".")))
    return next(title for start, title in reversed(CHAPTERS.items()) if start <= place)
