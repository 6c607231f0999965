"""Many logs identified one after the other, and pooled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.cli._answer import print_answer
from palpate.cli._edge import INTERRUPTED
from palpate.cli._one_log import OneLog, answered
from palpate.cli._program import command
from palpate.cli._progress import bar
from palpate.cli._terminal import KINDS, STYLE, console, place, say
from palpate.errors import InputError, PalpateError
from palpate.files import write_text

if TYPE_CHECKING:
    from palpate.identification import Identification
    from palpate.identification.pooling import Pooled
    from palpate.report.many.rows import LogRow


def many(
    logs: Sequence[Path],
    asked: OneLog,
    figure: Path | None,
    page: Path | None,
    table: Path | None,
    *,
    json: bool,
    dpi: int | None = None,
) -> int:
    """Identify many logs, and print a row for each and the pooled result.

    A log that fails is a row with the reason, and the others continue. An interruption keeps the finished logs.

    Returns:
        0 if a number is identified; 1 if none is; 130 if it was interrupted.

    Raises:
        InputError: no log could be read; nothing is printed or written then.
    """
    from rich.progress import MofNCompleteColumn

    from palpate.identification.pooling import pool
    from palpate.report.identification.words import unit_warnings

    rows: list[LogRow] = []
    interrupted = False
    try:
        with bar(console(stderr=True), MofNCompleteColumn()) as progress:
            for log in progress.track(logs, description=""):
                progress.update(progress.task_ids[0], description=log.name)
                rows.append(_row(log, asked))
    except KeyboardInterrupt:
        interrupted = True
    failed = [row for row in rows if row.found is None]
    if not interrupted and len(failed) == len(rows):
        one = len(rows) == 1
        raise InputError(
            failed[0].error if one else f"none of {len(rows)} logs can be identified: {failed[0].error}"
        )
    pooled = pool([row.found for row in rows], asked.fitted.tolerance, [row.source.title for row in rows])
    if rows:
        _print(rows, pooled, _write(rows, pooled, figure, page, table, dpi), json=json)
    if interrupted:
        say(f"interrupted: {len(rows)} of {len(logs)} logs were identified")
        return INTERRUPTED
    doubtful = any(row.found and unit_warnings(row.found) for row in rows)
    known = pooled.found or any(row.found and answered(row.found) for row in rows)
    return 0 if known and not doubtful else 1


def _row(log: Path, asked: OneLog) -> LogRow:
    from palpate.report.identification.source import Source
    from palpate.report.many.rows import LogRow

    try:
        found, source = asked.identified(log)
    except (PalpateError, OSError, MemoryError) as error:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        source = Source(str(log), asked.options, command=command(), made=now)
        return LogRow(source, None, " ".join((str(error) or type(error).__name__).split()))
    return LogRow(source, _light(found))


def _light(found: Identification) -> Identification:
    """Without the samples, which a row does not need: a thousand logs fit into memory."""
    import numpy as np

    traces, none = found.traces, np.empty(0)
    if traces is not None:
        traces = replace(
            traces, time=none, force=none, fitted_time=none, fitted_position=none, fitted_force=none, predicted=none,
            columns={},
        )  # fmt: skip
    return replace(found, traces=traces, estimate=None)


def _write(
    rows: Sequence[LogRow],
    pooled: Pooled,
    figure: Path | None,
    page: Path | None,
    table: Path | None,
    dpi: int | None,
) -> list[Path]:
    if figure is not None:
        from palpate.report.many.forest import write_figure

        write_figure(rows, pooled, figure, dpi)
    if page is not None:
        from palpate.report.many.page import page as page_of

        write_text(page, page_of(rows, pooled))
    if table is not None:
        from palpate.report.many.paper_table import write_table

        write_table(rows, pooled, table)
    return [path for path in (figure, page, table) if path is not None]


def _print(rows: Sequence[LogRow], pooled: Pooled, written: Sequence[Path], *, json: bool) -> None:
    if json:
        from palpate.report.many.rows import json_of

        print_answer(
            {
                "files": [{"file": r.source.file, "sha256": r.source.sha256} for r in rows],
                **json_of(rows, pooled),
            }
        )
        return
    from palpate.report.identification.words import unit_warnings
    from palpate.report.many.table import show

    screen = console()
    for row in rows:
        for text in unit_warnings(row.found) if row.found else ():
            screen.print(f"! {row.source.title}: {text}", style=STYLE, soft_wrap=True)
    show(rows, pooled, screen)
    for path in written:
        place(screen, f"{KINDS.get(path.suffix.lower(), 'figure')}:", path)
