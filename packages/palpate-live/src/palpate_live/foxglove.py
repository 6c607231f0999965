"""The same rows for the field's own viewers: Foxglove, Lichtblick and PlotJuggler, by Foxglove's protocol."""

from __future__ import annotations

import asyncio
import math
import re
import struct
from base64 import b64encode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import msgspec

from palpate.arrays import Array
from palpate.errors import InputError
from palpate_live.player import Player
from palpate_live.server import GuardedServer
from palpate_live.view import AT, COLUMNS, JOINTS, View

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

TOPIC = "/palpate/contact"
ARM = "/palpate/arm"
_UNITS = {
    "t": "s",
    "measured": "N",
    "force": "N",
    "desired": "N",
    "depth": "mm",
    "K": "N/m",
    "K_half": "N/m",
    "B": "N s/m",
    "B_half": "N s/m",
    "K_true": "N/m",
    "B_true": "N s/m",
    "wall": "m",
    "phase": "1",
    **{f"q{i}": "rad" for i in range(1, JOINTS + 1)},
}
_SECOND = 1_000_000_000
_MOST = 16
"""Subscriptions of a viewer."""


_KINDS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol: of Foxglove's newer viewers, and of the others."""
_CONTACT, _ARM = 1, 2
"""Numbers of the channels."""
_HEAD = struct.Struct("<BIQ")
"""Of a message: 1, the number of the subscription, nanoseconds."""
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[^/\s]*\Z")


@contextmanager
def viewers(player: Player, port: int, origin: str = "") -> Iterator[tuple[str, ...]]:
    """Serves viewers within the block; yields the line that says where.

    Args:
        player: whose rows they get: `TOPIC` in JSON, and the arm as line strips of a scene on `ARM`.
        port: of this machine; 0 takes a free one.
        origin: of a viewer that is a page, as https://app.foxglove.dev; any other page is refused.

    Raises:
        InputError: the port cannot be taken, the origin is none, or foxglove-sdk is not installed.
    """
    if origin and not _ORIGIN.match(origin):
        raise InputError(f"--foxglove-origin must be like https://app.foxglove.dev, got {origin!r}")
    try:
        import foxglove  # noqa: F401
    except ImportError:
        raise InputError('viewers need foxglove-sdk: pip install "palpate-live[foxglove]"') from None
    with _Viewers(player, port, "--foxglove-port", origin) as address:
        yield (f"viewers: {address}",)


class _Subscribe(msgspec.Struct, tag="subscribe", tag_field="op"):
    """Channels to send, each under a number of the viewer's."""

    subscriptions: list[dict[str, int]]


class _Unsubscribe(msgspec.Struct, tag="unsubscribe", tag_field="op"):
    """Numbers of no further interest."""

    subscriptionIds: list[int]


class _Viewers(GuardedServer):
    """Foxglove's protocol, behind the same door as the page.

    The server of foxglove-sdk is not used: it answers any page of any origin.
    """

    scheme = "ws"
    subprotocols = _KINDS

    def __init__(self, *words: Any):
        super().__init__(*words)
        self._wanted: dict[ServerConnection, dict[int, int]] = {}
        """Of each viewer: channels by its own numbers."""

    async def _reader(self, connection: ServerConnection) -> None:
        self._wanted[connection] = {}
        try:
            await super()._reader(connection)
        finally:
            del self._wanted[connection]

    async def _hear(self, connection: ServerConnection, message: str | bytes) -> None:
        wanted = self._wanted[connection]
        with suppress(
            msgspec.DecodeError, RecursionError, UnicodeDecodeError
        ):  # other requests have no answer
            match msgspec.json.decode(message, type=_Subscribe | _Unsubscribe):
                case _Subscribe(subscriptions=some):
                    asked = {one["id"]: one["channelId"] for one in some if {"id", "channelId"} <= set(one)}
                    wanted.update({k: v for k, v in asked.items() if 0 <= k < 1 << 32})
                    while len(wanted) > _MOST:
                        wanted.popitem()
                case _Unsubscribe(subscriptionIds=numbers):
                    for number in numbers:
                        wanted.pop(number, None)
        self._wake()

    async def _send_news(self, connection: ServerConnection, news: asyncio.Event) -> None:
        wanted = self._wanted[connection]
        view = self._player.source.view
        info = {"name": "palpate", "capabilities": [], "supportedEncodings": [], "metadata": {}}
        await connection.send(_text("serverInfo", **info, sessionId=self._token[:8]))
        await connection.send(_text("advertise", channels=_channels(view)))
        epoch, count = -1, 0
        while True:
            news.clear()
            rows: Any = ()
            if wanted:  # who asks for a channel gets what is kept of it
                epoch, count, rows, _ = self._player.feed.since(epoch, count)
            for number, channel in list(wanted.items()):
                if channel == _CONTACT:
                    for row in rows:
                        await connection.send(_message(number, row, _contact(row)))
                elif channel == _ARM and len(rows) and _drawn(view):
                    await connection.send(_message(number, rows[-1], self._scene(rows[-1])))
            await news.wait()

    def _scene(self, row: Array) -> bytes:
        """The arm and the surface as lines, by Foxglove's own protobuf."""
        from foxglove.messages import (
            Color,
            LinePrimitive,
            LinePrimitiveLineType,
            Point3,
            SceneEntity,
            SceneUpdate,
        )

        source = self._player.source
        lines = [
            LinePrimitive(
                type=LinePrimitiveLineType.LineStrip,
                thickness=thick,
                points=[Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in points],
                color=Color(r=r, g=g, b=b, a=1.0),
            )
            for points, thick, (r, g, b) in (
                (source.bones(row), 0.012, (0.35, 0.38, 0.42)),
                (_surface(source.view, float(row[AT["wall"]])), 0.004, (0.15, 0.55, 0.37)),
            )
        ]
        return bytes(SceneUpdate(entities=[SceneEntity(frame_id="base", id="arm", lines=lines)]).encode())


def _channels(view: View) -> list[dict[str, Any]]:
    """Advertised: the rows, and the arm if there is one."""
    shown = {name: _UNITS[name] for name in COLUMNS if name in view.shown}
    schema = {
        "type": "object",
        "title": "palpate.Contact",
        "properties": {name: {"type": "number", "description": unit} for name, unit in shown.items()},
    }
    found = [
        _channel(
            _CONTACT, TOPIC, "json", "palpate.Contact", "jsonschema", msgspec.json.encode(schema).decode()
        )
    ]
    if _drawn(view):
        from foxglove.messages import SceneUpdate

        own = SceneUpdate.get_schema()
        found.append(_channel(_ARM, ARM, "protobuf", own.name, own.encoding, b64encode(own.data).decode()))
    return found


def _channel(number: int, topic: str, encoding: str, name: str, kind: str, schema: str) -> dict[str, Any]:
    return {
        "id": number, "topic": topic, "encoding": encoding,
        "schemaName": name, "schemaEncoding": kind, "schema": schema,
    }  # fmt: skip


def _text(op: str, **more: Any) -> str:
    return msgspec.json.encode({"op": op, **more}).decode()


def _message(number: int, row: Array, payload: bytes) -> bytes:
    return _HEAD.pack(1, number, _stamp(float(row[AT["t"]]))) + payload


def _contact(row: Array) -> bytes:
    """A row in JSON, which has no word for what is no number: a viewer shows a gap where a field is left out."""
    return msgspec.json.encode({k: float(v) for k, v in zip(COLUMNS, row, strict=True) if math.isfinite(v)})


def _drawn(view: View) -> bool:
    """Whether there is an arm."""
    return bool(view.links) or view.scene is not None


def _surface(view: View, wall: float) -> list[tuple[float, ...]]:
    """Points of the line that stands for the surface [m]."""
    if view.scene is not None:
        return [*view.scene.patch, view.scene.patch[0]]
    return [(wall, side, 0.0) for side in (-0.2, 0.2)]


def _stamp(time: float) -> int:
    """Nanoseconds; a viewer takes no time before 0."""
    return max(0, round(time * _SECOND))
