"""`palpate study`: many runs of the bench, one table and a page."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.cli.options.common import (
    QUIET,
    FigureOptions,
    FolderOptions,
    KnownOptions,
    PluginOptions,
    print_names,
    read_source,
    shipped_names,
)
from palpate.cli.options.values import options
from palpate.cli.toolkit import (
    COMPILING,
    console,
    guard_picture,
    print_result,
    progress_of_pieces,
    say,
)
from palpate.errors import InputError
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.studies.run_study import StudyRunner
    from palpate.studies.summary import Findings

    Study = str
else:
    Study = shipped_names("shipped", package=Path(__file__).parent)


@options("A cluster", 1)
class ClusterOptions:
    """A cluster for the runs, in place of this machine's cores."""

    scheduler: str | None = None
    """Address of a Dask scheduler whose workers do the runs, tcp://HOST:PORT or tls://HOST:PORT. Their answers
    can execute code here: name only a cluster that you trust as this machine. The certificates of tls:// are
    those of Dask's configuration."""

    @contextmanager
    def runner(self, waiting: Callable[[], None]) -> Iterator[StudyRunner]:
        """The cluster, or the cores of this machine; `waiting` is called when a loop has to be compiled first."""
        if self.scheduler is None:
            from palpate.studies.run_one import Local

            yield Local(waiting=waiting)
            return
        from palpate.studies.cluster import Cluster

        cluster = Cluster(self.scheduler)
        try:
            yield cluster
        finally:
            cluster.close()


def study(
    name: Annotated[Study | None, QUIET] = None,
    /,
    *,
    where: ClusterOptions | None = None,
    known: KnownOptions | None = None,
    plugins: PluginOptions | None = None,
    output: FolderOptions | None = None,
    figure_options: FigureOptions | None = None,
) -> int:
    """Run an experiment many times: grids, random points; resumable.

    palpate study learning-rate --out runs/learning-rate

    The folder holds results.parquet, report.html and the journal of runs; the default is runs/study-NAME. An
    unfinished study there is resumed.

    Parameters
    ----------
    name
        A study (see --list), or a TOML file of your own (see --print).
    """
    known, output, figure_options = (
        known or KnownOptions(),
        output or FolderOptions(),
        figure_options or FigureOptions(),
    )
    figure_options.check()
    from palpate.studies import study as studies

    if known.list_:
        print_names(studies.FILES, lambda study_name: studies.load(study_name).title)
        return 0
    source = read_source(studies.FILES, name, "study", known.print_)
    if name is None or source is None:
        return 0
    folder = output.out if output.out is not None else Path("runs") / f"study-{Path(name).stem}"
    plugins = plugins or PluginOptions()
    command = printable(f"palpate study {shlex.quote(name)}{plugins.words}")
    try:
        with plugins.consent():
            findings = _run(
                name, source, folder, output.replace, where or ClusterOptions(), figure_options, command
            )
    except KeyboardInterrupt:
        say(f"interrupted; the finished runs are saved in {folder}; the same command resumes")
        return 130
    _show(findings, folder, output.json)
    return 0 if findings.summary["results"].get("done") else 1


def _run(
    name: str,
    source: str,
    folder: Path,
    replace: bool,
    where: ClusterOptions,
    figure_options: FigureOptions,
    command: str,
) -> Findings:
    """Do the missing runs, and write table, page and summary."""
    from palpate.studies.plan import plan_runs
    from palpate.studies.run_study import Work, check_folder, check_parts_of
    from palpate.studies.study import parse
    from palpate.studies.summary import PAGE, present

    screen = console(stderr=True)
    waiting = partial(screen.print, COMPILING)
    try:
        planned = plan_runs(parse(source, name), name)
        check_folder(folder, planned, replace=replace)
        check_parts_of(planned, waiting)
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix(f'{name}: ')}") from error
    with where.runner(waiting) as runner, progress_of_pieces(screen) as show:
        work = Work(planned, source, folder, runner, lambda done: show("runs", done, len(planned)))
        frame = work.run(replace=replace)
    guard = guard_picture(folder / PAGE)
    return present(frame, planned, folder, source, command, figure_options.endings, figure_options.dpi, guard)


def _show(findings: Findings, folder: Path, as_json: bool) -> None:
    from palpate.report.page import Answer

    summary = findings.summary
    answer = Answer(
        summary,
        summary["study"],
        context=f", {summary['runs']} runs\n",
        sentence="\n".join(summary["answer"]),
        tables=[findings.tables[0], findings.tables[-1]],
        notes=findings.notes,
    )
    print_result(answer, json=as_json, files=[("report:", folder / "report.html")])
