"""palpate press: a simulated arm, or a real one over its wire; with --map a map of a phantom."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.cli import _terminal
from palpate.cli._program import command, print_result
from palpate.cli._streams import notice_signals
from palpate.cli._terminal import console
from palpate.cli.options.common import CellOptions
from palpate.cli.options.press import AskOptions, LimitOptions, PhantomOptions, SimulatedOptions, WireOptions
from palpate.cli.options.values import FLAG, only
from palpate.errors import InputError
from palpate.files import RECORD, fresh_folder, with_author, write_json
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.press.prepare import PreparedPress
    from palpate.records import Record


# More than seven arguments: one for each group of options.
def press(
    identified: Path | None = None,
    /,
    *,
    task: AskOptions | None = None,
    simulated: SimulatedOptions | None = None,
    wire: WireOptions | None = None,
    limits: LimitOptions | None = None,
    cell: CellOptions | None = None,
    phantom: PhantomOptions | None = None,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Press on a surface with a desired force: with a simulated arm, or with a real one over its wire.

    A simulated arm approaches, touches, presses and lowers the force three times. The surface is identified from the
    readings of its encoders and its force sensor:

    palpate press --arm fr3 --force 20:N --surface K=5000,B=50 --out runs/press

    On the surface that palpate identify found, with gains of palpate tune and the force that they are for:

    palpate press found.json --arm ur5e --gains gains.toml

    It maps a phantom, a surface with lumps, by presses at places that it chooses itself:

    palpate press --arm ur5e --force 5:N --map phantom --presses 40 --stiffer-than 2:kN/m --out runs/map

    For a real arm, --dry-run reads the arm, prints the planned motion and moves nothing:

    palpate press --dry-run --wire rtde:192.168.0.10 --gains gains.toml --force 20:N --normal 0,0,-1 --force-limit 40:N
    --speed-limit 50:mm/s --travel-limit 10:mm --time-limit 20:s --save-options my-cell.toml

    The same without --dry-run moves it after a confirmation; saved options need not be typed again:

    palpate press --wire rtde:192.168.0.10 --force 20:N --options my-cell.toml --record first

    Keep a hand on the emergency stop: none of this was tested on hardware. At each limit, on lost or late readings, and
    on Ctrl-C the tip retreats to free motion, and the arm rests. Exit code 1: the force was not reached, or not held
    for --seconds.

    Parameters
    ----------
    identified
        The output of palpate identify --json, in place of --surface.
    json
        Print one JSON object and nothing else; for a real arm it needs --yes or --dry-run.
    """
    task, simulated = task or AskOptions(), simulated or SimulatedOptions()
    wire, limits, cell = wire or WireOptions(), limits or LimitOptions(), cell or CellOptions()
    cell.check()
    real = wire.wire is not None or wire.recover is not None
    if identified is not None and (real or (phantom is not None and phantom.map is not None)):
        raise InputError(
            f"{identified} is the surface of a simulated press; leave it out with --wire and with --map"
        )
    if real:
        only(simulated, "a simulated arm, and --wire names a real one; leave out --wire")
        from palpate.cli._press_over_wire import press_over

        code = press_over(task, wire, limits, json=json)
    else:
        for part in (wire, limits):
            only(part, "a real arm, and --wire is missing; add --wire")
        if phantom is not None and phantom.map is not None:
            from palpate.cli.map import press_map

            code = press_map(task, simulated, phantom, json=json)
        else:
            only(phantom or PhantomOptions(), "a map of a phantom, and --map is missing; add --map")
            code = _simulate(identified, task, simulated, json)
    cell.save((task, simulated, wire, limits), "press")
    return code


def _simulate(identified: Path | None, task: AskOptions, simulated: SimulatedOptions, json: bool) -> int:
    from palpate.bench.summary import DONE, INTERRUPTED
    from palpate.press.prepare import prepare_press
    from palpate.report.press import build_answer

    spec, folder = (
        simulated.spec(task, None if identified is None else simulated.read_surface(identified)),
        simulated.folder,
    )
    with notice_signals() as interrupted, fresh_folder(folder, replace=simulated.replace) as fresh:
        pressing = prepare_press(spec)
        start = "starting (the first run compiles, which takes some seconds)"
        with _terminal.simulation_progress(console(stderr=json), interrupted, start) as show:
            record = pressing.run(show)
        summary = _write(record, pressing, fresh)
    answer, report = build_answer(pressing.request.arm.title, summary), folder / "report.html"
    print_result(answer, json=json, files=[("report:", report)] if report.exists() else [])
    if interrupted() or summary["end"] == INTERRUPTED:
        return interrupted.code
    return 0 if summary["end"] == DONE else 1


def _write(record: Record, pressing: PreparedPress, folder: Path) -> dict[str, Any]:
    from palpate.logs.tables.parquet import write_record
    from palpate.press.summary import summarise
    from palpate.report.press import write_report

    record = replace(record, meta={**record.meta, "command": printable(command())})
    summary = with_author({"command": printable(command()), **summarise(record, pressing.request)})
    write_record(record, folder / RECORD)
    write_json(folder / "summary.json", summary)
    if len(record):
        with _terminal.guard_picture("report.html"):
            write_report(record, pressing.request, summary, folder)
    return summary
