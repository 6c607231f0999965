"""`palpate identify`: what did the robot touch, by a log of it?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.identification import Identification
    from palpate.records import Record

_NEGATIVE = Parameter(negative=())


def identify(
    log: Path,
    /,
    *,
    time: str | None = None,
    rate: float | None = None,
    position: str | None = None,
    force: str | None = None,
    model: str | None = None,
    lag: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    tolerance: float = 0.25,
    calibration: float = 0.0,
    series_stiffness: str | None = None,
    bonded: bool | None = None,
    start: Annotated[float | None, Parameter(allow_leading_hyphen=True)] = None,
    end: float | None = None,
    missing: Annotated[tuple[str, ...], Parameter(allow_leading_hyphen=True, negative=())] = (),
    delimiter: str | None = None,
    cutoff: float | None = None,
    figure: Path | None = None,
    no_figure: Annotated[bool, _NEGATIVE] = False,
    json: Annotated[bool, _NEGATIVE] = False,
) -> int:
    """Find what a robot touched, from a log: stiffness, damping, mass.

    Columns are given as NAME or NAME:UNIT, where NAME may be a number from 0:

    palpate identify press.csv --time time_s --position position_mm:mm --force force_mN:mN

    Parameters
    ----------
    log
        CSV, with or without a header, or Parquet.
    time
        Column of the time, in s if no unit is given; dates and times (ISO 8601) too.
    rate
        Rows per second, for a log without a column of time.
    position
        Column of the position, in m if no unit is given; the unit 1 takes the numbers as they stand.
    force
        Column of the force, in N if no unit is given; g is what a scale shows.
    model
        kelvin-voigt, kelvin-voigt-mass, standard-linear-solid or hunt-crossley; chosen if not given.
    lag
        How much later the force is read than the position, SECONDS or SECONDS:STD, if it is calibrated.
    tolerance
        Largest half-width of an identified parameter's 95 % interval, as a share of its value.
    calibration
        Relative standard deviation of the scales of force and position together, as 0.01.
    series_stiffness
        What lies between the position sensor and the surface, N/m or N/m:STD; it is taken out.
    bonded
        The probe is fixed to the surface, or is not; found out if neither is said.
    start
        Leave out what is before, in seconds from the first row.
    end
        Leave out what is after, in seconds from the first row.
    missing
        A value that means "no reading", as -1; may be given again. A plain one is found by itself.
    delimiter
        Between two cells of a CSV file; found if not given.
    cutoff
        Of the filters that all channels pass through, in Hz; chosen if not given.
    figure
        Where to write the figure, a PNG; LOG.identify.png in the current folder if not given.
    no_figure
        Write no figure.
    json
        Print one JSON object and nothing else; a figure is written only if --figure is given.
    """
    from palpate.identification import identify as identify_record

    picture = _picture(log, figure, wanted=not no_figure and (figure is not None or not json))
    record = _read(log, time, rate, position, force, start, end, missing, delimiter)
    known_lag = _with_std("lag", lag)
    series = _with_std("series-stiffness", series_stiffness)
    found = identify_record(
        record,
        model=model,
        lag=known_lag[0] if known_lag else None,
        lag_std=known_lag[1] if known_lag else 0.0,
        tolerance=tolerance,
        calibration=calibration,
        series_stiffness=series[0] if series else None,
        series_std=series[1] if series else 0.0,
        bonded=bonded,
        cutoff=cutoff,
    )
    if picture is not None and found.traces is not None:
        from palpate.report.identification import write_figure

        write_figure(found, picture, title=log.name)
    _print(found, log, picture if found.traces is not None else None, json)
    return 0 if found.found else 1


def _read(
    log: Path,
    time: str | None,
    rate: float | None,
    position: str | None,
    force: str | None,
    start: float | None,
    end: float | None,
    missing: tuple[str, ...],
    delimiter: str | None,
) -> Record:
    from palpate.logs import columns_of, read_log

    names = {"time": time, "position": position, "force": force}
    there = columns_of(log, delimiter)
    if rate is None:
        names["time"] = time or ("time" if "time" in there else None)
    for role in ("position", "force"):
        names[role] = names[role] or (role if role in there else None)
    lacking = [
        role for role, name in names.items() if name is None and not (role == "time" and rate is not None)
    ]
    if lacking:
        options = ", ".join(f"--{role}" for role in lacking)
        if "time" in lacking:
            options += " (or --rate)"
        raise InputError(f"name the columns of {log} with {options}; there are: {', '.join(there)}")
    columns = {role: name for role, name in names.items() if name is not None}
    return read_log(log, rate=rate, start=start, end=end, missing=missing, delimiter=delimiter, **columns)


def _with_std(option: str, text: str | None) -> tuple[float, float] | None:
    """`VALUE` or `VALUE:STD` as two numbers."""
    if text is None:
        return None
    try:
        value, _, std = text.partition(":")
        return float(value), float(std) if std else 0.0
    except ValueError:
        raise InputError(
            f"--{option} needs VALUE or VALUE:STD, as 0.0076 or 0.0076:0.0002, got {text!r}"
        ) from None


def _picture(log: Path, figure: Path | None, wanted: bool) -> Path | None:
    """Where the figure goes; found wrong before any work is done."""
    if not wanted:
        return None
    path = figure if figure is not None else Path(f"{log.stem}.identify.png")
    if path.suffix.lower() != ".png":
        raise InputError(f"the figure is a PNG; name it {path.with_suffix('.png')} instead of {path}")
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}; make it first")
    from palpate.report.ownership import check_ours

    check_ours(path)
    return path


def _print(found: Identification, log: Path, picture: Path | None, json: bool) -> None:
    if json:
        from json import dumps

        print(dumps(found.to_json(), allow_nan=False))  # noqa: T201
        return
    from rich.console import Console

    from palpate.report.identification_table import show

    show(found, log.name, Console(highlight=False))
    if picture is not None:
        Console(highlight=False, soft_wrap=True).print(f"figure: {picture}")
