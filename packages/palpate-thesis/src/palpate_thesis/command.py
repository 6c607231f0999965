"""`palpate thesis`: every figure and every claim of the thesis, measured again."""

from __future__ import annotations

from dataclasses import replace as changed
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter, validators

from palpate.cli.options.common import WRITTEN, FigureOptions
from palpate.cli.toolkit import COMPILING, console, place, print_lines, progress_of_pieces, say, show_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palpate_thesis.figure import FigureModule
    from palpate_thesis.measure import MeasurementFormat
    from palpate_thesis.runs import Runs

COLORS = ("green", "cyan", "yellow", "bright_black")
"""Of the verdicts, in their order."""
_MEASURED = Group("Measurement", sort_key=1)


def thesis(
    figure: str | None = None,
    /,
    *,
    laboratory: Annotated[str, Parameter(group=_MEASURED)] = "inferred",
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
        Where the thesis' own experiments are measured: "inferred" from its sentences, with all printed values;
        "bench", chosen by hand; or a TOML file as `palpate laboratory` writes. Other figures are of the bench.
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
    from palpate_thesis.figure import studies, study
    from palpate_thesis.laboratory import describe_laboratory, load_laboratory
    from palpate_thesis.measure import MeasurementFormat
    from palpate_thesis.printed_facts import count_contradictions
    from palpate_thesis.runs import Runs

    if list_:
        numbers = [entry.NUMBER for entry in studies()]
        width = 2 + max(map(len, numbers))
        for number in numbers:
            print_lines(f"{number:<{width}}{texts(number)[0]}")
        return 0
    drawn = drawn or FigureOptions()
    drawn.check()
    values = load_laboratory(laboratory)
    name = "" if laboratory == "inferred" else Path(laboratory).stem
    chosen = studies() if figure is None else [study(figure)]
    folder = out or Path("runs") / "-".join(part for part in ("thesis", figure, name) if part)
    option = f" --laboratory {laboratory}" if name else ""
    command = f"palpate thesis{f' {figure}' if figure else ''}{option} --seeds {seeds}"
    try:
        about = f"{describe_laboratory(laboratory)} {count_contradictions(values)}"
        written = MeasurementFormat(command, name or "inferred", drawn.endings, drawn.dpi, about)
        _measure(chosen, folder, Runs(range(seeds), laboratory=values), written, replace)
    except KeyboardInterrupt:
        say(f"interrupted; the measured claims are saved in {folder}; the same command resumes")
        return 130
    return 0


def _measure(
    chosen: Sequence[FigureModule], folder: Path, runs: Runs, written: MeasurementFormat, replace: bool
) -> None:
    """Measure with a progress bar, and print the claims."""
    from palpate.report.page import Table
    from palpate_thesis.claims import VERDICTS, count_in_words, texts
    from palpate_thesis.measure import measure

    screen, total = console(), len(chosen)
    with progress_of_pieces(console(stderr=True)) as progress:
        done = measure(
            chosen,
            changed(runs, waiting=partial(screen.print, COMPILING)),
            folder,
            written=written,
            replace=replace,
            started=lambda n: progress(f"{n.NUMBER}  {texts(n.NUMBER)[0]}", chosen.index(n), total),
            resumed=lambda n: screen.print(f"resuming in {folder}: {n} of {total} are measured already"),
        )
    claims = [claim for study in done for claim in study.claims]
    rows = [(claim.id, claim.thesis, claim.measured, claim.verdict) for claim in claims]
    for line in count_in_words(claims):
        screen.print(line)
    screen.print(written.about)
    if rows:
        table = Table("", ("claim", "thesis", "measured", "verdict"), rows)
        show_table(screen, table, [COLORS[VERDICTS.index(claim.verdict)] for claim in claims])
    for study in done if len(done) == 1 else ():
        for beside in study.tables:
            show_table(screen, beside)
    place(screen, "page:", folder / "index.html")
