"""`palpate laboratory`: the laboratory under which most of the thesis' own sentences are true at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, validators

from palpate.cli.options.common import FolderOptions
from palpate.cli.options.values import FLAG, options
from palpate.cli.toolkit import console, place, print_answer, progress_of_pieces, say, show_table

if TYPE_CHECKING:
    from palpate_laboratory.result import InferenceResult
    from palpate_laboratory.search import Runner


def _within(least: int, most: int) -> Parameter:
    return Parameter(validator=validators.Number(gte=least, lte=most))


@options("The search", 1)
class SearchOptions:
    """Size of the search."""

    particles: Annotated[int, _within(8, 100_000)] = 128
    "Points of the posterior; it begins with four times as many of the prior."
    moves: Annotated[int, _within(1, 1000)] = 2
    "Of each particle at each temperature; three times as many at the last."
    seed: Annotated[int, _within(0, 2**31 - 1)] = 1
    "Of everything drawn."
    half: Annotated[bool, FLAG] = False
    "Search by the calibration half alone, in a third of the time; the result is judged by all."

    @property
    def command(self) -> str:
        """The command line of a search of this size."""
        half = " --half" if self.half else ""
        return (
            f"palpate laboratory --particles {self.particles} --moves {self.moves} --seed {self.seed}{half}"
        )


@options("Who tries", 2)
class RunnerOptions:
    """Cores or a cluster for the search."""

    cores: Annotated[int | None, _within(1, 1024)] = None
    "That try laboratories in parallel; all when left out."
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers try them, tcp://HOST:PORT. Their answers can execute code
    here: name only a cluster that you trust as this machine."""


@options("Output", 3)
class InferredOptions(FolderOptions):
    """Where the inferred laboratory is written."""

    out: Path = Path("runs/laboratory")
    """Folder for the laboratory, the page and every laboratory that was tried. An unfinished inference there
    is resumed."""


def laboratory(
    *,
    search: SearchOptions | None = None,
    who: RunnerOptions | None = None,
    output: InferredOptions | None = None,
) -> int:
    """Infer the thesis' laboratory from its own sentences; resumable.

    Its unstated parameters are inferred once from half of its figures, once from all.

    palpate laboratory --particles 32 --half --out runs/laboratory
    """
    from palpate.bench.speed import cores as all_cores
    from palpate_laboratory.infer import Inference
    from palpate_laboratory.result import as_json as numbers
    from palpate_laboratory.sampler import Settings

    search, who, output = search or SearchOptions(), who or RunnerOptions(), output or InferredOptions()
    command, out, threads = search.command, output.out, who.cores or all_cores()
    settings = Settings(search.particles + search.particles % 2, moves=search.moves, seed=search.seed)
    try:
        with _runner(who.scheduler, threads) as runner, progress_of_pieces(console(stderr=True)) as told:
            inference = Inference(out, settings, runner, command, threads, search.half, told)
            result = inference.run(replace=output.replace)
    except KeyboardInterrupt:
        say(f"interrupted; the tried laboratories are saved in {out}; the same command resumes")
        return 130
    _show(result, out, {"seed": search.seed, **numbers(result, command)} if output.json else None)
    return 0


@contextmanager
def _runner(scheduler: str | None, threads: int) -> Iterator[Runner]:
    from palpate_laboratory.search import Threads, Workers

    if scheduler is None:
        yield Threads(threads)
        return
    from palpate_studies.cluster import Cluster

    cluster = Cluster(scheduler)
    try:
        yield Workers(cluster)
    finally:
        cluster.close()


def _show(result: InferenceResult, folder: Path, found: Mapping[str, Any] | None) -> None:
    from palpate.report.page import Table
    from palpate_laboratory.findings import PAGE
    from palpate_laboratory.result import halves, laboratories

    if found is not None:
        print_answer(found)
        return
    screen = console()
    rows = [
        (name, *(f"{one.count(of)} of {len(of)}" for of in halves().values()))
        for name, one in laboratories(result).items()
    ]
    show_table(screen, Table("", ("laboratory", "calibration", "validation", "all"), rows))
    place(screen, "laboratory:", folder / "inferred.toml")
    place(screen, "page:", folder / PAGE)
