"""`palpate identify`: K, B and M of the touched surface, from one log or from many."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from palpate.cli._program import print_result
from palpate.cli._terminal import places
from palpate.cli.one_log import OneLog, has_number
from palpate.cli.options.arm import ArmOptions, FrameOptions
from palpate.cli.options.common import QUIET, WRITTEN, Model, PictureOptions
from palpate.cli.options.force import IndenterOptions
from palpate.cli.options.kept import CellOptions
from palpate.cli.options.log import LogOptions
from palpate.cli.options.values import FLAG, SIGNED, lag_of, with_std
from palpate.errors import InputError
from palpate.files import check_place, write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palpate.arrays import Array


@Parameter(name="*", group=Group("The model", sort_key=4))
@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """The model, the lag, and the priors."""

    model: Annotated[Model | None, QUIET] = None
    """kelvin-voigt, kelvin-voigt-mass, standard-linear-solid, hunt-crossley or quasi-linear-viscoelastic;
    chosen if not given."""
    lag: Annotated[str | None, SIGNED] = None
    """Calibrated lag of the force behind the position, as 0.0076, 7.6:ms or 7.6:0.2:ms (with its standard
    deviation)."""
    force_filter: str | None = None
    "Low-pass of the force before sampling, as butterworth3:120 (order and Hz), joined by +; or none."
    mass: str | None = None
    "Prior of the mass, in kg, VALUE or VALUE:STD."
    tolerance: float = 0.25
    "Largest half-width of an identified parameter's 95 % interval, as a share of its value."
    calibration: float = 0.0
    "Relative standard deviation of the scales of force and position together, as 0.01."
    bonded: bool | None = None
    "Whether the probe is fixed to the surface; detected if not given."
    cutoff: float | None = None
    "Cut-off of the filters of all channels, in Hz; chosen if not given."

    def keywords(self) -> dict[str, Any]:
        """The keywords of `palpate.identify`."""
        known: dict[str, Any] = {}
        lag = lag_of(self.lag)
        if lag is not None:
            known |= {"lag": lag[0], "lag_std": lag[1]}
        if self.force_filter is not None:
            known["force_filter"] = None if self.force_filter == "none" else self.force_filter
        if self.mass is not None:
            known["mass"] = with_std("mass", self.mass, "0.5:0.02")
        names = ("model", "tolerance", "calibration", "bonded", "cutoff")
        return known | {name: getattr(self, name) for name in names}


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class IdentifyOutput(PictureOptions):
    """Files of an identification, and how much is printed."""

    figure: Path | None = None
    """Where to write the figure, a PNG, SVG or PDF by its ending; LOG.identify.png in the current folder if
    not given (of many logs, pooled.identify.png)."""
    dpi: int | None = None
    "Of a PNG; 110 if not given."
    table: Path | None = None
    """Where to write a table for a paper, as CSV, Markdown or LaTeX by its ending (.csv, .md, .tex): value and
    95 % of each log; of several, n, mean, next press and deviation, too."""
    verbose: Annotated[bool, FLAG] = False
    "Print all evidence: each reason, each warning, both intervals, the slopes of the press."
    budget: Annotated[bool, FLAG] = False
    """Print the uncertainty budget of each number, too: sources, sensitivities, degrees of freedom, coverage
    factor."""

    def paper_table(self) -> Path | None:
        """Path of the table, checked before any work is done."""
        from palpate.report.many.table import ENDINGS

        if self.table is not None:
            ending = self.table.suffix.lower()
            check_place(self.table, "--table", ending=ending if ending in ENDINGS else ENDINGS[0])
        return self.table

    def png(self, name: str) -> Path | None:
        """Path of the figure, checked before any work is done."""
        from palpate.report.style import FORMATS, check_dpi

        check_dpi(self.dpi)
        return self.picture(f"{name}.identify.png", FORMATS)


@Parameter(name="*", group=Group("Several logs", sort_key=5))
@dataclass(frozen=True, kw_only=True)
class CovariateOptions:
    """Conditions that several logs differ in, such as a temperature."""

    covariate: Annotated[tuple[str, ...], Parameter(negative=())] = ()
    """A column of each log, such as temperature_C, whose mean is the log's; how the results depend on it is
    pooled, too. May be repeated."""
    covariates: Path | None = None
    "CSV table that has the covariates instead: a column log with the logs' file names, and one for each."

    def of(self, logs: Sequence[Path], source: LogOptions) -> dict[str, Array]:
        """One number of each log, by the covariate's name."""
        from palpate.logs.many import read_covariates

        if self.covariates is not None and not self.covariate:
            raise InputError(
                "--covariates names a table; name its columns, too, as in --covariate temperature_C"
            )
        return read_covariates(logs, self.covariate, self.covariates, source.missing, source.delimiter)


# More than seven arguments: one for each group of options.
def identify(
    *logs: Path,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
    pressed_by: IndenterOptions | None = None,
    beside: CovariateOptions | None = None,
    output: IdentifyOutput | None = None,
    cell: CellOptions | None = None,
) -> int:
    """Identify the touched surface from a log: stiffness, damping, mass.

    A log whose names and units leave nothing to guess needs no options; the output says as what it was read:

    palpate identify press.csv

    Columns are given as NAME or NAME:UNIT, where NAME may be a number from 0:

    palpate identify press.csv --time t --position x:mm --force-column f:mN

    A bag with one wrench and one pose needs no names; palpate topics LOG lists the signals of a log:

    palpate identify press.mcap --wrench-frame tool --tcp 0,0,120:mm

    Several logs, or a folder of them, are pooled: one table, the mean, and an interval for the next press:

    palpate identify presses/ --table presses.csv

    palpate identify presses/ --covariate temperature_C --covariates conditions.csv

    Options of a cell can be saved and loaded again:

    palpate identify press.csv --preset ur-rtde --tcp 0,0,120:mm --save-options my-cell.toml

    palpate identify other.csv --options my-cell.toml

    Parameters
    ----------
    logs
        Text in columns, Parquet, a spreadsheet, MATLAB v4 to v7, a ROS 1 bag, a ROS 2 bag or MCAP; the folder
        of a run or a press, or its record.parquet; a folder of logs. Equal sheets of a book are logs of their own.
    """
    output, cell = output or IdentifyOutput(), cell or CellOptions()
    asked = OneLog(
        fitted or ModelOptions(), source or LogOptions(), frame or FrameOptions(), arm or ArmOptions(),
        pressed_by or IndenterOptions(),
    )  # fmt: skip
    asked.pressed_by.check()
    cell.check()
    cell.save(asked.parts)
    return _identify(logs, asked, beside or CovariateOptions(), output)


def _identify(logs: tuple[Path, ...], asked: OneLog, beside: CovariateOptions, output: IdentifyOutput) -> int:
    """Identify one log, or many together."""
    from palpate.logs.many import gather_logs, is_folder_of_logs, log_of, sheets_as_logs

    if not logs:
        raise InputError(
            "no log is named; name a log, several, or a folder of them (see: palpate identify --help)"
        )
    logs = sheets_as_logs(logs, asked.source.names, asked.source.limits)
    if len(logs) == 1 and not is_folder_of_logs(logs[0]):
        if beside != CovariateOptions():
            raise InputError("--covariate is of several logs; name more than one, or a folder of them")
        return _one(log_of(logs[0]), asked, output)
    if output.budget:
        raise InputError("--budget prints the budget of one log; --json has those of many")
    from palpate.cli.one_log import many

    figure, page, table = output.png("pooled"), output.page(), output.paper_table()
    logs = gather_logs(logs)
    known = beside.of(logs, asked.source)
    return many(logs, asked, known, (figure, page, table), json=output.json, dpi=output.dpi)


def _one(log: Path, asked: OneLog, output: IdentifyOutput) -> int:
    figure, page, table = output.png(log.stem), output.page(), output.paper_table()
    found, origin = asked.identification(log)
    if found.traces is None:
        figure = None
    if figure is not None:
        from palpate.report.identification.figure import write_figure

        write_figure(found, figure, title=log.name, dpi=output.dpi)
    if page is not None:
        from palpate.report.identification.page import page as page_of

        write_text(page, page_of(found, origin))
    if table is not None:
        from palpate.report.many.table import LogRow, write_table

        write_table([LogRow(origin, found)], None, table)
    from palpate.report.identification.answer import answer_of

    more = "--verbose" if output.report else "--verbose, or --report PAGE.html"
    written = places(path for path in (figure, page, table) if path is not None)
    answer = answer_of(found, origin, written, more, verbose=output.verbose, budget=output.budget)
    print_result(answer, json=output.json)
    return 0 if has_number(found) else 1
