"""`palpate tune`: gains for a force loop, what they will do, and where they are proved stable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from palpate.cli._log_options import LogOptions
from palpate.cli._program import command
from palpate.cli._terminal import console, place, print_json
from palpate.errors import InputError
from palpate.files import check_place, write_text

if TYPE_CHECKING:
    from palpate.force import Known, Tuning

_FLAG = Parameter(negative=())
_NUMBER = Parameter(allow_leading_hyphen=True)
_LARGEST = 1 << 26


# More than seven arguments: each is a flag of the command.
def tune(
    found: Path | None = None,
    /,
    *,
    arm: str,
    force: Annotated[str, _NUMBER],
    stiffness: Annotated[str | None, _NUMBER] = None,
    stiffness_cap: Annotated[str | None, _NUMBER] = None,
    peak: Annotated[str | None, _NUMBER] = None,
    surface_speed: Annotated[float | None, _NUMBER] = None,
    out: Path | None = None,
    replace: Annotated[bool, _FLAG] = False,
    report: Path | None = None,
    json: Annotated[bool, _FLAG] = False,
    time: str | None = None,
    rate: float | None = None,
    position: str | None = None,
    log_force: str | None = None,
    payload: Path | None = None,
) -> int:
    """Tune a force loop for an arm, and prove where it is stable.

    From what palpate identify --json printed, straight from a log, or from a range of stiffness alone:

    palpate tune found.json --arm ur5e --force 20 --out gains.toml

    palpate tune press.csv --time time_s --position position_mm:mm --log-force force_N:N --arm ur5e --force 20

    palpate tune --stiffness 1e2:1e6 --arm fr3 --force 10 --out gains.toml

    The gains are for palpate.force.ForceLoop, which adapts to any surface below the cap. Exit code 1 says that
    nothing could be proved.

    Parameters
    ----------
    found
        What palpate identify --json printed, as a .json file; or a log.
    arm
        ur5e, fr3, panda, iiwa14, or a TOML file.
    force
        Desired force, the smallest that will be asked for, N.
    stiffness
        Range of the surface's stiffness, LOW:HIGH in N/m or LOW:HIGH:UNIT, without a log.
    stiffness_cap
        Stiffest surface that there may be, N/m.
    peak
        Highest force allowed at the touch, N.
    surface_speed
        Of a surface that moves by itself, m/s.
    out
        Where to write the gains, a TOML file.
    replace
        Replace what stands at --out.
    report
        Where to write a page with everything, an HTML file.
    json
        Print one JSON object and nothing else.
    time
        Of a log: its column of the time, as for palpate identify.
    rate
        Of a log without a time: rows per second.
    position
        Of a log: its column of the position, as position_mm:mm.
    log_force
        Of a log: its column of the force, as force_mN:mN.
    payload
        Of a log: what palpate payload wrote of the tool on the sensor, whose mass is taken out of M.
    """
    _one_thread()
    if report is not None:
        check_place(report, "--report", ending=".html")
    if out is not None:
        _check_out(out, replace)
    from palpate.excitation.quantities import quantity
    from palpate.force import load_arm
    from palpate.force import tune as tuned

    one = load_arm(arm)
    told = tuned(
        one,
        quantity("--force", force, "force"),
        _known(
            found, stiffness, LogOptions(time=time, rate=rate, position=position, force=log_force), payload
        ),
        cap=None if stiffness_cap is None else quantity("--stiffness-cap", stiffness_cap, "stiffness"),
        peak=None if peak is None else quantity("--peak", peak, "force"),
        surface_speed=surface_speed,
        prove_adapting=one.kind == "position",
    )
    _write(told, out, report)
    _print(told, [p for p in (out, report) if p is not None], json)
    return 0 if told.proved else 1


def _one_thread() -> None:
    """A proof is made of many small matrices: NumPy's threads would cost ten times what they bring."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _check_out(out: Path, replace: bool) -> None:
    check_place(out, "--out", ending=".toml")
    if out.exists() and not replace:
        raise InputError(f"{out} exists; choose another place, or add --replace")


def _known(
    found: Path | None, stiffness: str | None, source: LogOptions, payload: Path | None
) -> Known | None:
    from palpate.excitation.quantities import spread
    from palpate.force import Known, known_from

    if found is not None and stiffness is not None:
        raise InputError("give a file or --stiffness, not both")
    if found is None:
        if stiffness is None:
            raise InputError(
                "tune for what? Give FOUND.json of palpate identify --json, a log, or --stiffness LOW:HIGH"
            )
        low, high = spread("--stiffness", stiffness, "stiffness")
        return Known((low, high))
    if found.suffix.lower() == ".json":
        return known_from(_object(found), str(found))
    return known_from(_identified(found, source, payload), str(found))


def _object(path: Path) -> dict[str, Any]:
    from json import JSONDecodeError, loads

    with path.open("rb") as file:
        data = file.read(_LARGEST + 1)
    if len(data) > _LARGEST:
        raise InputError(
            f"{path}: more than {_LARGEST} bytes are not what palpate identify prints; check the path"
        )
    try:
        value = loads(data)
    except (JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}; give what palpate identify --json printed") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: not what palpate identify --json prints")
    return value


def _identified(log: Path, source: LogOptions, payload: Path | None) -> dict[str, Any]:
    from palpate.cli._arm_options import ArmOptions
    from palpate.cli._log_options import read
    from palpate.contact_frame import identify_contact
    from palpate.logs.own_runs import is_run, measured_by

    record = read(log, source, samples=False)
    if "force" not in record.columns or "position" not in record.columns:
        raise InputError(
            f"{log}: tune takes a log of one axis; run palpate identify --json on it and give that"
        )
    known: dict[str, Any] = measured_by(log) if source.plain and is_run(log) else {}
    found, _ = identify_contact(record, None, ArmOptions(payload=payload).arm(), **known)
    return found.to_json()


def _write(told: Tuning, out: Path | None, page: Path | None) -> None:
    if out is not None:
        write_text(out, told.gains.to_toml())
    if page is not None:
        from palpate.report.force_page import write_page

        write_page(told, page, command())


def _print(told: Tuning, written: list[Path], json: bool) -> None:
    if json:
        print_json(told.to_json())
        return
    from palpate.report.force_table import show

    screen = console()
    show(told, screen)
    for path in written:
        place(screen, "written:", path)
