"""The same rows for the field's own viewers: Foxglove, Lichtblick and PlotJuggler, by Foxglove's protocol."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.live.player import Player
from palpate.live.server import HOST
from palpate.live.view import AT, COLUMNS, JOINTS, View

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


@contextmanager
def viewers(player: Player, port: int) -> Iterator[tuple[str, ...]]:
    """Serves viewers within the block; yields the line that says where.

    Args:
        player: whose rows they get: `TOPIC` in JSON, and the arm as line strips of a scene on `ARM`.
        port: of this machine; 0 takes a free one.

    Raises:
        InputError: the port cannot be taken, or foxglove-sdk is not installed.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"--foxglove-port must be from 0 to 65535, got {port}")
    try:
        import foxglove
    except ImportError:
        raise InputError('viewers need foxglove-sdk: pip install "palpate[foxglove]"') from None
    context = foxglove.Context()
    try:
        server = foxglove.start_server(name="palpate", host=HOST, port=port, context=context)
    except RuntimeError as error:
        raise InputError(
            f"port {port} cannot be taken ({error}); name another with --foxglove-port"
        ) from None
    sender = _Sender(player, context)
    silence = player.feed.listen(sender.news.set)
    sender.start()
    player.watch()
    try:
        yield (f"viewers: ws://{HOST}:{server.port}",)
    finally:
        silence()
        sender.end()
        server.stop()


class _Sender(threading.Thread):
    """Sends new rows, in its own thread."""

    def __init__(self, player: Player, context: Any):
        import foxglove
        from foxglove.channels import SceneUpdateChannel

        super().__init__(name="viewers", daemon=True)
        self.news = threading.Event()
        self._player, self._ended = player, False
        shown = {name: _UNITS[name] for name in COLUMNS if name in player.source.view.shown}
        schema = {
            "type": "object",
            "title": "palpate.Contact",
            "properties": {name: {"type": "number", "description": unit} for name, unit in shown.items()},
        }
        self._contact = foxglove.Channel(TOPIC, schema=schema, context=context)
        self._arm = SceneUpdateChannel(ARM, context=context) if _drawn(player.source.view) else None

    def end(self) -> None:
        """Ends the thread."""
        self._ended = True
        self.news.set()
        self.join()

    def run(self) -> None:
        """Until `end`."""
        epoch, count = -1, 0
        while self.news.wait() and not self._ended:
            self.news.clear()
            epoch, count, rows, _ = self._player.feed.since(epoch, count)
            for row in rows:
                # JSON has no word for what is no number: a viewer shows a gap where a field is left out.
                known = {name: float(v) for name, v in zip(COLUMNS, row, strict=True) if math.isfinite(v)}
                self._contact.log(known, log_time=_stamp(known["t"]))
            if self._arm is not None and len(rows):
                self._draw(rows[-1])

    def _draw(self, row: Array) -> None:
        from foxglove.messages import (
            Color,
            LinePrimitive,
            LinePrimitiveLineType,
            Point3,
            SceneEntity,
            SceneUpdate,
        )

        view = self._player.source.view
        points = [Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in self._player.source.bones(row)]
        wall = [
            Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in _surface(view, float(row[AT["wall"]]))
        ]
        lines = [
            LinePrimitive(
                type=LinePrimitiveLineType.LineStrip,
                thickness=thick,
                points=own,
                color=Color(r=r, g=g, b=b, a=1.0),
            )
            for own, thick, (r, g, b) in (
                (points, 0.012, (0.35, 0.38, 0.42)),
                (wall, 0.004, (0.15, 0.55, 0.37)),
            )
        ]
        assert self._arm is not None
        entity = SceneEntity(frame_id="base", id="arm", lines=lines)
        self._arm.log(SceneUpdate(entities=[entity]), log_time=_stamp(float(row[AT["t"]])))


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
