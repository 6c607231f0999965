"""`palpate thesis`: every figure and every claim of the thesis, measured again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter, validators

from palpate.cli._terminal import console, place, print_lines, say, show_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from palpate.thesis.figure import Study
    from palpate.thesis.measure import Done

COLORS = {"reproduced": "green", "differs": "red", "not checkable": "bright_black"}


def thesis(
    figure: str | None = None,
    /,
    *,
    out: Path | None = None,
    seeds: Annotated[int, Parameter(validator=validators.Number(gte=10, lte=1000))] = 10,
    force: bool = False,
    list_: Annotated[bool, Parameter(name="--list", negative="")] = False,
) -> int:
    """Measure the thesis again: each figure, each claim, with spread over the seeds and a verdict.

    Args:
        figure: the number of one figure, "6.11", or the name of one explanation; all of them when left out.
        out: folder for claims.json, index.html and the figures; runs/thesis or runs/thesis-FIGURE when left out. An
            unfinished measurement there is gone on with.
        seeds: noise seeds for every measured claim.
        force: replace the measurement that stands there already.
        list_: list figures and explanations and stop.
    """
    from palpate.thesis.figure import studies, study

    if list_:
        everything = studies()
        width = 2 + max(len(known.NUMBER) for known in everything)
        for known in everything:
            print_lines(f"{known.NUMBER:<{width}}{known.TITLE}")
        return 0
    chosen = studies() if figure is None else [study(figure)]
    folder = out if out is not None else Path("runs") / ("thesis" if figure is None else f"thesis-{figure}")
    command = f"palpate thesis{'' if figure is None else ' ' + figure} --seeds {seeds}"
    try:
        _measure(chosen, folder, range(seeds), command, force)
    except KeyboardInterrupt:
        say(f"interrupted; what is measured is saved in {folder}, and the same command goes on from there")
        return 130
    return 0


def _measure(chosen: Sequence[Study], folder: Path, seeds: Sequence[int], command: str, force: bool) -> None:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from palpate.cli._waiting import COMPILING
    from palpate.thesis.measure import measure
    from palpate.thesis.runs import Runs

    screen = console()
    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=screen, transient=True) as progress:
        bar = progress.add_task("", total=len(chosen))

        def waiting() -> None:
            progress.console.print(COMPILING)

        def started(one: Study) -> None:
            progress.update(bar, completed=chosen.index(one), description=f"{one.NUMBER}  {one.TITLE}")

        def resumed(done: int) -> None:
            progress.console.print(f"going on in {folder}: {done} of {len(chosen)} are measured already")

        runs = Runs(seeds, waiting)
        done = measure(chosen, runs, folder, command=command, force=force, started=started, resumed=resumed)
    _tell(screen, done, folder)


def _tell(screen: Console, done: Sequence[Done], folder: Path) -> None:
    from palpate.report.page import Table

    claims = [claim for one in done for claim in one.claims]
    rows = [(claim.id, claim.thesis, claim.measured, claim.verdict) for claim in claims]
    table = Table("", ("claim", "thesis", "measured", "verdict"), rows)
    show_table(screen, table, [COLORS[claim.verdict] for claim in claims])
    place(screen, "page:", folder / "index.html")
