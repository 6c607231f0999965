"""A ROS 2 bag in SQLite read row by row, so that one that is cut is read as well."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import quote

from palpate.errors import InputError
from palpate.files.limits import Budget
from palpate.logs.bags.scanning import Channel, End, Raw

_TABLES = "SELECT name FROM sqlite_master WHERE type = 'table' AND sql LIKE 'CREATE TABLE%'"
_OTHERS = "SELECT name, type FROM sqlite_master WHERE name IN ('topics', 'messages', 'message_definitions')"
# A column of SQLite holds values of any type: what is no name, no number or no message makes no topic.
_TOPICS = (
    "SELECT id, name, type FROM topics"
    " WHERE typeof(id) = 'integer' AND typeof(name) = 'text' AND typeof(type) = 'text'"
)
_TYPES = (
    "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    " WHERE typeof(topic_type) = 'text' AND typeof(encoding) = 'text'"
    " AND typeof(encoded_message_definition) = 'text'"
)
_MESSAGES = "SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id"
_MESSAGE = (int, int, bytes)
_STEPS = 100_000
"""Instructions of SQLite between two looks at the clock."""


def scan_sqlite(path: Path, budget: Budget) -> Iterator[Channel | Raw | End]:
    """Topics and messages of a ROS 2 bag in SQLite as far as its pages are there."""
    with closing(_open_database(path, budget)) as database:
        types = {kind: (encoding, text) for kind, encoding, text in _rows(database, _TYPES)}
        for number, topic, kind in _rows(database, _TOPICS):
            yield Channel(number, topic, kind, *types.get(kind, ("", "")))
        hurt = False
        left = path.stat().st_size
        try:
            for row in database.execute(_MESSAGES):
                plain = all(isinstance(value, kind) for value, kind in zip(row, _MESSAGE, strict=True))
                left -= len(row[2]) if plain else 0
                if hurt := not plain or left < 0:  # a page that is there in part is read as if zeros followed
                    break
                yield Raw(*row)
        except sqlite3.DatabaseError:
            if budget.seconds_left <= 0:
                raise budget.too_long() from None
            hurt = True
    share = _missing_pages(path)
    yield End(finished=not (hurt or share), share=share)


def _open_database(path: Path, budget: Budget) -> sqlite3.Connection:
    """The database, to be read only, and no longer than the log may take."""
    database = sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(path.stat().st_size + 1_000_000, 2**31 - 1))
    database.set_progress_handler(lambda: budget.seconds_left <= 0, _STEPS)
    # SQLite refuses a file that is shorter than its first page says, unless a repair seems to be under way.
    database.execute("PRAGMA writable_schema = ON")
    database.execute("PRAGMA trusted_schema = OFF")
    tables = {name for (name,) in _rows(database, _TABLES)}
    for name, kind in _rows(database, _OTHERS):
        if name not in tables:
            database.close()
            raise InputError(
                f"{path} is no ROS 2 bag: its {name} is not a plain table but a {kind}; record it again"
            )
    return database


def _rows(database: sqlite3.Connection, question: str) -> list[tuple[Any, ...]]:
    """The rows; none if there is no such table."""
    try:
        return database.execute(question).fetchall()
    except sqlite3.DatabaseError:
        return []


def _missing_pages(path: Path) -> float | None:
    """The share of the file's pages that are not there; None if all are."""
    with path.open("rb") as file:
        head = file.read(32)
    page = int.from_bytes(head[16:18], "big")
    meant = (65536 if page == 1 else page) * int.from_bytes(head[28:32], "big")
    size = path.stat().st_size
    return 1 - size / meant if size < meant else None
