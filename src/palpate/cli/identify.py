"""`palpate identify`: K, B and M of the touched surface, from one log or from many."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from palpate.arrays import Array
from palpate.cli._program import OutputFile, command, print_result
from palpate.cli._streams import INTERRUPTED
from palpate.cli._terminal import bar, console, kind_of, say
from palpate.cli.options.common import WRITTEN, CellOptions, FigureFile, ReportOption
from palpate.cli.options.log import ArmOptions, FrameOptions, IndenterOptions, LogOptions, ModelOptions
from palpate.cli.options.values import FLAG, changed_fields, only, options, plain_value
from palpate.errors import InputError, PalpateError
from palpate.files import check_place, write_text
from palpate.logs import formats

if TYPE_CHECKING:
    from palpate.from_log import LogIdentifier
    from palpate.identification import Identification
    from palpate.identification.pooling import Pooled
    from palpate.report.identification.words import Source
    from palpate.report.many.table import LogRow


_LOG, _FRAME, _ARM, _INDENTER = LogOptions(), FrameOptions(), ArmOptions(), IndenterOptions()


@dataclass(frozen=True)
class OneLog:
    """Options that are common to all logs."""

    fitted: ModelOptions
    source: LogOptions = _LOG
    frame: FrameOptions = _FRAME
    arm: ArmOptions = _ARM
    pressed_by: IndenterOptions = _INDENTER

    def identification(self, log: Path) -> tuple[Identification, Source]:
        """Read and identify a log; the result names its file.

        Raises:
            InputError: the log or an option is wrong, in one line.
        """
        from palpate.contact_frame.arm import describe
        from palpate.report.identification.words import file_digest

        result, along = replace(self.identifier, guess=True).identify(log)
        known = {"notes": tuple(describe(along.meta)), "guessed": along.meta.get("guessed")}
        return result, self.log_source(log, sha256=file_digest(log), **known)

    def log_source(self, log: Path, **known: Any) -> Source:
        """Source of an identification: a log, these options, this command, now."""
        from palpate.report.identification.words import Source

        now = datetime.now(UTC).isoformat(timespec="seconds")
        return Source(str(log), self.options, command=command(), made=now, **known)

    @property
    def identifier(self) -> LogIdentifier:
        """The options, as the library takes them."""
        from palpate.contact_frame.signals_in_base import ContactFrame
        from palpate.from_log import LogIdentifier

        return LogIdentifier(
            self.source,
            self.frame.frame() or ContactFrame(),
            self.arm.arm(),
            self.arm.weighed_tool(),
            self.arm.robot_stiffness_from,
            self.pressed_by.shape(),
            self.pressed_by.ratio,
            self.fitted.keywords(),
        )

    @property
    def parts(self) -> tuple[object, ...]:
        """The groups of options, which a cell's file keeps."""
        return self.source, self.frame, self.arm, self.fitted, self.pressed_by

    @property
    def options(self) -> dict[str, Any]:
        """The options of logs, frame, arm and indenter, as plain values."""
        parts = (self.source, self.frame, self.arm, self.pressed_by)
        return {name: plain_value(value) for part in parts for name, value in changed_fields(part).items()}


@dataclass(frozen=True)
class _OutputFiles:
    """Paths of the files of an identification, None for those not asked for, and the figure's dots per inch."""

    figure: Path | None
    page: Path | None
    table: Path | None
    dpi: int | None

    def log_files(self, result: Identification, source: Source) -> list[OutputFile]:
        """The files of one log, to be written."""

        def write_figure(path: Path) -> None:
            from palpate.report.identification.page import write_figure

            write_figure(result, path, title=Path(source.file).name, dpi=self.dpi)

        def write_page(path: Path) -> None:
            from palpate.report.identification.page import page

            write_text(path, page(result, source))

        def write_table(path: Path) -> None:
            from palpate.report.many.table import LogRow, write_table

            write_table([LogRow(source, result)], None, path)

        return self._with_writers(
            write_figure if result.traces is not None else None, write_page, write_table
        )

    def pooled_files(self, rows: Sequence[LogRow], pooled: Pooled) -> list[OutputFile]:
        """The files of many logs, to be written."""

        def write_figure(path: Path) -> None:
            from palpate.report.many.page import write_figure

            write_figure(rows, pooled, path, self.dpi)

        def write_page(path: Path) -> None:
            from palpate.report.many.page import page_of_logs

            write_text(path, page_of_logs(rows, pooled))

        def write_table(path: Path) -> None:
            from palpate.report.many.table import write_table

            write_table(rows, pooled, path)

        return self._with_writers(write_figure, write_page, write_table)

    def _with_writers(self, *writers: Callable[[Path], None] | None) -> list[OutputFile]:
        """The files that are asked for and can be written, each with what writes it."""
        pairs = zip((self.figure, self.page, self.table), writers, strict=True)
        return [
            OutputFile(f"{kind_of(path)}:", path, partial(write, path))
            for path, write in pairs
            if path is not None and write is not None
        ]


def many(
    logs: Sequence[Path],
    log_options: OneLog,
    covariates: Mapping[str, Array],
    files: _OutputFiles,
    *,
    json: bool,
) -> int:
    """Identify many logs, and print a row for each and the pooled result.

    A log that fails is a row with the reason, and the others continue. An interruption keeps the finished
    logs, which are pooled without covariates.

    Args:
        logs: paths of them.
        log_options: options that are common to all.
        covariates: one number of each log, by name.
        files: to be written.
        json: whether the result is printed as JSON.

    Returns:
        0 if something is identified, in a log or in all together, and no unit or column is doubtful or guessed; 1 if
        not; 130 if it was interrupted.

    Raises:
        InputError: no log could be read; nothing is printed or written then.
    """
    from palpate.identification.pooling import pool
    from palpate.report.identification.words import unit_warnings

    rows = _rows(logs, log_options)
    interrupted = len(rows) < len(logs)
    failed = [row for row in rows if row.result is None]
    if not interrupted and len(failed) == len(rows):
        one = len(rows) == 1
        raise InputError(
            failed[0].error if one else f"none of {len(rows)} logs can be identified: {failed[0].error}"
        )
    results, names = [row.result for row in rows], [row.source.title for row in rows]
    pooled = pool(results, log_options.fitted.tolerance, names, None if interrupted else covariates)
    if rows:
        from palpate.report.many.table import build_answer

        print_result(build_answer(rows, pooled), json=json, files=files.pooled_files(rows, pooled))
    if interrupted:
        say(f"interrupted: {len(rows)} of {len(logs)} logs were identified")
        return INTERRUPTED
    doubtful = any(row.result and unit_warnings(row.result) for row in rows)
    identified = pooled.identified or any(row.result and row.result.identified for row in rows)
    return 0 if identified and not doubtful else 1


def _rows(logs: Sequence[Path], log_options: OneLog) -> list[LogRow]:
    """A row of each log, up to an interruption."""
    from rich.progress import MofNCompleteColumn

    rows: list[LogRow] = []
    with suppress(KeyboardInterrupt), bar(console(stderr=True), MofNCompleteColumn()) as progress:
        for log in progress.track(logs, description=""):
            progress.update(progress.task_ids[0], description=log.name)
            rows.append(_row(log, log_options))
    return rows


def _row(log: Path, log_options: OneLog) -> LogRow:
    from palpate.report.many.table import LogRow

    try:
        result, source = log_options.identification(log)
    except (PalpateError, OSError, MemoryError) as error:
        return LogRow(
            log_options.log_source(log), None, " ".join((str(error) or type(error).__name__).split())
        )
    return LogRow(source, _light(result))


def _light(result: Identification) -> Identification:
    """The identification without its samples: a thousand logs fit into memory."""
    traces, none = result.traces, np.empty(0)
    if traces is not None:
        traces = replace(
            traces,
            time=none,
            force=none,
            fitted_time=none,
            fitted_position=none,
            fitted_force=none,
            predicted=none,
            columns={},
        )
    return replace(result, traces=traces)


@options(WRITTEN)
class IdentifyOutput(ReportOption, FigureFile):
    """Files of an identification, and how much is printed."""

    figure: Path | None = None
    "Where to write the figure, a PNG, SVG or PDF by its ending."
    dpi: int | None = None
    "Resolution of a PNG; 110 if not given."
    table: Path | None = None
    """Where to write a table for a paper, a CSV file: value and 95 % interval of each log; for several logs also
    their number, mean, next press and standard deviation."""
    verbose: Annotated[bool, FLAG] = False
    "Print all evidence: each reason, each warning, the slopes of the press."
    budget: Annotated[bool, FLAG] = False
    """Print the uncertainty budget of each number, too: sources, sensitivities, degrees of freedom, coverage
    factor."""

    def paper_table(self) -> Path | None:
        """Path of the table, checked before any work is done."""
        if self.table is not None:
            check_place(self.table, "--table", ending=".csv")
        return self.table

    def drawing(self) -> Path | None:
        """Path of the figure, checked before any work is done."""
        from palpate.report.style import FORMATS, check_dpi

        check_dpi(self.dpi)
        return self.picture(FORMATS)

    def files(self) -> _OutputFiles:
        """Files of the log, or the logs; checked before any work is done."""
        return _OutputFiles(self.drawing(), self.page(), self.paper_table(), self.dpi)


@options("Several logs", 5)
class CovariateOptions:
    """Conditions that several logs differ in, such as a temperature."""

    covariate: Annotated[tuple[str, ...], Parameter(negative=())] = ()
    """A column of each log, such as temperature_C: print how the results depend on its mean in each log. May be
    repeated."""

    def of(self, logs: Sequence[Path], source: LogOptions) -> dict[str, Array]:
        """The mean of each covariate in each log, by the covariate's name."""
        return formats.read_covariates(logs, self.covariate, source.missing, source.delimiter)


@options("Friction of an axis", 6)
class FrictionOptions:
    """Friction of a joint or an axis in place of a surface."""

    friction: Annotated[bool, FLAG] = False
    """Identify the friction of a joint or an axis that moves freely: Coulomb, viscous, offset, Stribeck. The log has
    its force or torque, and its position or speed."""
    velocity: str | None = None
    "With --friction: column of the speed, in m/s if no unit is given, as qd:rad/s; made from --position if not given."


# More than seven arguments: one for each group of options.
def identify(
    *logs: Path,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
    pressed_by: IndenterOptions | None = None,
    beside: CovariateOptions | None = None,
    axis: FrictionOptions | None = None,
    output: IdentifyOutput | None = None,
    cell: CellOptions | None = None,
) -> int:
    """Identify the touched surface from a log: stiffness, damping, mass.

    A log with clear names and units needs no options; the output says which signals were read:

    palpate identify press.csv

    Columns are given as NAME or NAME:UNIT, where NAME may be a number from 0:

    palpate identify press.csv --time t --position x:mm --force-column f:mN

    A bag with one wrench and one pose needs no names; palpate topics LOG lists the signals of a log:

    palpate identify press.mcap --wrench-frame tool --tcp 0,0,120:mm

    Several logs, or a folder of them, are pooled: one table, the mean, and an interval for the next press:

    palpate identify presses/ --table presses.csv

    palpate identify presses/ --covariate temperature_C

    The friction of a joint or an axis, from a log in which it moves freely in both directions and at several speeds:

    palpate identify joint.csv --friction --time t --velocity qd:rad/s --force-column tau:Nm

    Options of a cell can be saved and loaded again:

    palpate identify press.csv --preset ur-rtde --tcp 0,0,120:mm --save-options my-cell.toml

    palpate identify other.csv --options my-cell.toml

    Parameters
    ----------
    logs
        Text in columns, JSON, Parquet, a spreadsheet, MATLAB, HDF5, npz, TDMS, an AFM curve, a ROS 1 bag, a ROS 2
        bag or MCAP; the folder of a run or a press, or its record.parquet; a folder of logs. Equal sheets of a book
        are logs of their own.
    """
    output, cell = output or IdentifyOutput(), cell or CellOptions()
    log_options = OneLog(
        fitted or ModelOptions(),
        source or LogOptions(),
        frame or FrameOptions(),
        arm or ArmOptions(),
        pressed_by or IndenterOptions(),
    )
    log_options.pressed_by.check()
    cell.check()
    cell.save(log_options.parts)
    axis = axis or FrictionOptions()
    if axis.friction:
        return _friction(logs, log_options, beside or CovariateOptions(), axis, output)
    only(axis, "the friction of an axis; add --friction")
    return _identify(logs, log_options, beside or CovariateOptions(), output)


def _friction(
    logs: tuple[Path, ...],
    log_options: OneLog,
    beside: CovariateOptions,
    axis: FrictionOptions,
    output: IdentifyOutput,
) -> int:
    """Identify the friction of an axis from one log."""
    if len(logs) != 1:
        raise InputError(f"--friction takes one log, got {len(logs)}")
    fitted, press = log_options.fitted, "a press; leave out --friction"
    for part in (
        replace(fitted, tolerance=0.25, lag=None),
        log_options.frame,
        log_options.arm,
        log_options.pressed_by,
    ):
        only(part, press)
    only(replace(IdentifyOutput(), table=output.table, budget=output.budget, verbose=output.verbose), press)
    only(beside, press)
    log, source = logs[0], log_options.source
    figure, report = output.drawing(), output.page()
    from palpate.contact_frame.axis_friction import identify_friction
    from palpate.report import friction as view
    from palpate.report.style import save

    lag = fitted.keywords().get("lag", 0.0)
    result = identify_friction(source.read_axis(log, axis.velocity), fitted.tolerance, lag)
    files = []
    if figure is not None and len(result.points):
        files.append(OutputFile("figure:", figure, lambda: save(view.draw(result), figure, dpi=output.dpi)))
    if report is not None:
        text = view.page(result, log.name, command())
        files.append(OutputFile("report:", report, lambda: write_text(report, text)))
    print_result(view.build_answer(result, log.name), json=output.json, files=files)
    return 0 if result.identified else 1


def _identify(
    logs: tuple[Path, ...], log_options: OneLog, beside: CovariateOptions, output: IdentifyOutput
) -> int:
    """Identify one log, or many together."""
    if not logs:
        raise InputError(
            "no log is named; name a log, several, or a folder of them (see: palpate identify --help)"
        )
    logs = formats.sheets_as_logs(logs, log_options.source.names, log_options.source.limits)
    if len(logs) == 1 and not formats.is_folder_of_logs(logs[0]):
        if beside != CovariateOptions():
            raise InputError("--covariate needs several logs; name more than one, or a folder of them")
        return _one(formats.log_of(logs[0]), log_options, output)
    if output.budget:
        raise InputError("--budget prints the budget of one log; --json has those of many")
    files, logs = output.files(), formats.gather_logs(logs)
    return many(logs, log_options, beside.of(logs, log_options.source), files, json=output.json)


def _one(log: Path, log_options: OneLog, output: IdentifyOutput) -> int:
    files = output.files()
    result, origin = log_options.identification(log)
    from palpate.report.identification.answer import build_answer
    from palpate.report.identification.words import unit_warnings

    evidence_options = "--verbose" if output.report else "--verbose; with pictures: --report PAGE.html"
    if not result.identified and log_options.source.position is not None:
        evidence_options += "; if it is an axis that moves freely: --friction"
    answer = build_answer(result, origin, evidence_options, verbose=output.verbose, budget=output.budget)
    print_result(answer, json=output.json, files=files.log_files(result, origin))
    return 0 if result.identified and not unit_warnings(result) else 1
