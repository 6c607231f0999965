"""A log, identified with the options of the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.cli._program import command, print_result
from palpate.cli._streams import INTERRUPTED
from palpate.cli._terminal import bar, console, places, say
from palpate.cli.options.arm import ArmOptions, FrameOptions
from palpate.cli.options.force import IndenterOptions
from palpate.cli.options.log import LogOptions
from palpate.errors import InputError, PalpateError
from palpate.files import read_bytes, write_text

if TYPE_CHECKING:
    from palpate.arrays import Array
    from palpate.from_log import LogIdentifier
    from palpate.identification import Identification
    from palpate.identification.pooling import Pooled
    from palpate.records import Record
    from palpate.report.identification.words import Source
    from palpate.report.many.table import LogRow

_LOG, _FRAME, _ARM, _INDENTER = LogOptions(), FrameOptions(), ArmOptions(), IndenterOptions()


class Fitted(Protocol):
    """Options of the identification itself."""

    @property
    def tolerance(self) -> float:
        """Largest half-width of an identified parameter, as a share of its value."""
        ...

    def keywords(self) -> dict[str, Any]:
        """The keywords of `palpate.identify`."""
        ...


def has_number(found: Identification) -> bool:
    """Whether a number is identified, at the working point or a parameter, and no unit or column is doubtful."""
    from palpate.report.identification.words import unit_warnings

    point = [found.working_point.stiffness] if found.working_point else []
    return not unit_warnings(found) and any(p.value is not None for p in (*point, *found.parameters.values()))


@dataclass(frozen=True)
class OneLog:
    """Options that are common to all logs."""

    fitted: Fitted
    source: LogOptions = _LOG
    frame: FrameOptions = _FRAME
    arm: ArmOptions = _ARM
    pressed_by: IndenterOptions = _INDENTER

    def identification(self, log: Path) -> tuple[Identification, Source]:
        """Read and identify a log; the result names its file.

        Raises:
            InputError: the log or an option is wrong, in one line.
        """
        found, _, source = self.identification_along(log)
        return found, source

    def identification_along(self, log: Path) -> tuple[Identification, Record, Source]:
        """The same, with the force and the position along the normal."""
        from palpate.contact_frame import describe
        from palpate.report.identification.words import Source, sha256_of

        found, along = self.identifier.identify(log)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        notes = tuple(describe(along.meta))
        return found, along, Source(str(log), self.options, sha256_of(log), command(), made=now, notes=notes)

    @property
    def identifier(self) -> LogIdentifier:
        """The options, as the library takes them."""
        from palpate.contact_frame import ContactFrame
        from palpate.from_log import LogIdentifier

        return LogIdentifier(
            self.source, self.frame.frame() or ContactFrame(), self.arm.arm(), self.arm.weighed_tool(),
            self.arm.robot_stiffness_from, self.pressed_by.shape(), self.pressed_by.ratio, self.fitted.keywords(),
        )  # fmt: skip

    @property
    def parts(self) -> tuple[object, ...]:
        """The groups of options, which a cell's file keeps."""
        return self.source, self.frame, self.arm, self.fitted, self.pressed_by

    @property
    def options(self) -> dict[str, Any]:
        """The options of logs, frame, arm and indenter, as plain values."""
        return {
            own.name: _plain(value)
            for part in (self.source, self.frame, self.arm, self.pressed_by)
            for own in fields(part)
            if (value := getattr(part, own.name)) != own.default
        }


def _plain(value: Any) -> Any:
    if isinstance(value, Path | str):
        return str(value)
    return list(value) if isinstance(value, tuple) else value


def many(
    logs: Sequence[Path],
    asked: OneLog,
    covariates: Mapping[str, Array],
    files: tuple[Path | None, Path | None, Path | None],
    *,
    json: bool,
    dpi: int | None = None,
) -> int:
    """Identify many logs, and print a row for each and the pooled result.

    A log that fails is a row with the reason, and the others continue. An interruption keeps the finished
    logs, which are pooled without covariates.

    Args:
        logs: paths of them.
        asked: options that are common to all.
        covariates: one number of each log, by name.
        files: paths of figure, page and table, None for those not wanted.
        json: whether the result is printed as JSON.
        dpi: of the figure.

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
    found, names = [row.found for row in rows], [row.source.title for row in rows]
    pooled = pool(found, asked.fitted.tolerance, names, None if interrupted else covariates)
    if rows:
        from palpate.report.many.table import answer_of

        print_result(answer_of(rows, pooled, places(_write(rows, pooled, files, dpi))), json=json)
    if interrupted:
        say(f"interrupted: {len(rows)} of {len(logs)} logs were identified")
        return INTERRUPTED
    doubtful = any(row.found and unit_warnings(row.found) for row in rows)
    has_any = pooled.found or any(row.found and has_number(row.found) for row in rows)
    return 0 if has_any and not doubtful else 1


def _row(log: Path, asked: OneLog) -> LogRow:
    from palpate.report.identification.words import Source
    from palpate.report.many.table import LogRow

    try:
        found, source = asked.identification(log)
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
    files: tuple[Path | None, Path | None, Path | None],
    dpi: int | None,
) -> list[Path]:
    figure, page, table = files
    if figure is not None:
        from palpate.report.many.page import write_figure

        write_figure(rows, pooled, figure, dpi)
    if page is not None:
        from palpate.report.many.page import page_of_logs as page_of

        write_text(page, page_of(rows, pooled))
    if table is not None:
        from palpate.report.many.table import write_table

        write_table(rows, pooled, table)
    return [path for path in files if path is not None]


_LARGEST = 1 << 26
"""Largest size in bytes: the output for a thousand contacts is a hundredth of it."""

_DIGITS = 18
"""Digits of a whole number that surely fits into 64 bits: 10^18 < 2^63 < 10^19. A longer one is read as a float."""


def read_found(path: Path) -> dict[str, Any]:
    """The object in a file.

    Raises:
        InputError: it is too large, no JSON, or no object.
        OSError: no such file.
    """
    from json import loads

    try:
        value = loads(read_bytes(path, _LARGEST, "the output of palpate identify"), parse_int=_whole)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}; give the output of palpate identify --json") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: not the output of palpate identify --json")
    return value


def _whole(text: str) -> int | float:
    """A whole number; one of more than 64 bits is what it is to most programs, a double, and infinite at last."""
    return int(text) if len(text) <= _DIGITS else float(text)
