"""Measures the thesis, study by study; each result is on disk at once, and an interrupted run resumes."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from palpate._jit import sources_stamp
from palpate.errors import InputError
from palpate.files import check_place, kept_folder, with_author, write_json, write_text
from palpate.report import style
from palpate.report.chart import panel_scripts
from palpate.report.look.assets import data, text_of
from palpate.report.page import render
from palpate_thesis import look
from palpate_thesis.claims import Done, ThesisClaim, count_in_words, count_verdicts, rows_of, tables, texts
from palpate_thesis.drawn_panels import panels_of
from palpate_thesis.figure import FigureModule
from palpate_thesis.runs import Runs

STATE = "thesis.json"
PANELS = ".panels.json"


@dataclass(frozen=True)
class MeasurementFormat:
    """How a measurement is written.

    Args:
        command: that makes it again, for its page.
        endings: of the figures' files; the page shows a PNG where a figure has no panels of its own.
        dpi: of a PNG; the usual one if None.
    """

    command: str
    endings: tuple[str, ...] = (".png",)
    dpi: int | None = None


@dataclass
class FolderState:
    """Content of the folder, with its sources and seeds."""

    stamp: str
    wanted: list[str]
    command: str
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
    """Runs the studies and writes claims.json, index.html and each figure into the folder, after each study.

    A figure is written as a picture, and as the panels that the page draws (`NUMBER.panels.json`).

    A folder that holds an unfinished measurement of the same sources, studies and seeds is gone on with; `resumed` is
    told how many studies are done.

    Raises:
        InputError: the folder holds anything else, and `replace` is off; another process is writing there.
    """
    with kept_folder(folder, STATE, replace=replace):
        state = _state(studies, runs, folder, written.command)
        _write_state(state, folder)  # from now on the folder is known for what it is
        if state.done:
            resumed(len(state.done))
        for study in studies:
            if study.NUMBER not in state.done:
                started(study)
                state.done[study.NUMBER] = _measure_study(study, runs, folder, written)
                _write(state, folder)
    return [state.done[number] for number in state.wanted]


def _measure_study(study: FigureModule, runs: Runs, folder: Path, written: MeasurementFormat) -> Done:
    begun = time.perf_counter()
    data = study.run(runs)
    claims = [_with_note(claim, runs) for claim in study.check(data)]
    with look.apply_look():
        drawing = study.plot(data)
        for ending in dict.fromkeys((".png", *written.endings)):
            style.save(drawing, folder / f"{study.NUMBER}{ending}", written.dpi)
        write_json(folder / f"{study.NUMBER}{PANELS}", with_author({"panels": panels_of(drawing)}))
    return Done(study.NUMBER, *texts(study.NUMBER), claims, time.perf_counter() - begun)


def _with_note(claim: ThesisClaim, runs: Runs) -> ThesisClaim:
    """A claim with a note that is true of the laboratory: those of the figures speak of the hand-chosen bench."""
    if runs.laboratory.chosen:
        return claim
    told = ", ".join(f"{name} {value:.3g}" for name, value in runs.laboratory.numbers().items())
    note = f"In this laboratory: {told}. The reason on the hand-chosen bench is in that measurement."
    return replace(claim, note=note)


def _state(studies: Sequence[FigureModule], runs: Runs, folder: Path, command: str) -> FolderState:
    wanted = [s.NUMBER for s in studies]
    sources = sources_stamp(*sorted(Path(__file__).parent.rglob("*.py")))
    stamp = f"{sources} seeds {list(runs.seeds)}"
    if not runs.laboratory.chosen:
        stamp += f" laboratory {runs.laboratory.numbers()}"
    if not (folder / STATE).exists():
        return FolderState(stamp, wanted, command)
    old = _read_state(folder)
    if old is None:
        raise InputError(f"{folder / STATE} is no measurement of the thesis; choose another --out")
    if old.stamp != stamp or old.wanted != wanted or len(old.done) == len(wanted):
        raise InputError(
            f"{folder} holds a measurement already; choose another --out, or add --replace to replace it"
        )
    return old


def _read_state(folder: Path) -> FolderState | None:
    check_place(folder / STATE)
    try:
        return msgspec.json.decode((folder / STATE).read_bytes(), type=FolderState)
    except (OSError, msgspec.DecodeError):
        return None


def _write(state: FolderState, folder: Path) -> None:
    """Everything that the folder says, each file whole or as it was."""
    finished = [state.done[n] for n in state.wanted if n in state.done]
    write_json(folder / "claims.json", [asdict(row) for row in rows_of(finished)])
    panels = {done.number: _panels(folder / f"{done.number}{PANELS}") for done in finished}
    missing = [number for number in state.wanted if number not in state.done]
    write_text(folder / "index.html", index_page(finished, panels, missing, state.command))
    _write_state(state, folder)


def _panels(path: Path) -> list[dict[str, Any]]:
    """As an earlier measurement left them; none where they are spoiled, and the page names the picture."""
    try:
        return list(msgspec.json.decode(path.read_bytes(), type=dict[str, Any])["panels"])
    except (OSError, msgspec.DecodeError, KeyError, TypeError):
        return []


def _write_state(state: FolderState, folder: Path) -> None:
    write_json(folder / STATE, with_author(asdict(state)))


TONES = {"reproduced": "ok", "differs": "warn", "not checkable": "none"}
_CHAPTERS = (("2.", "Earlier schemes"), ("3.", "The bench"), ("4.", "The controllers"))
_PARTS = ((5, "Least squares"), (9, "Neural identifier"), (17, "Force control"))
"""Of chapter 6, by the last figure of each."""
_OTHERS = "Explanations"


def index_page(
    done: Sequence[Done],
    panels: Mapping[str, Sequence[Mapping[str, Any]]],
    missing: Sequence[str],
    command: str,
) -> str:
    """The page as HTML, figures included; it opens without a network.

    Args:
        done: studies that are measured.
        panels: of each by its number, as `drawn_panels` makes them.
        missing: numbers of those still to come.
        command: that measures them.
    """
    claims = [claim for one in done for claim in one.claims]
    verdicts = count_verdicts(claims)
    return render(
        "index.html",
        "palpate_thesis",
        room="thesis",
        title="The thesis, measured again",
        chapters=_chapters(done),
        count=verdicts.total(),
        told=count_in_words(claims),
        verdicts=verdicts,
        tones=TONES,
        panels=data(dict(panels)),
        missing=missing,
        command=command,
        seconds=sum(one.seconds for one in done),
        scripts=(*panel_scripts(), text_of("index.js", "palpate_thesis")),
    )


def _chapters(done: Sequence[Done]) -> list[dict[str, Any]]:
    """Studies by chapter, each with its claims."""
    found: dict[str, list[dict[str, Any]]] = {}
    for one in done:
        found.setdefault(chapter_of(one.number), []).append({"study": one, "claims": one.claims})
    return [{"title": title, "studies": studies} for title, studies in found.items()]


def chapter_of(number: str) -> str:
    """Chapter of a figure, by its number in the thesis; a name of ours is an explanation if its texts name no other."""
    for start, title in _CHAPTERS:
        if number.startswith(start):
            return title
    head, _, tail = number.partition(".")
    if head != "6" or not tail.isdigit():
        return tables()["figures"].get(number, {}).get("chapter", _OTHERS)
    return next((title for last, title in _PARTS if int(tail) <= last), _OTHERS)
