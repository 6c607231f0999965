"""`palpate identify`: what did the robot touch, by a log of it?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from palpate.cli._arm_options import ArmOptions, FrameOptions
from palpate.cli._log_options import LogOptions, read
from palpate.cli._terminal import console, place, print_json
from palpate.cli._values import with_std
from palpate.errors import InputError
from palpate.files import check_place

if TYPE_CHECKING:
    from palpate.identification import Identification
    from palpate.records import Record

_FLAG = Parameter(negative=())


@Parameter(name="*", group=Group("The model", sort_key=4))
@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """What is fitted, and what is known beforehand.

    Parameters
    ----------
    model
        kelvin-voigt, kelvin-voigt-mass, standard-linear-solid or hunt-crossley; chosen if not given.
    lag
        How much later the force is read than the position, SECONDS or SECONDS:STD, if it is calibrated.
    force_filter
        What the force went through before it was sampled, as butterworth3:120 (order and Hz), joined by +; or none.
    mass
        What is known of the mass beforehand, in kg, VALUE or VALUE:STD.
    tolerance
        Largest half-width of an identified parameter's 95 % interval, as a share of its value.
    calibration
        Relative standard deviation of the scales of force and position together, as 0.01.
    bonded
        The probe is fixed to the surface, or is not; found out if neither is said.
    cutoff
        Of the filters that all channels pass through, in Hz; chosen if not given.
    method
        least-squares; or instrumental-variables or output-error, if noise of the position would pull it.
    """

    model: str | None = None
    lag: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None
    force_filter: str | None = None
    mass: str | None = None
    tolerance: float = 0.25
    calibration: float = 0.0
    bonded: bool | None = None
    cutoff: float | None = None
    method: str = "least-squares"

    def known(self, log: Path, options: LogOptions) -> dict[str, Any]:
        """The keywords of `palpate.identify`; a run of palpate's own says itself what measured it."""
        from palpate.logs.own_runs import is_run, measured_by

        known: dict[str, Any] = measured_by(log) if options.plain and is_run(log) else {}
        if self.method != ModelOptions.method:
            known.pop("force_filter", None)  # only least squares make use of it
        lag = with_std("lag", self.lag)
        if lag is not None:
            known |= {"lag": lag[0], "lag_std": lag[1]}
        if self.force_filter is not None:
            known["force_filter"] = None if self.force_filter == "none" else self.force_filter
        if self.mass is not None:
            known["mass"] = with_std("mass", self.mass, "0.5:0.02")
        names = ("model", "tolerance", "calibration", "bonded", "cutoff", "method")
        return known | {name: getattr(self, name) for name in names}


@Parameter(name="*", group=Group("What is written", sort_key=5))
@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Where results go.

    Parameters
    ----------
    figure
        Where to write the figure, a PNG; LOG.identify.png in the current folder if not given.
    no_figure
        Write no figure.
    report
        Where to write a page with everything, an HTML file.
    json
        Print one JSON object and nothing else; a figure is written only if --figure is given.
    """

    figure: Path | None = None
    no_figure: Annotated[bool, _FLAG] = False
    report: Path | None = None
    json: Annotated[bool, _FLAG] = False


def identify(
    log: Path,
    /,
    *,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
    output: OutputOptions | None = None,
) -> int:
    """Find what a robot touched, from a log: stiffness, damping, mass.

    Columns are given as NAME or NAME:UNIT, where NAME may be a number from 0:

    palpate identify press.csv --time time_s --position position_mm:mm --force force_mN:mN

    A bag with one wrench and one pose needs no names; palpate topics LOG lists what a log holds:

    palpate identify press.mcap --wrench-frame tool --tcp 0,0,120:mm

    Parameters
    ----------
    log
        Text in columns, Parquet, a spreadsheet, MATLAB v4 to v7, a ROS 1 bag, a ROS 2 bag or MCAP; or the
        record.parquet of a run.
    """
    source, frame, arm = source or LogOptions(), frame or FrameOptions(), arm or ArmOptions()
    fitted, output = fitted or ModelOptions(), output or OutputOptions()
    figure, page = _figure(log, output), _page(output)
    found, record = _identified(log, source, frame, arm, fitted)
    if found.traces is None:
        figure = None
    _write(found, record, log, figure, page)
    _print(found, record, log, [path for path in (figure, page) if path is not None], output.json)
    return 0 if found.found else 1


def _identified(
    log: Path, source: LogOptions, frame: FrameOptions, arm: ArmOptions, fitted: ModelOptions
) -> tuple[Identification, Record]:
    from palpate.contact_frame import identify_contact, robot_stiffness

    known = fitted.known(log, source)
    said, between = frame.frame(), arm.arm()
    record = read(log, source, samples=known.get("force_filter") is not None)
    in_space = "force_x" in record.columns
    if said is not None and not in_space:
        raise InputError(
            "--wrench-frame, --tcp, --normal and their like are of a wrench and a pose; this log has one axis"
        )
    if arm.robot_stiffness_from is not None:
        wall = arm.robot_stiffness_from
        whole = read(
            wall, replace(source, start=None, end=None), samples=known.get("force_filter") is not None
        )
        rigid = replace(between, position_from="tip")
        pressed, _ = identify_contact(whole, replace(said, free=None) if said else None, rigid, **known)
        between = replace(between, stiffness=robot_stiffness(pressed, wall.name))
    return identify_contact(record, said, between, **known)


def _figure(log: Path, output: OutputOptions) -> Path | None:
    """Where the figure goes; found wrong before any work is done."""
    if output.no_figure or (output.figure is None and output.json):
        return None
    path = output.figure or Path(f"{log.stem}.identify.png")
    check_place(path, "--figure", ending=".png")
    return path


def _page(output: OutputOptions) -> Path | None:
    """Where the page goes; likewise."""
    if output.report is not None:
        check_place(output.report, "--report", ending=".html")
    return output.report


def _write(found: Identification, record: Record, log: Path, figure: Path | None, page: Path | None) -> None:
    if figure is not None:
        from palpate.report.identification import write_figure

        write_figure(found, figure, title=log.name)
    if page is not None:
        from palpate.contact_frame import told
        from palpate.report.identification_page import write_page

        write_page(found, page, title=log.name, notes=told(record.meta))


def _print(found: Identification, record: Record, log: Path, written: list[Path], json: bool) -> None:
    if json:
        print_json(found.to_json())
        return
    from palpate.contact_frame import told
    from palpate.report.identification_table import show

    screen = console()
    show(found, log.name, screen)
    for line in told(record.meta):
        screen.print(line, soft_wrap=True)
    for path in written:
        place(screen, "figure:" if path.suffix.lower() == ".png" else "report:", path)
