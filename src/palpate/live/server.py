"""The server of the page, by a secret address: one that steers, for this machine alone, and one that only watches."""

from __future__ import annotations

import asyncio
import errno
import logging
import re
import secrets
import threading
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from functools import partial
from http import HTTPMethod, HTTPStatus
from typing import TYPE_CHECKING, Any

import msgspec

from palpate.errors import InputError
from palpate.live.connections import ConnectionLimits, limited_connection
from palpate.live.player import Player, Request, page_response

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request as HttpRequest
    from websockets.http11 import Response

HOST = "127.0.0.1"
READERS, AUDIENCE = 16, 100
"""Maximum number of pages: that steer, and that watch a lecture."""
PER_ADDRESS = 6
"""Connections from one address of an audience: the pages of one telephone, reloaded."""
REQUEST_TIMEOUT = 5.0
"""How long a request and its answer may take [s]; an idle connection is dropped after it."""
ALIVE_TIMEOUT = 10.0
"""How long a page may take to answer a ping, or to take a message [s]; it is asked as often."""
_MAX_MESSAGE = 4096
"""Maximum size of a message from a page [bytes]."""
_OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?\Z")
_START_TIMEOUT = 30.0
"""Time within which the server listens [s]."""
_LOG = logging.getLogger("palpate.live")
_LOG.setLevel(logging.CRITICAL + 1)  # websockets logs each page that ends without a word


@dataclass(frozen=True)
class Address:
    """Address of a server.

    Args:
        port: number.
        token: secret part; requests without it are refused.
        host: address of this machine.
    """

    port: int
    token: str
    host: str = HOST

    def __str__(self) -> str:
        return f"http://{self.host}:{self.port}/{self.token}/"


class PageServer:
    """The page and the stream of its rows: the event loop of a thread, started by `with`, which returns the address.

    A request is refused that names another host, lacks the token, or is made by a page of another origin.

    Args:
        player: source of the rows.
        port: to listen on; 0 takes a free one.
        host: address of this machine to listen on.
        steers: True if its pages may steer the player, False if they only watch.

    Raises:
        InputError: the port is in use, or may not be taken.
    """

    def __init__(self, player: Player, port: int = 0, host: str = HOST, *, steers: bool = True):
        if not 0 <= port <= 65535:
            raise InputError(f"--port must be from 0 to 65535, got {port}")
        self._player, self._port, self._host, self._steers = player, port, host, steers
        self._max_readers = READERS if steers else AUDIENCE
        self._limits = ConnectionLimits(None if steers else PER_ADDRESS)
        self._token = secrets.token_urlsafe(18)
        self._ready = threading.Event()
        self._refused: OSError | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end: asyncio.Event | None = None
        self._readers: set[asyncio.Event] = set()
        self._page_headers, self._page = page_response(player.source.view)
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
        if self._loop is not None and self._end is not None:
            with suppress(RuntimeError):  # the loop has ended by itself
                self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()

    def _address(self) -> Address:
        """Address of the server once it listens."""
        self._ready.wait(_START_TIMEOUT)
        if self._refused is not None:
            why = {
                errno.EADDRINUSE: "is in use by another program",
                errno.EACCES: "may only be taken by the system's administrator",
            }.get(self._refused.errno or 0, f"cannot be taken ({self._refused.strerror or self._refused})")
            raise InputError(
                f"port {self._port} {why}; name another with --port; 0 takes a free one"
            ) from None
        return Address(self._port, self._token, self._host)

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        options: dict[str, Any] = {
            "process_request": self._refuse_or_answer,
            "create_connection": partial(limited_connection(), self._limits),
            "compression": None,
            "max_size": _MAX_MESSAGE,
            "open_timeout": REQUEST_TIMEOUT,
            "ping_interval": ALIVE_TIMEOUT,
            "ping_timeout": ALIVE_TIMEOUT,
            "close_timeout": 1,
            "server_header": None,
            "logger": _LOG,
        }
        async with AsyncExitStack() as stack:
            try:
                server = await stack.enter_async_context(
                    serve(self._reader, self._host, self._port, **options)
                )
            except OSError as error:
                self._refused = error
                self._ready.set()
                return
            self._port = next(iter(server.sockets)).getsockname()[1]
            unlisten = self._player.feed.listen(self._notify)
            self._ready.set()
            try:
                await self._end.wait()
            finally:
                unlisten()
                self._limits.drop_waiting()

    def _notify(self) -> None:
        """Wake all readers; called by the player's thread."""
        assert self._loop is not None
        with suppress(RuntimeError):  # the loop has just ended
            self._loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        for reader in self._readers:
            reader.set()

    def _refuse_or_answer(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Refusal of a request, or the page; None to begin the stream."""
        if request.method != "GET":
            return _refuse_method(connection, request.method)
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page is for this machine only\n")
        token, _, rest = request.path.removeprefix("/").partition("/")
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            return connection.respond(
                HTTPStatus.FORBIDDEN,
                "this address lacks its token; use the full address that palpate printed\n",
            )
        if rest != "stream":
            return self._answer(connection, rest)
        if not set(request.headers.get_all("Origin")) <= {f"http://{hosts[0]}"}:
            return connection.respond(HTTPStatus.FORBIDDEN, "other pages may not read this\n")
        if len(self._readers) >= self._max_readers:
            return connection.respond(
                HTTPStatus.SERVICE_UNAVAILABLE, f"{self._max_readers} pages are open already\n"
            )
        return None

    def _is_own(self, host: str) -> bool:
        """True for a name of this server, which no other page can have resolved to this machine."""
        return bool(self._host == HOST and _OWN_HOST.match(host)) or host == f"{self._host}:{self._port}"

    def _answer(self, connection: ServerConnection, rest: str) -> Response:
        """The page, or the refusal of any other path behind the token."""
        if rest:
            return connection.respond(HTTPStatus.NOT_FOUND, "there is only the one page\n")
        response = connection.respond(HTTPStatus.OK, "")
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers.update({**self._page_headers, "Content-Length": str(len(self._page))})
        response.body = self._page
        return response

    async def _reader(self, connection: ServerConnection) -> None:
        """Send one page all rows, and obey its requests, until it has gone."""
        from websockets.exceptions import ConnectionClosed

        news = asyncio.Event()
        self._limits.begin_stream(connection.transport)
        self._readers.add(news)
        self._player.watch()
        sending = asyncio.create_task(self._send_or_drop(connection, news))
        try:
            with suppress(ConnectionClosed):  # a tab that dies, or a machine that sleeps
                async for message in connection:
                    await self._answer_request(connection, message)
        finally:
            sending.cancel()
            self._readers.discard(news)
            await asyncio.gather(sending, return_exceptions=True)

    async def _answer_request(self, connection: ServerConnection, message: str | bytes) -> None:
        """Obey a page's message, or send the reason why not."""
        refusal = self._request(message) if self._steers else "this page only watches"
        if refusal:
            await connection.send(_text("refused", why=refusal))

    def _request(self, message: str | bytes) -> str:
        """Hand a request to the player; returns the reason of a refusal, or ""."""
        try:
            request = msgspec.json.decode(message, type=Request)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
            return f"unknown request: {error}"
        return "" if self._player.ask(request) else "the request is too large"

    async def _send_or_drop(self, connection: ServerConnection, news: asyncio.Event) -> None:
        """Send new rows until the page takes no more, which ends its connection."""
        try:
            await self._send_news(connection, news)
        except TimeoutError:
            connection.transport.abort()

    async def _send_news(self, connection: ServerConnection, news: asyncio.Event) -> None:
        """Send new rows and states whenever `news` is set; a slow page loses rows."""

        async def send(message: str | bytes) -> None:
            async with asyncio.timeout(ALIVE_TIMEOUT):
                await connection.send(message)

        feed, epoch, count, version = self._player.feed, -1, 0, -1
        if not self._steers:
            await send(_text("watching"))
        while True:
            news.clear()
            before = epoch
            epoch, count, rows, lost = feed.since(epoch, count)
            if epoch != before:
                await send(_text("clear"))
            if lost:
                await send(_text("lost", rows=lost))
            description = self._player.description()
            if description["version"] != version:
                version = description["version"]
                await send(_text("state", **description))
            if len(rows):
                await send(rows.astype("<f8").tobytes())
            await news.wait()


def _refuse_method(connection: ServerConnection, method: str) -> Response:
    """405 for another method of HTTP, 501 for a word that is none."""
    if method not in HTTPMethod.__members__:
        return connection.respond(HTTPStatus.NOT_IMPLEMENTED, "this server knows GET alone\n")
    response = connection.respond(HTTPStatus.METHOD_NOT_ALLOWED, "this page is read by GET alone\n")
    response.headers["Allow"] = "GET"
    return response


def _text(kind: str, **more: Any) -> str:
    return msgspec.json.encode({"kind": kind, **more}).decode()
