"""`palpate live`: a page in the browser, of an arm that presses or of a log that is played again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from palpate.cli._arm_options import ArmOptions, FrameOptions
from palpate.cli._indenter_options import IndenterOptions
from palpate.cli._log_options import LogOptions
from palpate.cli._terminal import print_lines, say
from palpate.cli.identify import ModelOptions
from palpate.cli.run import whole_number
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.live.player import Player
    from palpate.live.view import Source

_FLAG = Parameter(negative=())
_SHOWN = Group("What is shown", sort_key=0)
_SERVED = Group("How it is served", sort_key=7)
_DEFAULT = "foam-hybrid"


# More than seven arguments: each is an option with a name of its own.
def live(
    *,
    run: Annotated[str | None, Parameter(group=_SHOWN)] = None,
    log: Annotated[Path | None, Parameter(group=_SHOWN)] = None,
    record: Annotated[Path | None, Parameter(group=_SHOWN)] = None,
    seed: Annotated[int, Parameter(group=_SHOWN, converter=whole_number)] = 0,
    whole_approach: Annotated[bool, _FLAG, Parameter(group=_SHOWN)] = False,
    port: Annotated[int, Parameter(group=_SERVED, allow_leading_hyphen=True)] = 0,
    open_: Annotated[bool, _FLAG, Parameter(name="--open", group=_SERVED)] = False,
    foxglove: Annotated[bool, _FLAG, Parameter(group=_SERVED)] = False,
    foxglove_port: Annotated[int, Parameter(group=_SERVED, allow_leading_hyphen=True)] = 8765,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
) -> int:
    """Show an arm that presses, or a log, in a page of the browser; Ctrl-C ends it.

    palpate live

    palpate live --run rubber-hybrid --seed 3

    palpate live --record runs/foam-hybrid-1/record.parquet

    palpate live --log press.csv --time time_s --position position_mm:mm --force force_mN:mN

    The first line printed is the page's address. It is for this machine alone, works without a network, and is
    secret: nobody is answered who does not know it.

    Parameters
    ----------
    run
        An experiment to simulate at real time (palpate run --list), or a TOML file of one's own; foam-hybrid if
        nothing is named.
    log
        A log to play again, its columns named as for palpate identify.
    record
        A record of a run, or a bag (MCAP) with one wrench and one pose, which need no names.
    seed
        Of a simulation's noise.
    whole_approach
        Begin at the very start of the search for the surface, not shortly before the touch.
    port
        To serve the page on; a free one is found if not given, or 0.
    open_
        Open the page in the browser.
    foxglove
        Serve Foxglove, Lichtblick and PlotJuggler too.
    foxglove_port
        Where those connect to.
    """
    named = [
        name for name, value in (("--run", run), ("--log", log), ("--record", record)) if value is not None
    ]
    if len(named) > 1:
        raise InputError(f"{' and '.join(named)} are different things to show; give one of them")
    if log is None and record is None:
        shown: Source = _simulation(run or _DEFAULT, seed, whole_approach)
    else:
        from palpate.cli._one_log import OneLog

        path = log or record
        assert path is not None
        asked = OneLog(
            source or LogOptions(),
            frame or FrameOptions(),
            arm or ArmOptions(),
            fitted or ModelOptions(),
            IndenterOptions(),
        )
        if record is not None and not asked.source.plain:
            raise InputError(
                "a record names its own columns; give --log FILE with --time, --position, --force"
            )
        shown = _replay(path, asked, whole_approach)
    return _serve(shown, port, open_, foxglove_port if foxglove else None)


def _simulation(name: str, seed: int, whole: bool) -> Source:
    from palpate.bench.experiments.tables import load
    from palpate.cli._waiting import COMPILING
    from palpate.live.simulation import Simulation

    experiment = load(name)
    try:
        return Simulation(name, experiment, seed, whole=whole, waiting=lambda: say(COMPILING))
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _replay(path: Path, asked: Any, whole: bool) -> Source:
    from palpate.live.of_log import of_log
    from palpate.live.of_run import of_run
    from palpate.logs.own_runs import is_run

    found, along, source = asked.identified_along(path)
    if asked.source.plain and is_run(path):
        return of_run(path, found, whole=whole)
    return of_log(source.title, found, along)


def _serve(shown: Source, port: int, opened: bool, foxglove_port: int | None) -> int:
    from palpate.live.feed import Feed
    from palpate.live.player import Player
    from palpate.live.server import served

    with _stability(shown) as (changed, latest, tell):
        player = Player(shown, Feed(), changed, latest)
        tell.append(player.news)
        with player, served(player, port) as address, _viewers(player, foxglove_port) as more:
            print_lines(str(address), *more)
            if opened:
                import webbrowser

                webbrowser.open(str(address))
            changed()
            player.wait()
    return 0


@contextmanager
def _stability(shown: Source) -> Iterator[tuple[Any, Any, list[Any]]]:
    """What is known of the loop's stability, beside a simulation; a log has no loop."""
    from palpate.live.simulation import Simulation
    from palpate.live.stability import Stability

    tell: list[Any] = []
    if not isinstance(shown, Simulation):
        yield (lambda: None), (lambda: None), tell
        return

    def told() -> None:
        for one in tell:
            one()

    own = Stability(told)
    try:
        yield (lambda: own.ask(shown.experiment)), (lambda: own.latest), tell
    finally:
        own.close()


def _viewers(player: Player, port: int | None) -> Any:
    if port is None:
        return nullcontext(())
    from palpate.live.foxglove import viewers

    return viewers(player, port)
