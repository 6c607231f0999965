"""`palpate press`: any serial arm presses on a surface, to a folder of results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from palpate.cli._interrupts import noticed
from palpate.cli._program import command
from palpate.cli._terminal import STYLE, console, head, place, print_json, show_table
from palpate.cli.run import whole_number
from palpate.errors import InputError
from palpate.files import fresh_folder, signed, write_json
from palpate.text import shown

if TYPE_CHECKING:
    from rich.console import Console

    from palpate.press.prepare import Pressing
    from palpate.records import Record

_FLAG = Parameter(negative=())
_TEXT = Parameter(allow_leading_hyphen=True)


# More than seven arguments: each is a flag of the command.
def press(
    *,
    arm: str,
    force: Annotated[str, _TEXT],
    surface: str,
    out: Path | None = None,
    replace: Annotated[bool, _FLAG] = False,
    site: str | None = None,
    mode: str | None = None,
    physics: str = "own",
    controller: str = "cautious",
    gains: Path | None = None,
    at: Annotated[str | None, _TEXT] = None,
    normal: Annotated[str | None, _TEXT] = None,
    seconds: Annotated[float, _TEXT] = 6.0,
    probe: Annotated[float, _TEXT] = 0.2,
    seed: Annotated[int, Parameter(converter=whole_number)] = 0,
    json: Annotated[bool, _FLAG] = False,
) -> int:
    """Press on a surface with any serial arm, in simulation.

    The arm approaches, touches, presses with the force asked for, lowers it now and then, and what it touched is
    identified from what its encoders and its force sensor measured:

    palpate press --arm fr3 --force 20:N --surface K=5000,B=50 --out runs/press

    Parameters
    ----------
    arm
        ur5e, fr3, panda, iiwa14, or a file: .toml, .xml (MJCF), .urdf.
    force
        Desired force, N, or with a unit as 20:N.
    surface
        What is touched: K=5000,B=50 in N/m and N s/m, and M=0.1 in kg if it has a mass.
    out
        Folder for record.parquet, summary.json, figures, film and report.html; runs/press-ARM-SEED when left out.
    replace
        Replace the results that stand at --out.
    site
        The tip, of a file: a site or a body of MJCF, a link of URDF.
    mode
        torque or position: how the arm is driven; its own way when left out.
    physics
        own or mujoco (extra: arms).
    controller
        cautious (with gains for any surface), or of torques: hybrid, proportional-integral, impedance.
    gains
        Gains from palpate tune, a TOML file; made for the arm and its pose when left out.
    at
        Point of the surface in the base's axes, x,y,z or x,y,z:mm; before the tip at home when left out.
    normal
        Direction into the surface, x,y,z; where the tip points at home when left out.
    seconds
        From the touch on.
    probe
        Share of the force by which it is lowered now and then, so that the surface shows what it is.
    seed
        Of the noise; the same seed gives the same numbers.
    json
        Print the summary as JSON and nothing else.
    """
    from palpate.bench.ending import DONE, INTERRUPTED
    from palpate.cli._values import vector
    from palpate.excitation.quantities import quantity
    from palpate.press.prepare import Question, prepared, surface_of

    question = Question(
        arm=arm, force=quantity("--force", force, "force"), surface=surface_of(surface), site=site, mode=mode,
        physics=physics, controller=controller, gains=gains, at=vector("at", at, "length"),
        normal=vector("normal", normal, "number"), seconds=seconds, probe=probe, seed=seed,
    )  # fmt: skip
    if not question.force > 0.0:
        raise InputError(f"--force must be above 0 N (it presses), got {question.force:g} N")
    folder = out if out is not None else Path("runs") / f"press-{Path(arm).stem}-{seed}"
    with noticed() as interrupted, fresh_folder(folder, force=replace) as fresh:
        pressing = prepared(question)
        record = _record(console(stderr=json), pressing, interrupted)
        summary = _written(record, pressing, fresh)
    _tell(pressing, summary, folder, json)
    if interrupted() or summary["end"] == INTERRUPTED:
        return 130
    return 0 if summary["end"] == DONE else 1


def _record(screen: Console, pressing: Pressing, interrupted: Callable[[], bool]) -> Record:
    from rich.progress import BarColumn, Progress, TextColumn

    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[time]}")
    with Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as progress:
        bar = progress.add_task(
            "starting (the first time it compiles, which takes some seconds)", total=None, time=""
        )

        def show(time: float, phase: str) -> None:
            if interrupted():
                raise KeyboardInterrupt  # here the press ends, and keeps what there is of it
            progress.update(bar, description=f"{phase:12}", time=f"{time:6.1f} s simulated")

        return pressing.run(show)


def _written(record: Record, pressing: Pressing, folder: Path) -> dict[str, Any]:
    from dataclasses import replace as changed

    from palpate.logs import write_record
    from palpate.press.summary import summarise
    from palpate.report.press_page import write_report

    record = changed(record, meta={**record.meta, "command": shown(command())})
    summary = signed({"command": shown(command()), **summarise(record, pressing.asked)})
    write_record(record, folder / "record.parquet")
    write_json(folder / "summary.json", summary)
    if len(record):
        write_report(record, pressing.asked, summary, folder)
    return summary


def _tell(pressing: Pressing, summary: dict[str, Any], folder: Path, as_json: bool) -> None:
    from palpate.report.press_page import notes, tables

    if as_json:
        print_json(summary)
        return
    screen = console()
    head(
        screen, pressing.asked.arm.title, f", seed {summary['seed']}, {summary['duration_s']:.1f} s simulated"
    )
    for content in tables(summary):
        show_table(screen, content)
    for note in notes(summary):
        screen.print(note, style=STYLE)
    place(screen, "report:", folder / "report.html")
