"""`palpate payload`: mass and centre of the tool on the force sensor, and the sensor's bias and drift."""

from __future__ import annotations

from pathlib import Path

from palpate.cli._program import OutputFile, print_result
from palpate.cli.options.common import WRITTEN, CellOptions, FileOptions, ReportOption
from palpate.cli.options.log import FrameOptions, LogOptions
from palpate.cli.options.values import Point, options, si
from palpate.errors import InputError
from palpate.files import write_text
from palpate.records import Record

_ENDINGS = (".toml", ".script", ".json", ".yaml")


@options(WRITTEN)
class PayloadOutput(ReportOption, FileOptions):
    """The file of the payload."""

    out: Path | None = None
    """Where to write the payload: a .toml for --payload, or the load file of a controller: .script (UR), .json
    (Franka), .yaml (ROS 2)."""
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

    Shake the tool at the end of the log: this shows whether the driver subtracts the tool's inertia. Exit code 1: the
    poses do not determine the mass, and the output says how to move.

    Parameters
    ----------
    log
        A log of wrench and pose, as for palpate identify.
    tolerance
        Largest half-width of the mass' 95 % interval, as a fraction of its value.
    """
    cell, output = cell or CellOptions(), output or PayloadOutput()
    cell.check()
    ending = _ENDINGS[0] if output.out is None else output.out.suffix
    output.check_new(output.out, ending=ending if ending in _ENDINGS else _ENDINGS[0])
    report = output.page()
    if not 0.0 < tolerance <= 1.0:
        raise InputError(f"--tolerance must be above 0 and at most 1, got {tolerance:g}")
    from palpate.contact_frame.payload import load_text
    from palpate.contact_frame.signals_in_base import ContactFrame
    from palpate.contact_frame.tool_payload import weigh
    from palpate.report.payload import build_answer, page

    cell.save((source or LogOptions(), frame or FrameOptions()))
    contact = (frame or FrameOptions()).frame() or ContactFrame()
    weighed = weigh(_wrench_and_pose(log, source or LogOptions()), contact, tolerance)
    written = []
    if output.out is not None and weighed.payload is not None:
        half, origin = float(weighed.parameters["mass"].half), output.origin(contact.wrench_at)
        write_text(output.out, load_text(weighed.payload, half, ending, origin))
        written.append(OutputFile("written:", output.out))
    if report is not None:
        written.append(OutputFile("written:", report, lambda: write_text(report, page(weighed, log.name))))
    print_result(build_answer(weighed, log.name), json=output.json, files=written)
    return 0 if weighed.payload is not None else 1


def _wrench_and_pose(log: Path, source: LogOptions) -> Record:
    record = source.read(log)
    if "force_x" not in record.columns:
        raise InputError(
            f"{log}: weighing a tool needs a wrench and a pose in three dimensions; name them with --wrench and --pose"
        )
    return record
