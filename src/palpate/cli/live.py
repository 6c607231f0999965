"""`palpate live`: a page in the browser with a pressing arm."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from palpate.cli.options.common import QUIET, Experiment, PluginOptions, SerialArm
from palpate.cli.options.values import FLAG, SIGNED, WHOLE, only, options
from palpate.cli.toolkit import COMPILING, print_lines, say
from palpate.errors import InputError, how_to_install

if TYPE_CHECKING:
    from palpate.live.player import Player
    from palpate.live.view import LiveSource

_DEFAULT = "foam-hybrid"


@options("Simulation", 0)
class SimulationOptions:
    """An experiment, or a serial arm."""

    run: Annotated[Experiment | None, QUIET] = None
    """An experiment to simulate in real time (palpate run --list), or your own TOML file; foam-hybrid if
    nothing is named."""
    arm_: Annotated[SerialArm | None, Parameter(name="--arm"), QUIET] = None
    """An arm to simulate in 3D with the cautious law: ur5e, fr3, panda, iiwa14, or a file as for palpate
    press."""
    seed: Annotated[int, WHOLE] = 0
    "Seed of the noise."
    whole_approach: Annotated[bool, FLAG] = False
    "Begin at the start of the approach, not shortly before the touch."


@options("Server", 7)
class ServedOptions:
    """Port and addresses of the page."""

    port: Annotated[int, SIGNED] = 0
    "Port of the page; a free one if not given, or 0."
    open_: Annotated[bool, FLAG, Parameter(name="--open")] = False
    "Open the page in the browser."
    share: Annotated[bool, FLAG] = False
    "Share the page on the network of this machine, for a lecture: its second address only watches."


def live(
    *,
    simulation: SimulationOptions | None = None,
    plugins: PluginOptions | None = None,
    at: ServedOptions | None = None,
) -> int:
    """Show a pressing arm in the browser; Ctrl-C ends it.

    palpate live

    palpate live --run rubber-hybrid --seed 3

    palpate live --arm fr3

    The first line printed is the page's address. It works on this machine only and without a network. It holds a
    secret token: requests without it are refused. --share prints a second address for the audience, which only
    watches, on the network, and its QR code.
    """
    simulation, plugins, at = (
        simulation or SimulationOptions(),
        plugins or PluginOptions(),
        at or ServedOptions(),
    )
    if simulation.arm_ is None:
        with plugins.consent():
            return show_live(_experiment(simulation), at)
    if simulation.run is not None:
        raise InputError("--run and --arm exclude each other; give one of them")
    only(plugins, "an experiment; name one with --run")
    if simulation.whole_approach:
        raise InputError("--whole-approach is for an experiment; name one with --run, or leave this out")
    from palpate.live.pressing import PressingArm

    return show_live(
        PressingArm(simulation.arm_, simulation.seed, before_compiling=lambda: say(COMPILING)), at
    )


def _experiment(simulation: SimulationOptions) -> LiveSource:
    from palpate.bench.tables import load
    from palpate.live.simulation import WatchedSimulation

    name = simulation.run or _DEFAULT
    experiment = load(name)
    try:
        return WatchedSimulation(
            experiment,
            simulation.seed,
            whole=simulation.whole_approach,
            before_compiling=lambda: say(COMPILING),
        )
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def show_live(source: LiveSource, at: ServedOptions) -> int:
    """Serve a simulation until Ctrl-C; the first line printed is the address of the page that steers."""
    if find_spec("websockets") is None or find_spec("segno") is None:
        raise InputError(f"the live page needs websockets and segno: {how_to_install('palpate[live]')}")
    from palpate.live.player import Feed, Player, load_late_imports
    from palpate.live.server import PageServer

    load_late_imports()
    with (
        Player(source, Feed()) as player,
        PageServer(player, at.port) as address,
        _audience(player, at) as lines,
    ):
        print_lines(str(address), *lines)
        if at.open_:
            import webbrowser

            webbrowser.open(str(address))
        player.wait()
    return 0


WARNING = (
    "shared: everybody on this network who has the audience's address can watch, and nothing is encrypted; only the "
    "first address steers, and it works on this machine alone"
)


@contextmanager
def _audience(player: Player, at: ServedOptions) -> Iterator[list[str]]:
    """Serve pages that only watch on the network if --share is given; yield the lines with their address."""
    if not at.share:
        yield []
        return
    from palpate.live.server import PageServer

    say(WARNING)
    with PageServer(player, at.port, network_address(), steers=False) as address:
        yield [f"audience, only watches: {address}", *qr_code(str(address)).splitlines()]


_ANYWHERE = ("192.0.2.1", 9)
"""An address reserved for documentation (RFC 5737): asking for the route to it sends nothing."""


def network_address() -> str:
    """This machine's own address on its network.

    Raises:
        InputError: it is on none.
    """
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ANYWHERE)
            address = str(probe.getsockname()[0])
        except OSError:
            address = ""
    if not address or address.startswith("127.") or address == "0.0.0.0":  # noqa: S104 - compared, not listened on
        raise InputError("--share: this machine is on no network; connect it, or leave --share out")
    return address


def qr_code(text: str) -> str:
    """A text as a QR code of half-height blocks, for a terminal."""
    from io import StringIO

    import segno

    picture = StringIO()
    segno.make(text, error="l").terminal(picture, compact=True)
    return picture.getvalue()
