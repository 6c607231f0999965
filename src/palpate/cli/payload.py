"""`palpate payload`: mass and centre of the tool on the force sensor, the sensor's bias and drift, and load files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from palpate.cli._program import print_result
from palpate.cli.options.common import WRITTEN, CellOptions, FileOptions, ReportOption
from palpate.cli.options.log import FrameOptions, LogOptions
from palpate.cli.options.values import Point, options, si
from palpate.errors import InputError
from palpate.files import write_text
from palpate.records import Record

if TYPE_CHECKING:
    from palpate.contact_frame.tool_payload import Weighed


_ENDINGS = (".toml", ".script", ".json", ".yaml")


@options(WRITTEN)
class PayloadOutput(ReportOption, FileOptions):
    """Where the payload is written, and a load file that is compared with it."""

    out: Path | None = None
    """Where to write the payload: a .toml for --payload, or the load file of a controller: .script (UR), .json
    (Franka), .yaml (ROS 2)."""
    check: Path | None = None
    "A controller's load file, to be compared with the log. With --gravity-compensated the controller had it."
    flange: Point | None = None
    """The flange, from which a load file counts the centre of mass, in the tool's axes from the pose's origin: x,y,z in
    m, or with :mm. In a .yaml the sensor."""

    def origin(self, torque_at: tuple[float, float, float]) -> tuple[float, float, float]:
        """The flange from the point that the torque is about, which is given from the pose's origin [m]."""
        x, y, z = si(self.flange) or (0.0, 0.0, 0.0)
        a, b, c = torque_at
        return x - a, y - b, z - c


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

    palpate payload turning.mcap --wrench-frame tool --check endeffector-config.json

    Shake the tool at the end of the log: this shows whether the driver subtracts the tool's inertia. Exit code 1: the
    poses do not determine the mass, and the output says how to move; or the checked file does not agree with the log.

    Parameters
    ----------
    log
        A log of wrench and pose, as for palpate identify.
    tolerance
        Largest half-width of the mass' 95 % interval, as a share of its value.
    """
    cell, output = cell or CellOptions(), output or PayloadOutput()
    cell.check()
    ending = _ENDINGS[0] if output.out is None else output.out.suffix
    output.check_new(output.out, ending=ending if ending in _ENDINGS else _ENDINGS[0])
    report = output.page()
    if not 0.0 < tolerance <= 1.0:
        raise InputError(f"--tolerance must be above 0 and at most 1, got {tolerance:g}")
    from palpate.contact_frame.load_files import compare, read_load
    from palpate.contact_frame.signals_in_base import ContactFrame
    from palpate.contact_frame.tool_payload import weigh
    from palpate.report.payload import answer_of

    load = None if output.check is None else read_load(output.check)
    cell.save((source or LogOptions(), frame or FrameOptions()))
    contact = (frame or FrameOptions()).frame() or ContactFrame()
    found = weigh(_wrench_and_pose(log, source or LogOptions()), contact, tolerance)
    start = output.origin(contact.wrench_at)
    written = _write(found, log.name, (output.out, report), ending, start)
    rows = []
    if load is not None and found.payload is not None:
        rows = compare(found, load, start, compensated=contact.gravity_compensated)
    answer = answer_of(found, log.name, output.check, rows)
    print_result(answer, json=output.json, files=[("written:", path) for path in written])
    return 0 if found.payload is not None and all(row.agrees for row in rows) else 1


def _wrench_and_pose(log: Path, source: LogOptions) -> Record:
    record = source.read(log)
    if "force_x" not in record.columns:
        raise InputError(
            f"{log}: weighing a tool needs a wrench and a pose in three dimensions; name them with --wrench and --pose"
        )
    return record


def _write(
    found: Weighed,
    name: str,
    files: tuple[Path | None, Path | None],
    ending: str,
    start: tuple[float, float, float],
) -> list[Path]:
    """Write the payload and the page; returns the written files."""
    from palpate.contact_frame.load_files import load_text
    from palpate.report.payload import page

    out, report = files if found.payload is not None else (None, files[1])
    if out is not None:
        write_text(out, load_text(found, ending, start))
    if report is not None:
        write_text(report, page(found, name))
    return [path for path in (out, report) if path is not None]
