"""`palpate topics`: what does a log hold, and how is it named?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from palpate.cli._terminal import print_json, print_lines

if TYPE_CHECKING:
    from palpate.logs.listing import Entry


def topics(
    log: Path, /, *, delimiter: str | None = None, json: Annotated[bool, Parameter(negative=())] = False
) -> int:
    """List what a log holds: topics of a bag, variables of a MATLAB file, columns of a table.

    Parameters
    ----------
    log
        CSV, Parquet, MATLAB v4 to v7, a ROS 1 bag, a ROS 2 bag or MCAP.
    delimiter
        Between two cells of a CSV file; found if not given.
    json
        Print one JSON object and nothing else.
    """
    from palpate.logs.listing import entries_of

    entries, troubles = entries_of(log, delimiter)
    if json:
        print_json({"entries": [entry.to_json() for entry in entries], "troubles": troubles})
        return 0
    _show(log, entries, troubles)
    return 0


def _show(log: Path, entries: list[Entry], troubles: list[str]) -> None:
    """A line an entry, as wide as it is, so that it may be searched by other programs."""
    begin = _begin(entries)
    rows = [("name", "type", "count", "rate", "first", "last", "what")]
    for entry in entries:
        times = (_number(None if time is None else time - begin, " s") for time in (entry.first, entry.last))
        words = (entry.name, entry.kind.replace("/msg/", "/"), str(entry.count), _number(entry.rate, " Hz"))
        rows.append((*words, *times, entry.about))  # type: ignore[arg-type]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    since = f", times from {_date(begin)} on" if begin else ""
    lines = [f"{log.name}: {len(entries)} {_kind(entries)}{since}"]
    for row in rows:
        cells = [
            cell.rjust(width) if place in _NUMBERS else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    print_lines(*lines, *troubles)


_NUMBERS = range(2, 6)
_UNIX = 1e8


def _begin(entries: list[Entry]) -> float:
    """What to count from: the first time of all where times are dates [s since 1970], else 0."""
    first = min((entry.first for entry in entries if entry.first is not None), default=0.0)
    return first if first > _UNIX else 0.0


def _date(seconds: float) -> str:
    from datetime import UTC, datetime

    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _kind(entries: list[Entry]) -> str:
    word = "topic" if all(entry.name.startswith("/") for entry in entries) else "column"
    return word if len(entries) == 1 else f"{word}s"


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g}{unit}"
