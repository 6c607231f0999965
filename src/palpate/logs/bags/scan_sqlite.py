"""A ROS 2 bag in SQLite read row by row, for one that is cut."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from palpate.logs.bags.scanning import End, Raw, connection

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

_TOPICS = "SELECT id, name, type FROM topics"
_TYPES = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
_MESSAGES = "SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id"


def scan_sqlite(path: Path) -> Iterator[Connection | Raw | End]:
    """Topics and messages of a ROS 2 bag in SQLite as far as its pages are there."""
    with closing(sqlite3.connect(f"file:{quote(str(path))}?immutable=1", uri=True)) as database:
        # SQLite refuses a file that is shorter than its first page says, unless a repair seems to be under way.
        database.execute("PRAGMA writable_schema = ON")
        types = {kind: (encoding, text) for kind, encoding, text in _rows(database, _TYPES)}
        for number, topic, kind in _rows(database, _TOPICS):
            yield connection(number, topic, kind, *types.get(kind, ("", "")))
        hurt = False
        try:
            for row in database.execute(_MESSAGES):
                if hurt := None in row:  # a page that is there in part is read as if zeros followed
                    break
                yield Raw(*row)
        except sqlite3.DatabaseError:
            hurt = True
    share = _lost(path)
    yield End(finished=not (hurt or share), share=share)


def _rows(database: sqlite3.Connection, question: str) -> list[tuple[Any, ...]]:
    """The rows; none if there is no such table."""
    try:
        return database.execute(question).fetchall()
    except sqlite3.DatabaseError:
        return []


def _lost(path: Path) -> float | None:
    """The share of the file's pages that are not there; None if all are."""
    with path.open("rb") as file:
        head = file.read(32)
    page = int.from_bytes(head[16:18], "big")
    meant = (65536 if page == 1 else page) * int.from_bytes(head[28:32], "big")
    size = path.stat().st_size
    return 1 - size / meant if size < meant else None
