"""`palpate study`: many runs of the bench, one table and a page."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
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
    shipped_names,
    source_of,
)
from palpate.cli.options.values import FLAG, options
from palpate.cli.toolkit import (
    COMPILING,
    confirmed,
    console,
    print_result,
    progress_of_pieces,
    say,
)
from palpate.errors import InputError
from palpate.text import printable

if TYPE_CHECKING:
    from rich.console import Console

    from palpate_studies.cluster import Cluster
    from palpate_studies.plan import RunPlan
    from palpate_studies.run_study import StudyRunner
    from palpate_studies.summary import Findings

    Study = str
else:
    Study = shipped_names("shipped", package=Path(__file__).parent)

_SHOWN = 3
"""Tables that the terminal shows: the factors, the settings, the results of the runs. The page has all metrics."""


@options("A cluster", 1)
class ClusterOptions:
    """A cluster for the runs, in place of this machine's cores."""

    scheduler: str | None = None
    """Address of a Dask scheduler whose workers do the runs, tcp://HOST:PORT or tls://HOST:PORT. Their answers
    can execute code here: name only a cluster that you trust as this machine."""
    tls_ca: Path | None = None
    "Certificate of the authority that signed those of the cluster, a PEM file, for tls://."
    tls_cert: Path | None = None
    "Certificate of this machine, likewise."
    tls_key: Path | None = None
    "Its key, likewise."

    def cluster(self) -> Cluster | None:
        """The cluster; None if none is named."""
        from palpate_studies.cluster import Certificates, Cluster

        files = (self.tls_ca, self.tls_cert, self.tls_key)
        given = [path for path in files if path is not None]
        if 0 < len(given) < len(files):
            raise InputError("--tls-ca, --tls-cert and --tls-key go together")
        if self.scheduler is None:
            if given:
                raise InputError("--tls-ca, --tls-cert and --tls-key are for --scheduler tls://HOST:PORT")
            return None
        return Cluster(self.scheduler, certificates=Certificates(*given) if given else None)


def study(
    name: Annotated[Study | None, QUIET] = None,
    /,
    *,
    yes: Annotated[bool, FLAG] = False,
    where: ClusterOptions | None = None,
    known: KnownOptions | None = None,
    own: PluginOptions | None = None,
    output: FolderOptions | None = None,
    drawn: FigureOptions | None = None,
) -> int:
    """Run an experiment many times: grids, random points, a search; resumable.

    palpate study learning-rate --out runs/learning-rate

    The folder holds results.parquet, report.html and the journal of runs; the default is runs/study-NAME. An
    unfinished study there is resumed.

    Parameters
    ----------
    name
        A study (see --list), or a TOML file of your own (see --print).
    yes
        Do not try each case before hundreds of runs, and do not ask before a very long study.
    """
    known, output, drawn = known or KnownOptions(), output or FolderOptions(), drawn or FigureOptions()
    drawn.check()
    from palpate_studies import study as studies

    if known.list_:
        print_names(studies.FILES, lambda one: studies.load(one).title)
        return 0
    source = source_of(studies.FILES, name, "study", known.print_)
    if name is None or source is None:
        return 0
    folder = output.out if output.out is not None else Path("runs") / f"study-{Path(name).stem}"
    try:
        with (own or PluginOptions()).consent():
            found = _print_end(
                _StudyRequest(name, source, folder, yes, output.replace), where or ClusterOptions(), drawn
            )
    except KeyboardInterrupt:
        kept = f"the finished runs are saved in {folder}; the same command resumes"
        say(f"interrupted; {kept}")
        return 130
    _show(found, folder, output.json)
    return 0 if found.summary["results"].get("done") else 1


@dataclass(frozen=True)
class _StudyRequest:
    """A study's name, its text and its folder; whether to ask before a long one, and to replace what is there."""

    name: str
    source: str
    folder: Path
    yes: bool
    replace: bool


def _print_end(asked: _StudyRequest, where: ClusterOptions, drawn: FigureOptions) -> Findings:
    """Do the missing runs, and write table, page and summary."""
    from palpate_studies.plan import plan
    from palpate_studies.preview import check_cases, check_parts_of
    from palpate_studies.run_study import Work, begun, check_folder
    from palpate_studies.study import parse
    from palpate_studies.summary import present

    screen, name, folder = console(stderr=True), asked.name, asked.folder
    waiting = partial(screen.print, COMPILING)
    new = asked.replace or not begun(folder)
    try:
        planned = plan(parse(asked.source, name), name)
        check_folder(folder, planned, replace=asked.replace)
        check_parts_of(planned, waiting)
        if new and not asked.yes:
            check_cases(planned, waiting)
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix(f'{name}: ')}") from error
    if new and not asked.yes:
        _ask(planned, screen, here=where.scheduler is None)
    with _runner(where, screen) as runner, progress_of_pieces(screen) as show:
        work = Work(planned, asked.source, folder, runner, lambda done: show("runs", done, len(planned)))
        frame = work.run(replace=asked.replace)
    told = printable(f"palpate study {shlex.quote(name)}")
    return present(frame, planned, folder, asked.source, told, drawn.endings, drawn.dpi)


def _ask(plan: RunPlan, screen: Console, *, here: bool) -> None:
    """Ask for confirmation of a very long study; for a cluster only the number of runs is known."""
    from palpate_studies.preview import MANY, seconds_a_run, too_much

    if not here and len(plan) < MANY:
        return
    warning = too_much(plan, seconds_a_run(plan, lambda: screen.print(COMPILING)))
    if not warning:
        return
    if not sys.stdin.isatty():
        raise InputError(f"{warning}; make it smaller, or add --yes")
    if not confirmed(screen, f"{warning}. Begin?"):
        raise InputError("not started; make the study smaller: fewer points, fewer seeds")


@contextmanager
def _runner(where: ClusterOptions, screen: Console) -> Iterator[StudyRunner]:
    cluster = where.cluster()
    if cluster is None:
        from palpate_studies.run_one import Local

        yield Local(waiting=lambda: screen.print(COMPILING))
        return
    try:
        yield cluster
    finally:
        cluster.close()


def _show(found: Findings, folder: Path, as_json: bool) -> None:
    from palpate.report.page import CommandAnswer

    tables, summary = found.tables, found.summary
    few = [tables[0], *tables[1:2], tables[-1]] if len(tables) > _SHOWN else tables
    said = f", {summary['runs']} runs\n{chr(10).join(summary['answer'])}"
    answer = CommandAnswer(summary, summary["study"], said, few, found.notes)
    print_result(answer, json=as_json, files=[("report:", folder / "report.html")])
