"""`palpate thesis`: every figure and every claim of the thesis, measured again."""

from __future__ import annotations

from dataclasses import replace as changed
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter, validators

from palpate.cli.options.common import WRITTEN, FigureOptions
from palpate.cli.toolkit import COMPILING, bar, console, option_of, place, print_lines, say, show_table
from palpate.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from palpate_thesis.claims import Done
    from palpate_thesis.figure import FigureModule
    from palpate_thesis.measure import MeasurementFormat
    from palpate_thesis.runs import Runs

EXPERIMENTS = ("4.2", "4.4", "6.")
"""Beginnings of the numbers of the figures that show the thesis' own experiments."""
COLORS = {"reproduced": "green", "differs": "yellow", "not checkable": "bright_black"}


_MEASURED = Group("Measurement", sort_key=1)


def thesis(
    figure: str | None = None,
    /,
    *,
    laboratory: Annotated[str, Parameter(group=_MEASURED)] = "bench",
    seeds: Annotated[int, Parameter(group=_MEASURED, validator=validators.Number(gte=10, lte=1000))] = 10,
    list_: Annotated[bool, Parameter(group=_MEASURED, name="--list", negative="")] = False,
    out: Annotated[Path | None, Parameter(group=WRITTEN)] = None,
    replace: Annotated[bool, Parameter(group=WRITTEN, negative=())] = False,
    drawn: FigureOptions | None = None,
) -> int:
    """Measure every figure and every claim of the thesis again.

    Each claim has its threshold, our value, its spread over the seeds, a verdict and a reason.

    palpate thesis 6.11 --out runs/thesis-6.11

    palpate thesis --list

    Parameters
    ----------
    figure
        The number of one figure, "6.11", or the name of one explanation; all of them when left out.
    laboratory
        "bench", chosen by hand; "inferred" from the thesis; or a TOML file as `palpate laboratory` writes. In the
        latter two, only the figures of the thesis' own experiments are measured.
    seeds
        Noise seeds for every measured claim.
    list_
        List figures and explanations and stop.
    out
        Folder for claims.json, index.html and the figures; runs/thesis or runs/thesis-FIGURE when left out. An
        unfinished measurement there is resumed.
    replace
        Replace an existing measurement.
    """
    from palpate_thesis.claims import texts
    from palpate_thesis.figure import studies
    from palpate_thesis.measure import MeasurementFormat
    from palpate_thesis.runs import HandChosen, Runs

    if list_:
        numbers = [known.NUMBER for known in studies()]
        width = 2 + max(map(len, numbers))
        for number in numbers:
            print_lines(f"{number:<{width}}{texts(number)[0]}")
        return 0
    drawn = drawn or FigureOptions()
    drawn.check()
    lab = HandChosen() if laboratory == "bench" else option_of("laboratory", "laboratory")(laboratory)
    chosen = _studies_to_measure(figure, laboratory, in_all=lab.chosen)
    parts = ["thesis", figure, None if lab.chosen else Path(laboratory).stem]
    folder = out if out is not None else Path("runs") / "-".join(part for part in parts if part)
    where = "" if lab.chosen else f" --laboratory {laboratory}"
    command = f"palpate thesis{'' if figure is None else ' ' + figure}{where} --seeds {seeds}"
    try:
        written = MeasurementFormat(command, drawn.endings, drawn.dpi)
        _measure(chosen, folder, Runs(range(seeds), laboratory=lab), written, replace)
    except KeyboardInterrupt:
        say(f"interrupted; the measured claims are saved in {folder}; the same command resumes")
        return 130
    return 0


def _studies_to_measure(figure: str | None, laboratory: str, *, in_all: bool) -> Sequence[FigureModule]:
    """The figures to measure: all, or one; in another laboratory those that it was inferred from."""
    from palpate_thesis.figure import studies, study

    if in_all:
        return studies() if figure is None else [study(figure)]
    known = {s.NUMBER for s in studies() if s.NUMBER.startswith(EXPERIMENTS)}
    if figure is not None and study(figure).NUMBER not in known:
        raise InputError(
            f"figure {figure} tells nothing of the thesis' own laboratory; leave out --laboratory {laboratory}, or "
            f"choose one of {', '.join(s.NUMBER for s in studies() if s.NUMBER in known)}"
        )
    return [s for s in studies() if s.NUMBER in known and figure in (None, s.NUMBER)]


def _measure(
    chosen: Sequence[FigureModule], folder: Path, runs: Runs, written: MeasurementFormat, replace: bool
) -> None:
    from rich.progress import MofNCompleteColumn, TimeElapsedColumn

    from palpate_thesis.claims import texts
    from palpate_thesis.measure import measure

    screen = console()
    with bar(screen, MofNCompleteColumn(), TimeElapsedColumn()) as progress:
        task = progress.add_task("", total=len(chosen))

        def start_study(one: FigureModule) -> None:
            told = f"{one.NUMBER}  {texts(one.NUMBER)[0]}"
            progress.update(task, completed=chosen.index(one), description=told)

        def say_resumed(done: int) -> None:
            screen.print(f"resuming in {folder}: {done} of {len(chosen)} are measured already")

        runs = changed(runs, waiting=partial(screen.print, COMPILING))
        done = measure(
            chosen, runs, folder, written=written, replace=replace, started=start_study, resumed=say_resumed
        )
    _show(screen, done, folder)


def _show(screen: Console, done: Sequence[Done], folder: Path) -> None:
    from palpate.report.page import Table
    from palpate_thesis.claims import count_in_words, rows_of

    claims = rows_of(done)
    rows = [(claim.id, claim.thesis, claim.measured, claim.verdict) for claim in claims]
    table = Table("", ("claim", "thesis", "measured", "verdict"), rows)
    show_table(screen, table, [COLORS[claim.verdict] for claim in claims])
    screen.print(count_in_words(claims))
    place(screen, "page:", folder / "index.html")
