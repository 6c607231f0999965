"""The server of the page, by a secret address: for this machine alone, or for its network to watch."""

from __future__ import annotations

import asyncio
import errno
import logging
import re
import secrets
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager, suppress
from dataclasses import dataclass
from http import HTTPStatus
from io import StringIO
from typing import TYPE_CHECKING, Any

import msgspec

from palpate.errors import InputError
from palpate_live.player import PAGE_HEADERS, Player, Request, page

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request as Asked
    from websockets.http11 import Response

HOST = "127.0.0.1"
READERS, SHARED_READERS = 16, 100
"""At once: on this machine; of a shared page, a lecture."""
_LARGEST = 4096
"""Of what a page may send in one message [bytes]."""
_OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?\Z")
_STARTING = 30.0
_LOG = logging.getLogger("palpate_live")
_LOG.setLevel(logging.CRITICAL + 1)  # of websockets: a reader that goes without a word is no news


@dataclass(frozen=True)
class Address:
    """Where a server is.

    Args:
        port: of this machine.
        token: requests without it are refused.
        scheme: `http`, or `ws` where there is no page.
        host: of this machine, on its network where the page is shared.
    """

    port: int
    token: str
    scheme: str = "http"
    host: str = HOST

    def __str__(self) -> str:
        return f"{self.scheme}://{self.host}:{self.port}/{self.token}/"


@contextmanager
def serve(player: Player, port: int = 0, host: str = HOST) -> Iterator[Address]:
    """Serves a player's page within the block, by a thread of its own.

    Args:
        player: source of the page's rows.
        port: to listen on; 0 takes a free one.
        host: this machine's address on its network to share the page there: the first page steers, others only watch.

    Raises:
        InputError: the port is in use, or may not be taken.
    """
    with _PageServer(player, port, "--port", host) as address:
        yield address


class GuardedServer(ABC):
    """A server on this machine whose readers know its token: the event loop of a thread, started by `with`.

    A request is refused whose host is not this machine, which lacks the token, or which a page of another origin makes.

    Args:
        player: source of the rows.
        port: to listen on; 0 takes a free one.
        option: that names the port on the command line.
        origin: of other pages that may read; "" for none.

    Raises:
        InputError: the port is in use, or may not be taken.
    """

    scheme = "http"
    subprotocols: tuple[str, ...] | None = None
    host = HOST
    most = READERS

    def __init__(self, player: Player, port: int, option: str, origin: str = ""):
        if not 0 <= port <= 65535:
            raise InputError(f"{option} must be from 0 to 65535, got {port}")
        self._player, self._port, self._option, self._origin = player, port, option, origin
        self._token = secrets.token_urlsafe(18)
        self._ready = threading.Event()
        self._refused: OSError | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ending: asyncio.Event | None = None
        self._readers: set[asyncio.Event] = set()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve()), name="live server", daemon=True
        )

    def __enter__(self) -> Address:
        self._thread.start()
        try:
            return self._address()
        except BaseException:
            self.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        if self._loop is not None and self._ending is not None:
            with suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join()

    def _address(self) -> Address:
        """Address of the server once it listens."""
        self._ready.wait(_STARTING)
        if self._refused is not None:
            remedy = f"name another with {self._option}; 0 takes a free one"
            why = {
                errno.EADDRINUSE: "is in use by another program",
                errno.EACCES: "may only be taken by the system's administrator",
            }.get(self._refused.errno or 0, f"cannot be taken ({self._refused.strerror or self._refused})")
            raise InputError(f"port {self._port} {why}; {remedy}") from None
        return Address(self._port, self._token, self.scheme, self.host)

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._ending = asyncio.get_running_loop(), asyncio.Event()
        options: dict[str, Any] = {
            "process_request": self._refuse_or_answer,
            "subprotocols": self.subprotocols,
            "compression": None,
            "max_size": _LARGEST,
            "close_timeout": 1,
            "server_header": None,
            "logger": _LOG,
        }
        async with AsyncExitStack() as held:
            try:
                server = await held.enter_async_context(serve(self._reader, self.host, self._port, **options))
            except OSError as error:
                self._refused = error
                self._ready.set()
                return
            self._port = next(iter(server.sockets)).getsockname()[1]
            silence = self._player.feed.listen(self._news)
            self._ready.set()
            try:
                await self._ending.wait()
            finally:
                silence()

    def _news(self) -> None:
        """Wakes all readers; called by the player's thread."""
        assert self._loop is not None
        with suppress(RuntimeError):  # the loop has just ended
            self._loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        for reader in self._readers:
            reader.set()

    def _refuse_or_answer(self, connection: ServerConnection, asked: Asked) -> Response | None:
        """Refuses requests without the token, by another host name, or of another page; answers what is no stream."""
        hosts = asked.headers.get_all("Host")
        if len(hosts) != 1 or not (_OWN_HOST.match(hosts[0]) or hosts[0] == f"{self.host}:{self._port}"):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page is for this machine only\n")
        token, _, rest = asked.path.removeprefix("/").partition("/")
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            return connection.respond(
                HTTPStatus.FORBIDDEN,
                "this address lacks its token; use the full address that palpate printed\n",
            )
        if not self._streams(rest):
            return self._answer(connection, rest)
        origins = asked.headers.get_all("Origin")
        if not set(origins) <= {f"http://{hosts[0]}", self._origin}:
            return connection.respond(HTTPStatus.FORBIDDEN, "other pages may not read this\n")
        if len(self._readers) >= self.most:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{self.most} pages are open already\n")
        return None

    def _streams(self, rest: str) -> bool:
        """Whether a path, behind the token, is that of the stream."""
        return not rest

    def _answer(self, connection: ServerConnection, rest: str) -> Response:
        """Answers any other path."""
        return connection.respond(HTTPStatus.NOT_FOUND, "there is only the one page\n")

    async def _reader(self, connection: ServerConnection) -> None:
        """Tells one reader all there is, and hears what it asks for, until it is gone."""
        from websockets.exceptions import ConnectionClosed

        news = asyncio.Event()
        self._readers.add(news)
        self._player.watch()
        telling = asyncio.create_task(self._send_news(connection, news))
        try:
            with suppress(ConnectionClosed):  # as a tab that dies, or a machine that sleeps
                async for message in connection:
                    await self._hear(connection, message)
        finally:
            telling.cancel()
            self._readers.discard(news)
            await asyncio.gather(telling, return_exceptions=True)

    @abstractmethod
    async def _hear(self, connection: ServerConnection, message: str | bytes) -> None:
        """Does what a reader asks for."""

    @abstractmethod
    async def _send_news(self, connection: ServerConnection, news: asyncio.Event) -> None:
        """Sends what is new, whenever `news` is set; a reader that takes it slowly finds older rows gone."""


class _PageServer(GuardedServer):
    """The page, and the stream of its rows; shared, only the first page that opens it steers.

    When that page is gone, the next one from its own machine does: a reload steers again, a stranger never.
    """

    def __init__(self, player: Player, port: int, option: str, host: str = HOST):
        super().__init__(player, port, option)
        self.host = host
        if host != HOST:
            self.most = SHARED_READERS
        self._first: ServerConnection | None = None
        self._machine: str | None = None
        self._page = page(player.source.view).encode()

    def _streams(self, rest: str) -> bool:
        return rest == "stream"

    def _answer(self, connection: ServerConnection, rest: str) -> Response:
        if rest:
            return super()._answer(connection, rest)
        response = connection.respond(HTTPStatus.OK, "")
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers.update({**PAGE_HEADERS, "Content-Length": str(len(self._page))})
        response.body = self._page
        return response

    def _steers(self, connection: ServerConnection) -> bool:
        """Whether a page may ask for anything; of a shared one the first, or the next of its machine."""
        if self.host == HOST or connection is self._first:
            return True
        machine = str(connection.remote_address[0])
        gone = self._first is None or self._first.close_code is not None
        if gone and self._machine in (None, machine):
            self._first, self._machine = connection, machine
            return True
        return False

    async def _hear(self, connection: ServerConnection, message: str | bytes) -> None:
        if not self._steers(connection):
            await connection.send(_text("refused", why="this page only watches; the first one steers"))
            return
        try:
            request = msgspec.json.decode(message, type=Request)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
            await connection.send(_text("refused", why=f"unknown request: {error}"))
            return
        if not self._player.ask(request):
            await connection.send(_text("refused", why="the request is too large"))

    async def _send_news(self, connection: ServerConnection, news: asyncio.Event) -> None:
        feed, epoch, count, version = self._player.feed, -1, 0, -1
        if not self._steers(connection):
            await connection.send(_text("watching"))
        while True:
            news.clear()
            before = epoch
            epoch, count, rows, lost = feed.since(epoch, count)
            if epoch != before:
                await connection.send(_text("clear"))
            if lost:
                await connection.send(_text("lost", rows=lost))
            told = self._player.description()
            if told["version"] != version:
                version = told["version"]
                await connection.send(_text("state", **told))
            if len(rows):
                await connection.send(rows.astype("<f8").tobytes())
            await news.wait()


def _text(kind: str, **more: Any) -> str:
    return msgspec.json.encode({"kind": kind, **more}).decode()


_ANYWHERE = ("192.0.2.1", 9)
"""An address of documentation (RFC 5737): asking for the way there sends nothing."""
WARNING = (
    "shared: everybody on this network who has the address can watch, and nothing is encrypted; the first page that "
    "opens it steers, all others only watch"
)


def network_address() -> str:
    """This machine's own address on its network.

    Raises:
        InputError: it is on none.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ANYWHERE)
            found = str(probe.getsockname()[0])
        except OSError:
            found = ""
    if not found or found.startswith("127.") or found == "0.0.0.0":  # noqa: S104 - compared, not listened on
        raise InputError("--share: this machine is on no network; connect it, or leave --share out")
    return found


def qr_code(text: str) -> str:
    """A text as a QR code of half-height blocks, for a terminal."""
    import segno

    drawn = StringIO()
    segno.make(text, error="l").terminal(drawn, compact=True)
    return drawn.getvalue()
