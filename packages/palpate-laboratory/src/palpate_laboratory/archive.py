"""Tried, judged and bred laboratories, each in an SQLite file at once, so that none is computed twice."""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec

from palpate.errors import InputError
from palpate.files import SQLITE_ID, check_place

T = TypeVar("T")


class SearchIdentity(msgspec.Struct, frozen=True):
    """Identity of a search: an archive of another one is not resumed.

    Args:
        palpate: version.
        search: all that decides it, in words.
        sources: hash of the sources that a trial consists of.
        sentences: their ids, in the order of the verdicts.
    """

    palpate: str
    search: str
    sources: str
    sentences: tuple[str, ...]


class Tried(msgspec.Struct, frozen=True):
    """Verdicts on one laboratory.

    Args:
        number: of it in its search.
        shares: of the priors, where it lies.
        verdicts: of the sentences in turn; shorter where it was given up.
    """

    number: int
    shares: tuple[float, ...]
    verdicts: tuple[bool, ...]


class Archive:
    """The laboratories of one search, open for writing by this process alone."""

    def __init__(self, path: Path, connection: sqlite3.Connection, known: dict[int, Tried]):
        self._path, self._connection = path, connection
        self.known = known

    def add(self, tried: Tried) -> None:
        """Saves one more.

        Raises:
            InputError: the disk is full, or cannot be written to.
        """
        with _report_errors(self._path):
            _put(self._connection, str(tried.number), tried)
        self.known[tried.number] = tried


@contextmanager
def open_archive(path: Path, head: SearchIdentity) -> Iterator[Archive]:
    """The archive at `path`: begun, or resumed if it is of the same search and sources.

    Raises:
        InputError: it is of another search, or no archive.
    """
    with _report_errors(path), closing(_connection(path)) as connection:
        begun = _get(connection, "head", SearchIdentity)
        if begun is None:
            _put(connection, "head", head)
        elif begun != head:
            raise InputError(
                f"{path} is of another search, or of other sources; choose another --out, or add --replace to "
                "start again"
            )
        yield Archive(path, connection, _laboratories(connection))


def read(path: Path) -> tuple[SearchIdentity | None, dict[int, Tried]]:
    """Head, and laboratories by number.

    Raises:
        InputError: it is no archive.
    """
    with _report_errors(path), closing(_connection(path)) as connection:
        return _get(connection, "head", SearchIdentity), _laboratories(connection)


def remember(path: Path, key: str, kind: type[T], compute: Callable[[], T]) -> T:
    """The value that a file has of a key; computed and saved if it has none.

    Raises:
        InputError: the file is spoiled, or cannot be written to.
    """
    with _report_errors(path), closing(_connection(path)) as connection:
        value = _get(connection, key, kind)
        if value is None:
            value = compute()
            _put(connection, key, value)
        return value


def _connection(path: Path) -> sqlite3.Connection:
    check_place(path)
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute(f"PRAGMA application_id = {SQLITE_ID}")
    connection.execute("CREATE TABLE IF NOT EXISTS kept (key TEXT PRIMARY KEY, value TEXT) WITHOUT ROWID")
    return connection


def _put(connection: sqlite3.Connection, key: str, value: object) -> None:
    connection.execute(
        "INSERT OR REPLACE INTO kept VALUES (?, ?)", (key, msgspec.json.encode(value).decode())
    )


def _get(connection: sqlite3.Connection, key: str, kind: type[T]) -> T | None:
    row = connection.execute("SELECT value FROM kept WHERE key = ?", (key,)).fetchone()
    return None if row is None else msgspec.json.decode(row[0], type=kind)


def _laboratories(connection: sqlite3.Connection) -> dict[int, Tried]:
    rows = connection.execute("SELECT value FROM kept WHERE key != 'head'")
    tried = [msgspec.json.decode(value, type=Tried) for (value,) in rows]
    return {one.number: one for one in sorted(tried, key=lambda one: one.number)}


@contextmanager
def _report_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except sqlite3.OperationalError as error:
        raise InputError(
            f"{path}: {error}; free some space, or choose another --out; the same command resumes"
        ) from error
    except (sqlite3.DatabaseError, msgspec.DecodeError) as error:
        raise InputError(f"{path} is damaged ({error}); remove it, and it is rebuilt") from error
