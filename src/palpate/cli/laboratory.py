"""`palpate laboratory`: the laboratory under which most of the thesis' own sentences are true at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, validators

from palpate.cli._answer import print_answer
from palpate.cli._terminal import console, place, say, show_table
from palpate.cli.study import Lines

if TYPE_CHECKING:
    from rich.console import Console

    from palpate.thesis.inference.kept import Progress as Told
    from palpate.thesis.inference.result import Result
    from palpate.thesis.inference.search import Runner


# More than seven arguments: each is a flag of the command.
def laboratory(
    *,
    out: Path = Path("runs/laboratory"),
    particles: Annotated[int, Parameter(validator=validators.Number(gte=8, lte=100_000))] = 128,
    moves: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=1000))] = 2,
    seed: Annotated[int, Parameter(validator=validators.Number(gte=0, lte=2**31 - 1))] = 1,
    cores: Annotated[int | None, Parameter(validator=validators.Number(gte=1, lte=1024))] = None,
    half: Annotated[bool, Parameter(negative="")] = False,
    scheduler: str | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Infer what the thesis does not tell of its laboratory: once from half of its figures, once from all.

    palpate laboratory --particles 32 --half --out runs/laboratory

    Args:
        out: folder for the laboratory, the page and every laboratory that was tried. An unfinished inference there is
            gone on with.
        particles: points of the posterior; it begins with four times as many of the prior.
        moves: of each particle at each temperature; three times as many at the last.
        seed: of everything drawn.
        cores: that try laboratories side by side; all when left out.
        half: search by the calibration half alone, in a third of the time; what it finds is looked at by all.
        scheduler: address of a Dask scheduler whose workers try them, tcp://HOST:PORT. What they send back may run
            anything here: name only a cluster that is trusted as this machine is.
        force: replace the inference that stands there already.
        json: print what was found as JSON and nothing else.
    """
    from palpate.bench.speed import cores as all_cores
    from palpate.thesis.inference.infer import Inference
    from palpate.thesis.inference.result import as_json as numbers
    from palpate.thesis.inference.sampler import Settings

    command = (
        f"palpate laboratory --particles {particles} --moves {moves} --seed {seed}{' --half' if half else ''}"
    )
    threads = cores or all_cores()
    screen = console(stderr=True)
    try:
        with _runner(scheduler, threads) as runner, _progress(screen) as told:
            settings = Settings(particles + particles % 2, moves=moves, seed=seed)
            result = Inference(out, settings, runner, command, threads, half, told).run(force=force)
    except KeyboardInterrupt:
        say(f"interrupted; what is tried is saved in {out}, and the same command goes on from there")
        return 130
    _tell(result, out, {"seed": seed, **numbers(result, command)} if json else None)
    return 0


@contextmanager
def _runner(scheduler: str | None, threads: int) -> Iterator[Runner]:
    from palpate.thesis.inference.search import Threads, Workers

    if scheduler is None:
        yield Threads(threads)
        return
    from palpate.studies.cluster import Cluster

    cluster = Cluster(scheduler)
    try:
        yield Workers(cluster)
    finally:
        cluster.close()


@contextmanager
def _progress(screen: Console) -> Iterator[Told]:
    """A bar for each part of the work, with the time left in it; without a terminal a line now and then."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    watched = screen.is_terminal
    with Progress(*columns, console=screen, transient=True, disable=not watched) as progress:
        bar = progress.add_task("compiling", total=None)
        parts: dict[str, Lines] = {}

        def told(what: str, done: int, of: int) -> None:
            if what not in parts:
                parts[what] = Lines(screen, of, f"in {what}")
                progress.reset(bar, total=of, description=what)
            progress.update(bar, completed=done)
            if not watched:
                parts[what].show(done)

        yield told


def _tell(result: Result, folder: Path, found: Mapping[str, Any] | None) -> None:
    from palpate.report.page import Table
    from palpate.thesis.inference.findings import PAGE
    from palpate.thesis.inference.result import halves, laboratories

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
