"""`palpate thesis`: every figure and every claim of the thesis, measured again."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter, validators

from palpate.cli._terminal import console, place, print_lines, say, show_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from palpate.thesis.claims import Done
    from palpate.thesis.figure import Study

COLORS = {"reproduced": "green", "differs": "yellow", "not checkable": "bright_black"}


_MEASURED = Group("What is measured", sort_key=1)
_WRITTEN = Group("What is written", sort_key=6)


def thesis(
    figure: str | None = None,
    /,
    *,
    seeds: Annotated[int, Parameter(group=_MEASURED, validator=validators.Number(gte=10, lte=1000))] = 10,
    list_: Annotated[bool, Parameter(group=_MEASURED, name="--list", negative="")] = False,
    out: Annotated[Path | None, Parameter(group=_WRITTEN)] = None,
    force: Annotated[bool, Parameter(group=_WRITTEN, negative=())] = False,
) -> int:
    """Measure the thesis again: each figure, each claim, with spread over the seeds and a verdict.

    palpate thesis 6.11 --out runs/thesis-6.11

    palpate thesis --list

    Parameters
    ----------
    figure
        The number of one figure, "6.11", or the name of one explanation; all of them when left out.
    seeds
        Noise seeds for every measured claim.
    list_
        List figures and explanations and stop.
    out
        Folder for claims.json, index.html and the figures; runs/thesis or runs/thesis-FIGURE when left out. An
        unfinished measurement there is gone on with.
    force
        Replace the measurement that stands there already.
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
    from palpate.thesis.claims import rows_of

    claims = rows_of(done)
    rows = [(claim.id, claim.thesis, claim.measured, claim.verdict) for claim in claims]
    table = Table("", ("claim", "thesis", "measured", "verdict"), rows)
    show_table(screen, table, [COLORS[claim.verdict] for claim in claims])
    verdicts = Counter[str](claim.verdict for claim in claims)
    told = ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in COLORS)
    screen.print(f"{len(claims)} claims: {told}")
    place(screen, "page:", folder / "index.html")
