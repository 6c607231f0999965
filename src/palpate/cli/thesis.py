"""`palpate thesis`: every figure and every claim of the thesis, measured again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter, validators

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from palpate.thesis.measuring import Done
    from palpate.thesis.study import Study

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
    from palpate.thesis.study import studies, study

    if list_:
        everything = studies()
        width = 2 + max(len(known.NUMBER) for known in everything)
        for known in everything:
            print(f"{known.NUMBER:<{width}}{known.TITLE}")  # noqa: T201
        return 0
    chosen = studies() if figure is None else [study(figure)]
    folder = out if out is not None else Path("runs") / ("thesis" if figure is None else f"thesis-{figure}")
    command = f"palpate thesis{'' if figure is None else ' ' + figure} --seeds {seeds}"
    _measure(chosen, folder, range(seeds), command, force)
    return 0


def _measure(chosen: Sequence[Study], folder: Path, seeds: Sequence[int], command: str, force: bool) -> None:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from palpate.cli._waiting import COMPILING
    from palpate.thesis.measuring import measure
    from palpate.thesis.runs import Runs

    console = Console()
    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("", total=len(chosen))

        def waiting() -> None:
            progress.console.print(COMPILING)

        def started(one: Study) -> None:
            progress.update(bar, completed=chosen.index(one), description=f"{one.NUMBER}  {one.TITLE}")

        done = measure(chosen, Runs(seeds, waiting), folder, command=command, force=force, started=started)
    _tell(console, done, folder)


def _tell(console: Console, done: Sequence[Done], folder: Path) -> None:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for head in ("claim", "thesis", "measured", "verdict"):
        table.add_column(head, overflow="fold")
    for claim in (c for d in done for c in d.claims):
        verdict = f"[{COLORS[claim.verdict]}]{claim.verdict}[/]"
        table.add_row(escape(claim.id), escape(claim.thesis), escape(claim.measured), verdict)
    console.print(table)
    console.print(f"page: {folder / 'index.html'}", soft_wrap=True, highlight=False)
