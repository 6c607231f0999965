"""Limits of a server's connections, so that idle or hostile ones take no place from a page.

A connection waits until its stream begins: while it sends its request, and while it receives the page. If too many
wait, the oldest is dropped for a new one. The number of connections from one address is limited, streams included.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from functools import cache
from typing import Any

MAX_WAITING = 64
"""Number of connections that may wait; the descriptors of a process are few, 256 on some systems."""


class ConnectionLimits:
    """Connections of one server; only the thread of its event loop uses them.

    Args:
        per_address: maximum from one address; None for any number.
    """

    def __init__(self, per_address: int | None):
        self._per_address = per_address
        self._count: Counter[str] = Counter()
        self._waiting: dict[asyncio.Transport, None] = {}

    def admit(self, transport: asyncio.Transport) -> bool:
        """Let a connection wait, and drop the oldest if too many wait; False if its address has too many."""
        address = _address_of(transport)
        if self._per_address is not None and self._count[address] >= self._per_address:
            return False
        self._count[address] += 1
        self._waiting[transport] = None
        if len(self._waiting) > MAX_WAITING:
            oldest = next(iter(self._waiting))
            del self._waiting[oldest]
            oldest.abort()
        return True

    def begin_stream(self, transport: asyncio.Transport) -> None:
        """Note that a connection's stream has begun: it waits no longer."""
        self._waiting.pop(transport, None)

    def remove(self, transport: asyncio.Transport) -> None:
        """Forget an admitted connection that has ended."""
        address = _address_of(transport)
        self._waiting.pop(transport, None)
        self._count[address] -= 1
        if not self._count[address]:
            del self._count[address]

    def drop_waiting(self) -> None:
        """End all connections that wait, so that none delays the end of the server."""
        for transport in list(self._waiting):
            transport.abort()


@cache
def limited_connection() -> Callable[..., Any]:
    """Class of a server's connections; its first argument is a `ConnectionLimits`."""
    from websockets.asyncio.server import ServerConnection

    class LimitedConnection(ServerConnection):
        def __init__(self, limits: ConnectionLimits, *words: Any, **options: Any):
            super().__init__(*words, **options)
            self._limits, self._admitted = limits, False

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            assert isinstance(transport, asyncio.Transport)
            self._admitted = self._limits.admit(transport)
            if self._admitted:
                super().connection_made(transport)
            else:
                transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            if self._admitted:
                self._limits.remove(self.transport)
                super().connection_lost(exc)

    return LimitedConnection


def _address_of(transport: asyncio.Transport) -> str:
    """Address of the other end; empty if the connection has ended."""
    peer = transport.get_extra_info("peername")
    return str(peer[0]) if peer else ""
