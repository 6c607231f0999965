"""`palpate run`: one experiment, to a folder of results."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.cli._program import print_result
from palpate.cli._streams import notice_signals
from palpate.cli._terminal import COMPILING, console, simulation_progress
from palpate.cli.options import common
from palpate.cli.options.values import WHOLE
from palpate.errors import InputError
from palpate.files import RECORD, fresh_folder, with_author, write_json, write_text
from palpate.text import printable

if TYPE_CHECKING:
    from rich.console import Console

    from palpate.identification import Identification
    from palpate.records import Record


def run(
    name: Annotated[common.Experiment | None, common.QUIET] = None,
    /,
    *,
    seed: Annotated[int, WHOLE] = 0,
    known: common.KnownOptions | None = None,
    own: common.PluginOptions | None = None,
    output: common.FolderOptions | None = None,
    drawn: common.FigureOptions | None = None,
) -> int:
    """Run an experiment: the arm approaches, touches, presses.

    palpate run foam-hybrid --seed 1 --out runs/foam

    The folder holds record.parquet, summary.json, film.svg, figures and report.html; the default is runs/NAME-SEED.

    Parameters
    ----------
    name
        An experiment (see --list), or a TOML file of your own (see --print).
    seed
        Of the noise; the same seed gives the same numbers.
    """
    known, output, drawn = (
        known or common.KnownOptions(),
        output or common.FolderOptions(),
        drawn or common.FigureOptions(),
    )
    from palpate.bench.from_experiment import FILES, load_any, parse_any

    if known.list_:
        common.print_names(FILES, lambda one: load_any(one).title)
        return 0
    source = common.source_of(FILES, name, "run", known.print_)
    if name is None or source is None:
        return 0
    folder = output.out if output.out is not None else Path("runs") / f"{Path(name).stem}-{seed}"
    from palpate.bench.summary import DONE, INTERRUPTED

    drawn.check()
    with (own or common.PluginOptions()).consent():
        experiment = parse_any(source, name)  # before a Ctrl-C is only noted, which a question would wait for
        with notice_signals() as interrupted:
            ran = _run(_RunRequest(name, source, experiment, seed), folder, output, drawn, interrupted)
    # All is in its place, so that a reader of the output who has gone loses nothing.
    _show(ran, folder, output.json)
    if ran.undrawn:
        raise InputError(f"{ran.undrawn}; the record is in {folder}")
    if interrupted() or ran.summary["end"] == INTERRUPTED:
        return interrupted.code
    return 0 if ran.summary["end"] == DONE else 1


@dataclass(frozen=True)
class _Ran:
    """Results of a run, its identification, and the reason if it could not be drawn."""

    title: str
    summary: dict[str, Any]
    found: Identification | None
    undrawn: str
    record: Record


@dataclass(frozen=True)
class _RunRequest:
    """The experiment to run: its name or file, the text of that, and its numbers; and the seed of the noise."""

    name: str
    source: str
    experiment: Any
    seed: int


def _run(
    asked: _RunRequest,
    folder: Path,
    output: common.FolderOptions,
    drawn: common.FigureOptions,
    interrupted: Callable[[], bool],
) -> _Ran:
    """Runs and writes the folder of results."""
    from palpate.bench.one_direction import OneDirection
    from palpate.bench.summary import summarise
    from palpate.logs.tables.parquet import write_record

    with fresh_folder(folder, replace=output.replace) as fresh:
        command = printable(f"palpate run {shlex.quote(asked.name)} --seed {asked.seed}")
        record = _record(console(stderr=output.json), asked, interrupted)
        record = replace(record, meta={**record.meta, "command": command})
        write_record(record, fresh / RECORD)
        alone = isinstance(asked.experiment, OneDirection)  # nothing excites it, and no estimator watches
        found, why = (None, "") if alone else _identify(fresh / RECORD)
        said = {"identification": found.to_json() if found is not None else None, "not_identified": why}
        about = {"experiment": printable(Path(asked.name).stem), "command": command}
        summary = with_author({**about, **summarise(record), **said})
        write_json(fresh / "summary.json", summary)
        undrawn = ""
        try:
            if len(record):
                _draw(record, fresh, summary, found, asked.source, drawn)
        except (MemoryError, OSError) as error:  # what was simulated is worth more than its pictures
            why = getattr(error, "strerror", None) or str(error) or type(error).__name__
            undrawn = f"not enough memory or disk space to draw it ({printable(why)})"
    return _Ran(asked.experiment.title, summary, found, undrawn, record)


def _draw(
    record: Record,
    folder: Path,
    summary: dict[str, Any],
    found: Identification | None,
    source: str,
    drawn: common.FigureOptions,
) -> None:
    """Figures, page and film of a run."""
    if "loop" in record.meta:
        from palpate.report.run.figures import write_one_direction

        write_one_direction(record, folder, summary, source, drawn.endings, drawn.dpi)
        return
    from palpate.report.identification.words import sha256_of
    from palpate.report.run.figures import draw
    from palpate.report.run.page import film, run_page

    draw(record, folder, drawn.endings, drawn.dpi)
    page = run_page(record, summary, found, source, sha256_of(folder / RECORD))
    write_text(folder / "report.html", page)
    if len(record) > 1:
        write_text(folder / "film.svg", film(record))


def _identify(record: Path) -> tuple[Identification | None, str]:
    """The identification of the record by `palpate identify`, or the reason for its absence."""
    from palpate.cli.identify import OneLog
    from palpate.cli.options.log import ModelOptions

    try:
        return OneLog(ModelOptions()).identification(record)[0], ""
    except InputError as error:
        return None, printable(str(error).replace(str(record), record.name))


def _record(screen: Console, asked: _RunRequest, interrupted: Callable[[], bool]) -> Record:
    from palpate.bench.from_experiment import build_any, check_parts

    experiment = asked.experiment
    try:
        bench = build_any(experiment)
        check_parts(bench, lambda: screen.print(COMPILING))
    except InputError as error:
        raise InputError(f"{asked.name}: {error}") from error
    waiting = partial(screen.print, COMPILING)
    with simulation_progress(screen, interrupted) as show:
        return bench.run(
            experiment.run.duration, asked.seed, press=experiment.run.press, progress=show, waiting=waiting
        )


def _show(ran: _Ran, folder: Path, as_json: bool) -> None:
    from palpate.report.run.figures import one_direction_tables
    from palpate.report.run.table import answer_of, tables

    summary, record = ran.summary, ran.record
    shown = one_direction_tables(record, summary) if "loop" in record.meta else tables(summary, ran.found)
    report = folder / "report.html"
    written = ("report:", report) if report.exists() else ("nothing to draw; the record is in", folder)
    print_result(answer_of(ran.title, summary, shown), json=as_json, files=[written])
