"""`palpate laboratory`: the laboratory under which most of the thesis' own sentences are true at once."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter, validators

from palpate.cli.options.common import FolderOptions
from palpate.cli.options.values import FLAG, options
from palpate.cli.toolkit import console, place, print_answer, progress_of_pieces, say, show_table

if TYPE_CHECKING:
    from palpate_thesis.inference.search import SearchResult


def _within(least: int, most: int) -> Parameter:
    return Parameter(validator=validators.Number(gte=least, lte=most))


@options("The search", 1)
class SearchOptions:
    """Size of the search."""

    tries: Annotated[int, _within(16, 1_000_000)] = 400
    "Laboratories to try; the first quarter is drawn from the prior."
    seed: Annotated[int, _within(0, 2**31 - 1)] = 1
    "Seed of everything drawn."
    half: Annotated[bool, FLAG] = False
    "Search by the calibration half of the sentences alone; the result is judged by all."
    start: str | None = None
    "Laboratory that is tried first, by name or TOML file; the search starts from the prior when left out."
    cores: Annotated[int | None, _within(1, 1024)] = None
    "Number of laboratories tried in parallel; as many as there are cores when left out."


@options("Output", 3)
class InferredOptions(FolderOptions):
    """Where the inferred laboratory is written."""

    out: Path = Path("runs/laboratory")
    "Folder for the laboratory and every laboratory that was tried. An unfinished search there is resumed."


def laboratory(*, search: SearchOptions | None = None, output: InferredOptions | None = None) -> int:
    """Infer the thesis' laboratory from its own sentences; resumable.

    palpate laboratory --tries 400 --half --out runs/laboratory
    """
    from palpate.bench.speed import cores
    from palpate_thesis.inference.search import LaboratorySearch

    size, output = search or SearchOptions(), output or InferredOptions()
    start = f" --start {size.start}" if size.start else ""
    command = f"palpate laboratory --tries {size.tries} --seed {size.seed}{start}{' --half' * size.half}"
    threads = size.cores or cores()
    try:
        with progress_of_pieces(console(stderr=True)) as progress:
            settings = LaboratorySearch(
                output.out, command, size.tries, size.seed, size.half, size.start, threads, progress
            )
            result = settings.run(replace=output.replace)
    except KeyboardInterrupt:
        say(f"interrupted; the tried laboratories are saved in {output.out}; the same command resumes")
        return 130
    if output.json:
        print_answer({"command": command, "seed": size.seed, **result.as_json()})
    else:
        _show(result, output.out, size.half)
    return 0


def _show(result: "SearchResult", folder: Path, half: bool) -> None:
    from palpate.report.page import Table
    from palpate_thesis.inference.search import INFERRED
    from palpate_thesis.inference.sentences import halves

    rows = [
        (name, *(f"{lab.count_true(among)} of {len(among)}" for among in halves().values()))
        for name, lab in result.laboratories.items()
    ]
    validation = "validation (not searched)" if half else "validation (searched too)"
    screen = console()
    title = f"Sentences that are true, {result.tried} laboratories tried"
    show_table(screen, Table(title, ("laboratory", "calibration", validation, "all"), rows))
    by_unknown = [(name, str(len(ids)), ", ".join(ids)) for name, ids in result.sensitivity.items()]
    title = "Sentences whose truth changes with one unknown alone"
    show_table(screen, Table(title, ("unknown", "sentences", ""), by_unknown))
    for number, (_, ids) in enumerate(result.plausible, 1):
        place(screen, f"plausible-{number}, {', '.join(ids)}:", folder / f"plausible-{number}.toml")
    place(screen, "laboratory:", folder / INFERRED)
