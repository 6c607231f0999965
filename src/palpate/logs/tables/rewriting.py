"""Text logs that are no lines of cells, rewritten as such: JSON, `label:value`, lists in cells."""

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files.reading import ReadingBudget
from palpate.logs.tables.lines import TextLine, join_quoted
from palpate.text import shorten

_COPIES = 8
"""Memory of a rewritten text, as a multiple of the file: its lines, their cells and the rows."""
_MAX_JSON_COLUMNS = 4096
_MAX_LIST = 64
"""Longest list of a JSON value that is columns; what is longer is an image, say."""
_MIN_FRACTION = 0.5
"""Fraction of the first lines that a form of writing accounts for."""
_MAX_SHOWN = 60

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|NaN|Infinity)|None|null"
# Bounded repetitions, so that a hostile line takes as long as any other.
_PAIR = re.compile(
    rf"\s*([^\W\d][\w .()\[\]/%°µ-]{{0,39}}?)\s*[:=]\s*({_NUMBER})(?:\s?([^\W\d_][\w/%°]{{0,5}}))?\s*(?:[,;|\t ]|$)"
)
_STAMP = re.compile(r"\s*(\d{1,2}:\d{2}:\d{2}(?:\.\d+)?|\d+(?:\.\d+)?)\s*(?:->|[,;\t:>])\s*")
_LIST = re.compile(
    rf'"?(?:array|tensor)?\(?[\[(]{{1,4}}\s{{0,24}}(?:({_NUMBER})(?:[\s,;]{{1,24}}(?:{_NUMBER}))*)?\s{{0,24}},?\s{{0,24}}'
    r'[\])]{1,6}"?'
)
_HOLE = "\x02"
"""Stands in a line for a list of it."""


def rewrite_json(path: Path, budget: ReadingBudget) -> str:
    """A JSON log as a table: an object a line, a list of objects, or an object of lists; nested names have points.

    Raises:
        InputError: it is no such JSON, or is too large.
    """
    budget.check(_COPIES * path.stat().st_size)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        lines = file.read().split("\n")
    first = next(line for line in lines if line.strip())
    by_line = isinstance(_parsed(first), dict) and any(
        line.strip() for line in lines[lines.index(first) + 1 :]
    )
    records = (
        [_parsed(line) if line.strip() else {} for line in lines]
        if by_line
        else _records(path, "\n".join(lines))
    )
    names: dict[str, None] = {}
    rows = []
    for record in records:
        row = dict(_leaves(record, "")) if isinstance(record, Mapping) else None
        names.update(dict.fromkeys(row or ()))
        if len(names) > _MAX_JSON_COLUMNS:
            raise InputError(
                f"{path} holds more than {_MAX_JSON_COLUMNS} names; give a log with a column for each signal"
            )
        rows.append(row)
        budget.take(0)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([" ".join(name.split()) for name in names])
    for row in rows:
        if row:
            writer.writerow([row.get(name, "") for name in names])
        else:  # an empty line, or one that is no JSON
            out.write("\n" if row is not None else "?\n")
    return out.getvalue()


def _parsed(text: str) -> Any:
    """A value of JSON; None for what is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _records(path: Path, text: str) -> list[Any]:
    """The objects of a JSON file, a row each."""
    value = _parsed(text)
    if isinstance(value, dict):
        lists = [
            inner
            for inner in value.values()
            if isinstance(inner, list) and inner and isinstance(inner[0], dict)
        ]
        if lists:
            return max(lists, key=len)
        columns = {name: inner for name, inner in _lists(value, "") if len(inner) > 1}
        return [dict(zip(columns, row, strict=True)) for row in zip_longest(*columns.values())]
    if isinstance(value, list):
        return value
    raise InputError(
        f"{path} is no whole JSON; give an object a line, a list of objects, or an object of lists"
    )


def _lists(value: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, list[Any]]]:
    for name, inner in value.items():
        if isinstance(inner, dict):
            yield from _lists(inner, f"{prefix}{name}.")
        elif isinstance(inner, list):
            yield f"{prefix}{name}", inner


def _leaves(value: Any, name: str) -> Iterator[tuple[str, str | float]]:
    """Numbers and texts of an object, by their names with points."""
    match value:
        case dict():
            for key, inner in value.items():
                yield from _leaves(inner, f"{name}.{key}" if name else str(key))
        case list() if len(value) <= _MAX_LIST:
            for i, inner in enumerate(value):
                yield from _leaves(inner, f"{name}.{i}")
        case bool():
            yield name, int(value)
        case int() | float():
            yield name, value
        case str():
            yield name, " ".join(value.split())


def rewriter(lines: Sequence[TextLine]) -> Callable[[Path, ReadingBudget], tuple[str, int]] | None:
    """The function that rewrites a text, by its first lines; None for plain lines of cells.

    It returns the new text, and the number of lines at its beginning that the file does not have.
    """
    plain = [line.text for line in lines if not line.comment]
    if not plain:
        return None
    labels = Counter(labels for line in plain if (labels := tuple(name for name, _ in _pairs(line))))
    usual, count = labels.most_common(1)[0] if labels else ((), 0)
    if len(usual) > 1 and count >= max(2, _MIN_FRACTION * len(plain)):
        return lambda path, budget: (_rewrite(path, budget, lambda texts: _labelled(texts, usual)), 1)
    lists = [
        line
        for line in plain
        if any(match[1] and re.search(r"[\s,;]\S", match[0].strip('"([ ')) for match in _LIST.finditer(line))
    ]
    if len(lists) >= max(2, _MIN_FRACTION * len(plain)):
        delimiter, names = _outer(plain)
        return lambda path, budget: (
            _rewrite(path, budget, lambda texts: _unlisted(path, texts, delimiter, names)),
            0,
        )
    return None


def _rewrite(path: Path, budget: ReadingBudget, rows: Callable[[Iterable[str]], Iterator[str]]) -> str:
    budget.check(_COPIES * path.stat().st_size)
    out = []
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for row in rows(join_quoted(line.rstrip("\r\n") for line in file)):
            out.append(row)
            budget.take(0)
    return "\n".join(out)


def _pairs(line: str) -> list[tuple[str, str]]:
    """Labels and values of a line that holds nothing else; a stamp before them is a time."""
    stamp = _STAMP.match(line)
    place = stamp.end() if stamp else 0
    end = len(line.rstrip())
    pairs = [("time", stamp[1])] if stamp else []
    while place < end:
        match = _PAIR.match(line, place)
        if match is None:
            return []
        name = match[1].strip()
        pairs.append((f"{name} ({match[3]})" if match[3] else name, match[2]))
        place = match.end()
    return pairs if len(pairs) > bool(stamp) else []


def _labelled(texts: Iterable[str], labels: tuple[str, ...]) -> Iterator[str]:
    """Lines of the values behind some labels; other lines among them stay as they are, and are no rows."""
    yield "\t".join(labels)
    begun = False
    for text in texts:
        pairs = _pairs(text)
        whole = tuple(name for name, _ in pairs) == labels
        begun |= whole
        yield "\t".join(value for _, value in pairs) if whole else text.replace("\t", " ") * begun


def _outer(lines: Sequence[str]) -> tuple[str, list[str]]:
    """The delimiter between cells of which some are lists, and the names in the first line."""
    holed = [_LIST.sub(_HOLE, line) for line in lines]
    rows = [line for line in holed if _HOLE in line]

    def cells(delimiter: str) -> int:
        width = Counter(line.count(delimiter) for line in rows).most_common(1)[0][0]
        return width if _HOLE in holed[0] or holed[0].count(delimiter) == width else -1

    delimiter = max((",", ";", "\t", "|"), key=cells)
    names = [] if _HOLE in holed[0] else [cell.strip().strip('"') for cell in holed[0].split(delimiter)]
    return delimiter, names


def _unlisted(path: Path, texts: Iterable[str], delimiter: str, names: list[str]) -> Iterator[str]:
    """Lines in which each number of a list has a cell of its own; the first line has their names.

    Raises:
        InputError: a list has another length than those above it.
    """
    lengths: dict[int, int] = {}
    header = names
    waiting: list[str] = []
    row = 0
    for number, text in enumerate(texts, 1):
        lists = [_numbers(match) for match in _LIST.finditer(text)]
        cells = (_LIST.sub(_HOLE, text) if lists else text).split(delimiter)
        if not lists:
            is_header = not row and [cell.strip().strip('"') for cell in cells] == names
            if not lengths:
                waiting.append("" if is_header else text)
            else:
                yield text
            continue
        row += 1
        places = [i for i, cell in enumerate(cells) if cell.strip() == _HOLE]
        if not lengths:
            lengths = {place: len(values) for place, values in zip(places, lists, strict=False)}
            header = header or [str(i) for i in range(len(cells))]
            yield from [*waiting[:-1], delimiter.join(_titles(header, lengths))]
        for place, values in zip(places, lists, strict=False):
            length = lengths.get(place, 0)
            if values and len(values) != length:
                name = header[place] if place < len(header) else str(place)
                raise InputError(
                    f"{path}: column {shorten(name, _MAX_SHOWN)!r}, row {row} (line {number}) holds a list of"
                    f" {len(values)} numbers, and those above have {length}; mend it"
                )
            cells[place] = delimiter.join(values or [""] * length)
        yield delimiter.join(cells)


def _titles(names: Sequence[str], lengths: Mapping[int, int]) -> Iterator[str]:
    for place, name in enumerate(names):
        yield from (f"{name}.{i}" for i in range(lengths[place])) if place in lengths else [name]


def _numbers(match: re.Match[str]) -> list[str]:
    """The numbers of a list."""
    return re.findall(_NUMBER, match[0]) if match[1] else []
