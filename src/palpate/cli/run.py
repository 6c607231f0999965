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
from palpate.cli._terminal import COMPILING, console, guard_picture, simulation_progress
from palpate.cli.options import common
from palpate.cli.options.values import WHOLE
from palpate.errors import InputError
from palpate.files import RECORD, fresh_folder, with_author, write_json
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
    plugins: common.PluginOptions | None = None,
    output: common.FolderOptions | None = None,
    figure_options: common.FigureOptions | None = None,
) -> int:
    """Run an experiment: the arm approaches, touches, presses.

    palpate run foam-hybrid --seed 1 --out runs/foam

    The folder holds record.parquet, summary.json and report.html, which shows the charts; the default is
    runs/NAME-SEED.

    Parameters
    ----------
    name
        An experiment (see --list), or a TOML file of your own (see --print).
    seed
        Seed of the noise; the same seed gives the same numbers.
    """
    known, output, figure_options = (
        known or common.KnownOptions(),
        output or common.FolderOptions(),
        figure_options or common.FigureOptions(),
    )
    from palpate.bench.tables import FILES, load, parse

    if known.list_:
        common.print_names(FILES, lambda experiment_name: load(experiment_name).title)
        return 0
    source = common.read_source(FILES, name, "run", known.print_)
    if name is None or source is None:
        return 0
    folder = output.out if output.out is not None else Path("runs") / f"{Path(name).stem}-{seed}"
    from palpate.bench.summary import DONE, INTERRUPTED

    figure_options.check()
    plugins = plugins or common.PluginOptions()
    with plugins.consent():
        experiment = parse(source, name)  # before a Ctrl-C is only noted, which a question would wait for
        with notice_signals() as interrupted:
            request = _RunRequest(name, source, experiment, seed, plugins.words)
            ran = _run(request, folder, output, figure_options, interrupted)
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
    identification: Identification | None
    undrawn: str
    record: Record


@dataclass(frozen=True)
class _RunRequest:
    """The experiment to run: its name or file, the text of that, and its numbers; the seed of the noise; --plugins."""

    name: str
    source: str
    experiment: Any
    seed: int
    plugins: str


def _run(
    request: _RunRequest,
    folder: Path,
    output: common.FolderOptions,
    figure_options: common.FigureOptions,
    interrupted: Callable[[], bool],
) -> _Ran:
    """Run an experiment, and write the folder of results."""
    from palpate.bench.summary import summarise
    from palpate.logs.tables.parquet import write_record
    from palpate.report.run.figures import write_report

    with fresh_folder(folder, replace=output.replace) as fresh:
        typed = f"palpate run {shlex.quote(request.name)} --seed {request.seed}{request.plugins}"
        command = printable(typed)
        record = _record(console(stderr=output.json), request, interrupted)
        record = replace(record, meta={**record.meta, "command": command})
        write_record(record, fresh / RECORD)
        identification, reason = _identify(fresh / RECORD)
        outcome = {
            "identification": identification.to_json() if identification is not None else None,
            "not_identified": reason,
        }
        about = {"experiment": printable(Path(request.name).stem), "command": command}
        summary = with_author({**about, **summarise(record), **outcome})
        write_json(fresh / "summary.json", summary)
        undrawn = ""
        try:
            if len(record):
                with guard_picture("report.html"):
                    write_report(
                        record,
                        summary,
                        identification,
                        request.source,
                        fresh,
                        figure_options.endings,
                        figure_options.dpi,
                    )
        except (MemoryError, OSError) as error:  # what was simulated is worth more than its pictures
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            undrawn = f"not enough memory or disk space to draw it ({printable(reason)})"
    return _Ran(request.experiment.title, summary, identification, undrawn, record)


def _identify(record: Path) -> tuple[Identification | None, str]:
    """The identification of the record by `palpate identify`, or the reason for its absence."""
    from palpate.cli.identify import OneLog
    from palpate.cli.options.log import ModelOptions

    try:
        return OneLog(ModelOptions()).identification(record)[0], ""
    except InputError as error:
        return None, printable(str(error).replace(str(record), record.name))


def _record(screen: Console, request: _RunRequest, interrupted: Callable[[], bool]) -> Record:
    from palpate.bench.from_experiment import build, check_parts

    experiment = request.experiment
    try:
        bench = build(experiment)
        check_parts(bench, lambda: screen.print(COMPILING))
    except InputError as error:
        raise InputError(f"{request.name}: {error}") from error
    waiting = partial(screen.print, COMPILING)
    with simulation_progress(screen, interrupted) as show:
        return bench.run(
            experiment.run.duration, request.seed, press=experiment.run.press, progress=show, waiting=waiting
        )


def _show(ran: _Ran, folder: Path, as_json: bool) -> None:
    from palpate.report.run.table import build_answer, tables

    summary, run_tables = ran.summary, tables(ran.summary, ran.identification)
    report = folder / "report.html"
    written = ("report:", report) if report.exists() else ("nothing to draw; the record is in", folder)
    print_result(build_answer(ran.title, summary, run_tables), json=as_json, files=[written])
