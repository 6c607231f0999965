"""The calls of `import palpate`: read and identify a record, a file or a table, and pool many, in one line each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from inspect import signature
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError, unknown
from palpate.from_log import accept_stated_units
from palpate.from_log import identify_log as identify_log_file
from palpate.identification import Identification, Pooled
from palpate.identification import identify as identify_record
from palpate.identification import pool as pool_found
from palpate.identification.options import OPTION_NAMES
from palpate.logs import read_log as read
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate.text import in_python

if TYPE_CHECKING:
    from palpate.contact_frame.axis_friction import AxisFriction

_READ = {name for name, own in signature(read).parameters.items() if own.kind is own.KEYWORD_ONLY}
_OPTIONS = {*OPTION_NAMES}
_WORDS = {"model", "force_filter", "bonded"}
_PAIRS = {"mass", "series_mass"}


# More than seven arguments: each option by its name, so that an editor and a notebook complete it.
def identify(
    source: Record | Any,
    *,
    time: str | None = None,
    position: str | None = None,
    force: str | None = None,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    missing: Sequence[str | float] | None = None,
    delimiter: str | None = None,
    model: str | None = None,
    lag: float | tuple[float, float] | None = None,
    lag_std: float | None = None,
    force_filter: str | LowPass | None = None,
    mass: tuple[float, float] | None = None,
    calibration: float | None = None,
    series_stiffness: float | None = None,
    series_std: float | None = None,
    series_mass: tuple[float, float] | None = None,
    bonded: bool | None = None,
    force_sign: int | None = None,
    cutoff: float | None = None,
    tolerance: float | None = None,
    **columns: Any,
) -> Identification:
    """Find what a probe touched, and how far to trust it.

    `palpate.identify("press.csv", time="time_s", position="position_mm:mm", force="force_N:N", lag=(5e-3, 1e-3))`

    Args:
        source: a `Record`; or a log that `palpate.read_log` reads: a path, a DataFrame, an Arrow table.
        time: column of a log, a name or `NAME:UNIT`.
        position: likewise.
        force: likewise.
        rate: rows per second of a log without a time [1/s].
        start: leave out the rows before it, in seconds from the first row [s].
        end: leave out the rows from it on, likewise [s].
        missing: values that mean "no reading".
        delimiter: between two cells of a text file.
        model: kelvin-voigt, kelvin-voigt-mass, standard-linear-solid, hunt-crossley or quasi-linear-viscoelastic;
            chosen if not given.
        lag: how much later the force is read than the position [s]; or that and its standard deviation.
        lag_std: standard deviation of the lag [s].
        force_filter: the force sensor's low-pass, as "butterworth3:120", or "none".
        mass: prior of the mass and its standard deviation [kg]; 0 fixes it.
        calibration: relative standard deviation of the scales of force and position together.
        series_stiffness: between the position sensor and the surface [N/m].
        series_std: its standard deviation [N/m].
        series_mass: mass between that stiffness and the surface, and its standard deviation [kg].
        bonded: True if the probe is fixed to the surface, False if not.
        force_sign: 1 if the force grows as the probe presses, -1 if it falls.
        cutoff: of the filter chain [Hz].
        tolerance: largest half-width of an identified parameter's interval, as a fraction of its value.
        columns: further columns and options of `palpate.read_log`.

    Raises:
        InputError: the log or an option is wrong, in one line.
    """
    given = {name: value for name, value in locals().items() if name not in {"source", "columns"}}
    options = {name: value for name, value in given.items() if value is not None} | columns
    with _in_python():
        if isinstance(source, str | Path) and not {*options} - _OPTIONS:
            return _named(identify_log_file(source, **_split(options, columns=True)[1]), source)
        reading, fitting = _split(options, columns=not isinstance(source, Record))
        if isinstance(source, Record):
            return _fit(source, fitting)
        record = read(source, **reading)
        specs = {role: reading.get(role) for role in ("position", "force")}
        return _named(accept_stated_units(_fit(record, fitting), record, specs), source)


def _named(result: Identification, source: object) -> Identification:
    """The result with its file's name for titles; of a table as it is."""
    return replace(result, source=Path(source).name) if isinstance(source, str | Path) else result


def identify_log(path: str | Path, **options: Any) -> Identification:
    """Do what `palpate identify` does with a file, in one call; options of `palpate.from_log.identify_log`."""
    with _in_python():
        return _named(identify_log_file(path, **options), path)


def identify_friction(
    source: Record | Any, *, tolerance: float = 0.25, lag: float = 0.0, **options: Any
) -> AxisFriction:
    """Identify the friction of a joint or an axis: Coulomb, viscous, offset, and Stribeck where it shows.

    `palpate.identify_friction("sweep.csv", time="t", velocity="qd:rad/s", force="tau:Nm")`

    Args:
        source: a `Record` with time, force (or torque), and position or velocity or both; or a log.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a fraction of its value.
        lag: of the force behind the motion [s].
        options: of a log those of `palpate.read_log`, its columns among them.

    Raises:
        InputError: the log or an option is wrong, in one line.
    """
    from palpate.contact_frame.axis_friction import identify_friction as identify_axis

    for name, value in (("tolerance", tolerance), ("lag", lag)):
        _check(name, value, pair=False)
    record = source if isinstance(source, Record) else read_log(source, **options)
    with _in_python():
        return identify_axis(record, tolerance, lag)


def read_log(path: Any, **options: Any) -> Record:
    """Read a log as `palpate.logs.read_log` does, with error messages in Python's words."""
    with _in_python():
        for name, value in options.items():
            if name not in _READ and not isinstance(value, str):
                raise unknown("option", name, _READ)
        return read(path, **options)


def pool(logs: Sequence[Any], covariates: Mapping[str, Any] | None = None, **options: Any) -> Pooled:
    """One stiffness, damping and mass of many presses, with an interval for the next press.

    Args:
        logs: identifications, records, or logs that `palpate.identify` takes.
        covariates: by name, one number of each log, such as its temperature: the dependence on each is pooled, too.
        options: for those that are not identified yet, see `palpate.identify`.

    Raises:
        InputError: a log or an option is wrong, in one line.
    """
    if isinstance(logs, str | Mapping) or not isinstance(logs, Sequence):
        raise InputError(f"pool takes a list of logs, got a {type(logs).__name__}")
    fitting = {name: value for name, value in options.items() if name in _OPTIONS}
    results = [
        log
        if isinstance(log, Identification)
        else identify(log, **(fitting if isinstance(log, Record) else options))
        for log in logs
    ]
    with _in_python():
        return pool_found(results, covariates=covariates)


def _fit(record: Record, options: dict[str, Any]) -> Identification:
    """Along the contact's normal where the record has a wrench and a pose."""
    from palpate.contact_frame.press_or_slide import identify_contact

    return (
        identify_contact(record, **options)[0]
        if "force_x" in record.columns
        else identify_record(record, **options)
    )


def _split(options: dict[str, Any], *, columns: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options of reading, and of fitting, each of the right kind."""
    reading = {name: value for name, value in options.items() if name not in _OPTIONS}
    for name, value in reading.items():
        if not columns or (name not in _READ and not isinstance(value, str)):
            raise unknown("option", name, {*_OPTIONS, *(_READ if columns else ())})
    fitting = {name: value for name, value in options.items() if name in _OPTIONS}
    if isinstance(fitting.get("lag"), tuple | list):
        _check("lag", fitting["lag"], pair=True)
        fitting["lag"], fitting["lag_std"] = fitting["lag"]
    for name, value in fitting.items():
        if value is not None and name not in _WORDS:
            _check(name, value, pair=name in _PAIRS)
    return reading, fitting


def _check(name: str, value: Any, *, pair: bool) -> None:
    numbers = value if pair and isinstance(value, tuple | list) else (value,)
    if (
        pair != isinstance(value, tuple | list)
        or len(numbers) != 1 + pair
        or not all(isinstance(number, Real) and not isinstance(number, bool) for number in numbers)
    ):
        expected = "a pair, its value and its standard deviation" if pair else "a number in SI units"
        raise InputError(f"{name} must be {expected}, got {value!r}")


@contextmanager
def _in_python() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise type(error)(in_python(str(error))) from error.__cause__
