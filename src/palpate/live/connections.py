"""Connections whose stream has not begun, so that idle ones take no place from a page and do not delay the end.

A connection waits while it sends its request, and while it receives the page. If too many wait, the oldest is dropped.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import cache
from typing import Any

MAX_WAITING = 64
"""Number of connections that may wait; the descriptors of a process are few, 256 on some systems."""


class WaitingConnections:
    """Waiting connections of one server; only the thread of its event loop uses them."""

    def __init__(self) -> None:
        self._transports: dict[asyncio.BaseTransport, None] = {}

    def add(self, transport: asyncio.Transport) -> None:
        """Let a connection wait, and drop the oldest if too many wait."""
        self._transports[transport] = None
        if len(self._transports) > MAX_WAITING:
            oldest: Any = next(iter(self._transports))
            self.remove(oldest)
            oldest.abort()

    def remove(self, transport: asyncio.BaseTransport) -> None:
        """Forget a connection: its stream has begun, or it has ended."""
        self._transports.pop(transport, None)

    def drop_all(self) -> None:
        """End all connections that wait."""
        waiting: list[Any] = list(self._transports)
        for transport in waiting:
            transport.abort()


@cache
def waiting_connection() -> Callable[..., Any]:
    """Class of a server's connections; its first argument is a `WaitingConnections`."""
    from websockets.asyncio.server import ServerConnection

    class WaitingConnection(ServerConnection):
        def __init__(self, waiting: WaitingConnections, *words: Any, **options: Any):
            super().__init__(*words, **options)
            self._waiting = waiting

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            assert isinstance(transport, asyncio.Transport)
            self._waiting.add(transport)
            super().connection_made(transport)

        def connection_lost(self, exc: Exception | None) -> None:
            self._waiting.remove(self.transport)
            super().connection_lost(exc)

    return WaitingConnection
