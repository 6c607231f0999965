"""`palpate payload`: mass and centre of the tool on the force sensor, and the sensor's bias and drift."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from palpate.cli._answer import print_answer
from palpate.cli._terminal import place, show_answer
from palpate.cli.options.arm import FrameOptions
from palpate.cli.options.kept import CellOptions
from palpate.cli.options.log import LogOptions
from palpate.cli.options.written import WRITTEN, FileOptions, ReportOption
from palpate.errors import InputError
from palpate.files import write_text

if TYPE_CHECKING:
    from palpate.contact_frame import Weighed


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class PayloadOutput(ReportOption, FileOptions):
    """Where the payload is written."""

    out: Path | None = None
    "Where to write the payload, a TOML file for --payload."


def payload(
    log: Path,
    /,
    *,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    cell: CellOptions | None = None,
    tolerance: float = 0.25,
    output: PayloadOutput | None = None,
) -> int:
    """Weigh a tool by a log of free motion: mass, centre, the sensor's bias and drift.

    Log wrench and pose. Rest in at least six orientations, a second each, at least 30 degrees apart, and return to the
    first:

    palpate payload turning.mcap --wrench-frame tool --out tool.toml

    palpate identify press.mcap --wrench-frame tool --payload tool.toml

    Shake the tool at the end of the log: this shows whether the driver subtracts the tool's inertia. Exit code 1: the
    poses do not determine the mass; the output says how to move.

    Parameters
    ----------
    log
        A log of wrench and pose, as for palpate identify.
    tolerance
        Largest half-width of the mass' 95 % interval, as a share of its value.
    """
    cell, output = cell or CellOptions(), output or PayloadOutput()
    cell.check()
    output.check_new(output.out, ending=".toml")
    report = output.page()
    if not 0.0 < tolerance <= 1.0:
        raise InputError(f"--tolerance must be above 0 and at most 1, got {tolerance:g}")
    from palpate.contact_frame import ContactFrame, weigh

    cell.save((source or LogOptions(), frame or FrameOptions()))
    record = (source or LogOptions()).read(log)
    if "force_x" not in record.columns:
        raise InputError(
            f"{log}: weighing a tool needs a wrench and a pose in three dimensions; name them with --wrench and --pose"
        )
    found = weigh(record, (frame or FrameOptions()).frame() or ContactFrame(), tolerance)
    written = []
    if output.out is not None and found.payload is not None:
        found.payload.save(output.out)
        written.append(output.out)
    if report is not None:
        from palpate.report.payload import page

        write_text(report, page(found, log.name))
        written.append(report)
    _print(found, log, written, output.json)
    return 0 if found.payload is not None else 1


def _print(found: Weighed, log: Path, written: list[Path], json: bool) -> None:
    if json:
        print_answer(found.to_json())
        return
    from palpate.report.payload import sentence, table

    notes = [f"{note['code']}: {note['text']}" for note in found.notes]
    screen = show_answer(log.name, f": {sentence(found)}", [table(found)], notes)
    for path in written:
        place(screen, "written:", path)
