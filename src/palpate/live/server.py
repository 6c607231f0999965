"""The server of the page: this machine alone, by a secret address, and nothing else is served."""

from __future__ import annotations

import asyncio
import errno
import re
import secrets
import threading
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import msgspec

from palpate.errors import InputError
from palpate.live.page import PAGE_HEADERS, page
from palpate.live.player import Player, Request

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request as Asked
    from websockets.http11 import Response

HOST = "127.0.0.1"
READERS = 16
"""At once."""
_LARGEST = 4096
"""Of what a page may send in one message [bytes]."""
_OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?\Z")
_STARTING = 30.0


@dataclass(frozen=True)
class Address:
    """Where the page is.

    Args:
        port: of this machine.
        token: requests without it are refused.
    """

    port: int
    token: str

    def __str__(self) -> str:
        return f"http://{HOST}:{self.port}/{self.token}/"


@contextmanager
def served(player: Player, port: int = 0) -> Iterator[Address]:
    """Serves a player's page within the block, by a thread of its own.

    Args:
        player: source of the page's rows.
        port: to listen on; 0 takes a free one.

    Raises:
        InputError: the port is in use, or may not be taken; `websockets` is not installed.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"--port must be from 0 to 65535, got {port}")
    try:
        import websockets  # noqa: F401
    except ImportError:
        raise InputError('the live page needs websockets: pip install "palpate[live]"') from None
    server = _Server(player, port)
    thread = threading.Thread(target=server.run, name="live server", daemon=True)
    thread.start()
    try:
        yield server.address()
    finally:
        server.stop()
        thread.join()


class _Server:
    """The event loop of a thread, and those who read."""

    def __init__(self, player: Player, port: int):
        self._player, self._port = player, port
        self._token = secrets.token_urlsafe(18)
        self._ready = threading.Event()
        self._refused: OSError | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ending: asyncio.Event | None = None
        self._readers: set[asyncio.Event] = set()
        self._page = page(player.source.view).encode()

    def address(self) -> Address:
        """Once it listens.

        Raises:
            InputError: it cannot.
        """
        self._ready.wait(_STARTING)
        if self._refused is not None:
            remedy = "take another, or leave --port out, which finds a free one"
            why = {
                errno.EADDRINUSE: "is in use by another program",
                errno.EACCES: "may only be taken by the system's administrator",
            }.get(self._refused.errno or 0, f"cannot be taken ({self._refused.strerror or self._refused})")
            raise InputError(f"port {self._port} {why}; {remedy}") from None
        return Address(self._port, self._token)

    def run(self) -> None:
        """Serves until `stop`."""
        asyncio.run(self._serve())

    def stop(self) -> None:
        """Ends `run`, from another thread."""
        if self._loop is not None and self._ending is not None:
            try:
                self._loop.call_soon_threadsafe(self._ending.set)
            except RuntimeError:  # it has ended by itself
                return

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._ending = asyncio.get_running_loop(), asyncio.Event()
        options: dict[str, Any] = {
            "process_request": self._asked,
            "compression": None,
            "max_size": _LARGEST,
            "close_timeout": 1,
            "server_header": None,
        }
        async with AsyncExitStack() as held:
            try:
                server = await held.enter_async_context(serve(self._reader, HOST, self._port, **options))
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
        try:
            self._loop.call_soon_threadsafe(self._wake)
        except RuntimeError:  # the loop has just ended
            return

    def _wake(self) -> None:
        for reader in self._readers:
            reader.set()

    def _asked(self, connection: ServerConnection, asked: Asked) -> Response | None:
        """Answers requests other than the stream; refuses those without the token, or by another host name."""
        hosts = asked.headers.get_all("Host")
        if len(hosts) != 1 or not _OWN_HOST.match(hosts[0]):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page is for this machine only\n")
        token, _, rest = asked.path.removeprefix("/").partition("/")
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            return connection.respond(
                HTTPStatus.FORBIDDEN,
                "this address lacks its token; use the full address that palpate printed\n",
            )
        origin = asked.headers.get("Origin")
        if rest == "stream":
            if origin is not None and origin != f"http://{hosts[0]}":
                return connection.respond(HTTPStatus.FORBIDDEN, "other pages may not read this\n")
            if len(self._readers) >= READERS:
                return connection.respond(
                    HTTPStatus.SERVICE_UNAVAILABLE, f"{READERS} pages are open already\n"
                )
            return None
        if rest:
            return connection.respond(HTTPStatus.NOT_FOUND, "there is only the one page\n")
        response = connection.respond(HTTPStatus.OK, "")
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers.update({**PAGE_HEADERS, "Content-Length": str(len(self._page))})
        response.body = self._page
        return response

    async def _reader(self, connection: ServerConnection) -> None:
        """Tells one page all there is, and hears what it asks for, until it is gone."""
        news = asyncio.Event()
        self._readers.add(news)
        self._player.watch()
        telling = asyncio.create_task(self._send_news(connection, news))
        try:
            async for message in connection:
                await self._hear(connection, message)
        finally:
            telling.cancel()
            self._readers.discard(news)
            await asyncio.gather(telling, return_exceptions=True)

    async def _hear(self, connection: ServerConnection, message: str | bytes) -> None:
        try:
            request = msgspec.json.decode(message, type=Request)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
            await connection.send(_text("refused", why=f"unknown request: {error}"))
            return
        if not self._player.ask(request):
            await connection.send(_text("refused", why="the request is too large"))

    async def _send_news(self, connection: ServerConnection, news: asyncio.Event) -> None:
        """Sends what is new; a reader that takes it slowly finds older rows gone, for nothing waits in memory."""
        feed, epoch, count, version = self._player.feed, -1, 0, -1
        while True:
            news.clear()
            before = epoch
            epoch, count, rows, lost = feed.since(epoch, count)
            if epoch != before:
                await connection.send(_text("clear"))
            if lost:
                await connection.send(_text("lost", rows=lost))
            told = self._player.described()
            if told["version"] != version:
                version = told["version"]
                await connection.send(_text("state", **told))
            if len(rows):
                await connection.send(rows.astype("<f8").tobytes())
            await news.wait()


def _text(kind: str, **more: Any) -> str:
    return msgspec.json.encode({"kind": kind, **more}).decode()
