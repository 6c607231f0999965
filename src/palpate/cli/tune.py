"""`palpate tune`: gains for a force loop, their predicted performance, and the proof of their stability."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli._answer import print_answer
from palpate.cli._identified import read_found
from palpate.cli._program import command
from palpate.cli._terminal import console, place
from palpate.cli.options.force import (
    ArmOptions,
    ColumnOptions,
    OutputOptions,
    PressOptions,
    SurfaceOptions,
)
from palpate.cli.options.log import LogOptions
from palpate.cli.options.written import ReportOption
from palpate.errors import InputError
from palpate.files import write_text

if TYPE_CHECKING:
    from palpate.force import Known, Tuning
    from palpate.force.inner_loop import InnerLoop


def tune(
    found: Path | None = None,
    /,
    *,
    arm: ArmOptions,
    press: PressOptions,
    surface: SurfaceOptions | None = None,
    columns: ColumnOptions | None = None,
    output: OutputOptions | None = None,
    page: ReportOption | None = None,
) -> int:
    """Tune a force loop for an arm, and prove on which surfaces it is stable.

    From the output of palpate identify --json, from a log, or from a range of stiffness:

    palpate tune found.json --arm ur5e --force 20 --out gains.toml

    palpate tune press.csv --time time_s --position position_mm:mm --log-force force_N:N --arm ur5e --force 20

    palpate tune --stiffness 1e2:1e6 --arm fr3 --force 10 --out gains.toml

    The arm's inner loop and delay from a log of commanded and measured position, in free motion:

    palpate tune found.json --arm ur5e --force 20 --loop-from sweep.csv --time t --command target_x --position actual_x

    The gains are for palpate.force.ForceLoop, which adapts to any surface below the cap. Exit code 1: nothing could be
    proved.

    Parameters
    ----------
    found
        The output of palpate identify --json, as a .json file; or a log.
    """
    surface, columns = surface or SurfaceOptions(), columns or ColumnOptions()
    output, page = output or OutputOptions(), page or ReportOption()
    output.check_new(output.out, ending=".toml")
    report = page.page()
    from palpate.force import tune as tuned

    one, inner = arm.named(columns)
    told = tuned(
        one,
        press.desired,
        _known(found, surface.stiffness, columns.of_press, columns.payload),
        cap=surface.cap,
        peak=press.highest,
        surface_speed=surface.surface_speed,
    )
    written = _written(told, output.out, report)
    _print(told, inner, written, output.json)
    return 0 if told.proved else 1


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
                "the surface is missing; give FOUND.json of palpate identify --json, a log, or --stiffness LOW:HIGH"
            )
        low, high = spread("--stiffness", stiffness, "stiffness")
        return Known((low, high))
    if found.suffix.lower() == ".json":
        return known_from(read_found(found), str(found))
    return known_from(_identified(found, source, payload), str(found))


def _identified(log: Path, source: LogOptions, payload: Path | None) -> dict[str, Any]:
    from palpate.cli.options.arm import ArmOptions as PayloadOptions
    from palpate.cli.options.log import read
    from palpate.contact_frame import identify_contact
    from palpate.logs.own_runs import is_run, measured_by

    record = read(log, source, samples=False)
    if "force" not in record.columns or "position" not in record.columns:
        raise InputError(
            f"{log}: tune takes a log of one axis; run palpate identify --json on it and give its output"
        )
    known: dict[str, Any] = measured_by(log) if source.plain and is_run(log) else {}
    found, _ = identify_contact(record, None, PayloadOptions(payload=payload).arm(), **known)
    return found.to_json()


def _written(told: Tuning, out: Path | None, page: Path | None) -> list[Path]:
    if out is not None:
        write_text(out, told.gains.to_toml())
    if page is not None:
        from palpate.report.tuning.page import page as page_of

        write_text(page, page_of(told, command()))
    return [path for path in (out, page) if path is not None]


def _print(told: Tuning, inner: InnerLoop | None, written: list[Path], json: bool) -> None:
    if json:
        print_answer(told.to_json() | {"inner_loop": None if inner is None else inner.to_json()})
        return
    from palpate.report.tuning.table import show

    screen = console()
    show(told, screen)
    for path in written:
        place(screen, "written:", path)
