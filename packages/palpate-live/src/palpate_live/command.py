"""`palpate live`: a page in the browser with a pressing arm, or a replayed log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from palpate.cli.options.common import QUIET, Experiment, PluginOptions, SerialArm
from palpate.cli.options.log import ArmOptions, FrameOptions, LogOptions, ModelOptions
from palpate.cli.options.values import FLAG, SIGNED, WHOLE, options
from palpate.cli.toolkit import COMPILING, print_lines, say
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate_live.player import Player
    from palpate_live.view import RowSource

_DEFAULT = "foam-hybrid"


@options("Source", 0)
class ShownOptions:
    """A simulation, a log or a record."""

    run: Annotated[Experiment | None, QUIET] = None
    """An experiment to simulate in real time (palpate run --list), or your own TOML file; foam-hybrid if
    nothing is named."""
    arm_: Annotated[SerialArm | None, Parameter(name="--arm"), QUIET] = None
    """An arm to simulate in 3D with the cautious law: ur5e, fr3, panda, iiwa14, or a file as for palpate
    press."""
    log: Path | None = None
    "A log to replay, its columns named as for palpate identify."
    record: Path | None = None
    "A record of a run, or a bag (MCAP) with one wrench and one pose, which need no names."
    seed: Annotated[int, WHOLE] = 0
    "Of a simulation's noise."
    whole_approach: Annotated[bool, FLAG] = False
    "Begin at the start of the approach, not shortly before the touch."

    def file(self) -> Path | None:
        """The log or the record; None for a simulation.

        Raises:
            InputError: more than one thing is named.
        """
        given = (("--run", self.run), ("--arm", self.arm_), ("--log", self.log), ("--record", self.record))
        named = [name for name, value in given if value is not None]
        if len(named) > 1:
            raise InputError(f"{' and '.join(named)} exclude each other; give one of them")
        return self.log or self.record


@options("Server", 7)
class ServedOptions:
    """Ports for the browser and other viewers."""

    port: Annotated[int, SIGNED] = 0
    "Port of the page; a free one if not given, or 0."
    open_: Annotated[bool, FLAG, Parameter(name="--open")] = False
    "Open the page in the browser."
    share: Annotated[bool, FLAG] = False
    "Share the page on the network of this machine, for a lecture: the first page steers, others only watch."
    foxglove: Annotated[bool, FLAG] = False
    "Serve Foxglove, Lichtblick and PlotJuggler too."
    foxglove_port: Annotated[int, SIGNED] = 8765
    "Port of those viewers."
    foxglove_origin: str = ""
    "Origin of a viewer that is a web page, such as https://app.foxglove.dev; other pages are refused."


def live(
    *,
    shown: ShownOptions | None = None,
    own: PluginOptions | None = None,
    at: ServedOptions | None = None,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
) -> int:
    """Show a pressing arm, or a log, in the browser; Ctrl-C ends it.

    palpate live

    palpate live --run rubber-hybrid --seed 3

    palpate live --arm fr3

    palpate live --record runs/foam-hybrid-1/record.parquet

    palpate live --log press.csv --time time_s --position position_mm:mm --force force_mN:mN

    The first line printed is the page's address. It works on this machine only and without a network. It holds a
    secret token: requests without it are refused. --share prints the address on the network, and its QR code.
    """
    shown, at = shown or ShownOptions(), at or ServedOptions()
    path = shown.file()
    if shown.arm_ is not None:
        return show_live(_pressing(shown.arm_, shown.seed), at)
    if path is None:
        with (own or PluginOptions()).consent():
            return show_live(_simulation(shown.run or _DEFAULT, shown.seed, shown.whole_approach), at)
    from palpate.cli.identify import OneLog

    asked = OneLog(
        fitted or ModelOptions(), source or LogOptions(), frame or FrameOptions(), arm or ArmOptions()
    )
    if shown.record is not None and not asked.source.plain:
        raise InputError("a record states its own columns; use --log FILE with --time, --position, --force")
    return show_live(_replay(path, asked, shown.whole_approach), at)


def _simulation(name: str, seed: int, whole: bool) -> RowSource:
    from palpate.bench.tables import load
    from palpate_live.simulation import WatchedSimulation

    experiment = load(name)
    try:
        return WatchedSimulation(experiment, seed, whole=whole, waiting=lambda: say(COMPILING))
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _pressing(name: str, seed: int) -> RowSource:
    from palpate_live.pressing import PressingArm

    return PressingArm(name, seed, waiting=lambda: say(COMPILING))


def _replay(path: Path, asked: Any, whole: bool) -> RowSource:
    from palpate.logs.read import is_run
    from palpate_live.recorded_run import of_log, of_run

    found, along, source = asked.identification_along(path)
    if asked.source.plain and is_run(path):
        return of_run(path, found, whole=whole)
    return of_log(source.title, found, along)


def show_live(shown: RowSource, at: ServedOptions) -> int:
    """Serves a source of rows until Ctrl-C; the first line printed is the page's address."""
    from palpate_live.player import Feed, Player, made_ready
    from palpate_live.server import HOST, WARNING, network_address, qr_code, serve

    host = network_address() if at.share else HOST
    if at.share:
        say(WARNING)
    made_ready()
    with _stability(shown) as (changed, latest, tell):
        player = Player(shown, Feed(), changed, latest)
        tell.append(player.news)
        with player, serve(player, at.port, host) as address, _viewers(player, at) as more:
            print_lines(str(address), *more, *(qr_code(str(address)).splitlines() if at.share else ()))
            if at.open_:
                import webbrowser

                webbrowser.open(str(address))
            changed()
            player.wait()
    return 0


@contextmanager
def _stability(shown: RowSource) -> Iterator[tuple[Any, Any, list[Any]]]:
    """Stability of the loop of a simulation; a log has no loop."""
    from palpate_live.stability import Stability

    tell: list[Any] = []
    if shown.loop_asked is None:
        yield (lambda: None), (lambda: None), tell
        return

    def tell_all() -> None:
        for one in tell:
            one()

    own = Stability(tell_all)
    try:
        yield (lambda: own.ask(shown.loop_asked)), (lambda: own.latest), tell
    finally:
        own.close()


def _viewers(player: Player, at: ServedOptions) -> Any:
    if not at.foxglove:
        return nullcontext(())
    from palpate_live.foxglove import viewers

    return viewers(player, at.foxglove_port, at.foxglove_origin)
