"""Layout of a text log: its delimiter, its first row, the names and units above it."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from palpate.errors import InputError
from palpate.files.reading import ReadingBudget
from palpate.logs.tables.lines import Parting, TextLine
from palpate.logs.tables.sheet import Stated
from palpate.units import known_unit

_PARTINGS = (
    Parting(","),
    Parting(";"),
    Parting(";", decimal_comma=True),
    Parting("\t"),
    Parting("\t", decimal_comma=True),
    Parting("|"),
    Parting("|", decimal_comma=True),
    Parting(" "),
    Parting(" ", decimal_comma=True),
    Parting(",", decimal_comma=True),  # between quotes
)
"""In the order of preference among those that part a log equally well."""
_NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "space"}


@dataclass(frozen=True)
class Layout:
    """How to read a text log.

    Args:
        parting: of its cells.
        names: of the columns; numbers from 0 where the file has no header.
        units: the row of units below the header, by name; empty without one.
        first_row: the line of the file, from 1, that holds the first row of numbers.
        header: the text of the header's line; empty without one.
        above: the lines before the header.
        quoted: cells may stand in quotes.
    """

    parting: Parting
    names: tuple[str, ...]
    units: dict[str, str]
    first_row: int
    header: str
    above: tuple[str, ...]
    quoted: bool

    @property
    def delimiter_name(self) -> str:
        """Name of the delimiter in a sentence."""
        return _NAMES.get(self.parting.delimiter, repr(self.parting.delimiter))


def find_layout(
    path: Path, lines: Sequence[TextLine], budget: ReadingBudget, delimiter: str | None = None
) -> Layout:
    """Look at the first lines of a text log.

    Args:
        path: of the log.
        lines: its first.
        budget: of it; the time is looked at again and again.
        delimiter: between two cells; found when None.

    Raises:
        InputError: they hold no rows of numbers, or a header that does not fit the rows.
    """
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"the delimiter must be one character, got {delimiter!r}")
    plain = [line for line in lines if not line.comment]
    if not plain:
        raise InputError(f"{path} is empty; give a log with a row of numbers for each sample")
    block = _best(plain, budget, delimiter)
    if block is None:
        if delimiter is not None:
            told = _NAMES.get(delimiter, repr(delimiter))
            raise InputError(f"{path} holds no rows of numbers separated by {told}; is the delimiter right?")
        if len(plain) == 1 and len(_PARTINGS[0].split(plain[0].text)) > 1:
            raise InputError(f"{path} holds a header and no rows; give a log with a row for each sample")
        raise InputError(f"{path} holds no rows of numbers in columns; give a log with a row for each sample")
    if block.parting.delimiter != ";":
        lines = [replace(line, comment=True) if line.text[0] == ";" else line for line in lines]
    return _layout(path, lines, block)


@dataclass(frozen=True)
class _Block:
    """The rows of numbers, as far as they are looked at.

    Args:
        parting: of their cells.
        first: line of the first.
        width: cells in each.
        filled: columns up to the last that holds something.
        score: how well this parting suits: no other text, a delimiter that is seen, most numbers.
        quoted: some cells stand in quotes.
    """

    parting: Parting
    first: int
    width: int
    filled: int
    score: tuple[bool, bool, float]
    quoted: bool


def _best(lines: Sequence[TextLine], budget: ReadingBudget, delimiter: str | None) -> _Block | None:
    tried = [p for p in _PARTINGS if delimiter in {None, p.delimiter}]
    if not tried and delimiter is not None:
        tried = [Parting(delimiter), Parting(delimiter, decimal_comma=delimiter != ",")]
    blocks = [block for block in (_block(lines, parting, budget) for parting in tried) if block is not None]
    return max(blocks, key=lambda block: block.score, default=None)


def _block(lines: Sequence[TextLine], parting: Parting, budget: ReadingBudget) -> _Block | None:
    """The rows of numbers under one parting: the longest run of lines of one width that hold some."""
    cells = [parting.split(line.text) for line in lines]
    budget.take(0)
    kinds = parting.kinds(cells)
    budget.take(0)
    runs = [
        (width, list(group))
        for width, group in groupby(range(len(lines)), lambda i: len(kinds[i]) if 1 in kinds[i] else 0)
        if width
    ]
    if not runs:
        return None
    width, run = max(runs, key=lambda run: (len(run[1]), run[1][-1]))
    usual = [Counter(kinds[i][place] for i in run).most_common(1)[0][0] for place in range(width)]
    numeric = [place for place, kind in enumerate(usual) if kind == 1]
    if not numeric:
        return None
    first = next((i for i in range(run[-1] + 1) if _is_row(kinds[i], width, numeric)), None)
    if first is None:
        return None
    first = _below_header(kinds, width, first)
    filled = max(place for place in range(width) if any(cells[i][place] for i in run)) + 1
    text = usual.count(-1)
    seen = parting.delimiter != " " and width > 1
    quoted = any('"' in lines[i].text for i in run)
    return _Block(parting, lines[first].number, width, filled, (not text, seen, len(numeric) - text), quoted)


def _below_header(kinds: Sequence[Sequence[int]], width: int, first: int) -> int:
    """The first row: lines between the header and it that hold numbers are rows, though a cell of them is wrong.

    One number beside a word is a label and its value.
    """
    begin = first
    while (
        begin > 0 and len(kinds[begin - 1]) == width and kinds[begin - 1].count(1) >= (2 if width == 2 else 1)
    ):
        begin -= 1
    named = begin > 0 and len(kinds[begin - 1]) == width and 1 not in kinds[begin - 1]
    return begin if named else first


def _is_row(kinds: Sequence[int], width: int, numeric: Sequence[int]) -> bool:
    """Whether a line is a row as the others are: as wide, with numbers in half of the places where they have some.

    A line that begins with a word, among lines that begin with a number, is a label and its value.
    """
    labelled = numeric[0] == 0 and bool(kinds) and kinds[0] < 0
    there = len(kinds) == width and not labelled
    return there and 2 * sum(kinds[place] == 1 for place in numeric) >= len(numeric)


def _layout(path: Path, lines: Sequence[TextLine], block: _Block) -> Layout:
    above = [line for line in lines if line.number < block.first]
    symbols: list[str] = []
    if len(above) > 1 and _is_units(found := block.parting.header(above[-1].text), block):
        symbols, above = found, above[:-1]
    found = _header(above[-1], block) if above else []
    header = above.pop().text if found else ""
    if found and len(found) < block.filled:
        raise InputError(
            f"{path}: its rows hold more cells than its header's {len(found)}; name every column,"
            " or part the cells by something that no number holds"
        )
    names = found[: max(block.filled, min(len(found), block.width))]
    names = [name or str(i) for i, name in enumerate(names)] or [str(i) for i in range(block.filled)]
    units = {name: symbol.strip("[]() ") for name, symbol in zip(names, symbols, strict=False)}
    return Layout(
        block.parting,
        tuple(names),
        {name: symbol for name, symbol in units.items() if symbol},
        block.first,
        header,
        tuple(line.text for line in above),
        block.quoted,
    )


def _is_units(cells: Sequence[str], block: _Block) -> bool:
    """Whether a line is a row of units: nothing else, and at least half of the columns have one."""
    symbols = [cell.strip("[]() ") for cell in cells]
    known = [symbol for symbol in symbols if symbol and known_unit(symbol)]
    others = [symbol for symbol in symbols if symbol and not known_unit(symbol)]
    return len(cells) >= block.filled and len(known) >= max(1, block.filled / 2) and len(others) < len(known)


def _header(line: TextLine, block: _Block) -> list[str]:
    """The names in the line above the rows; none if it is something else.

    A header may be parted otherwise than its rows are; it then has a name for each column.
    """
    text = line.text.lstrip("; ") if line.comment else line.text
    own = _bare(block.parting.header(text))
    if len(own) == block.filled:
        return own
    for parting in _PARTINGS:
        other = _bare(parting.header(text))
        if len(other) == block.filled > 1:
            return other
    words = all(block.parting.kind(cell) < 1 for cell in own)
    if line.comment or block.parting.delimiter == " " or not words or 2 * len(own) < block.filled:
        return []
    return own if len(own) > 1 or block.filled == 1 else []


def _bare(cells: list[str]) -> list[str]:
    """Without the empty cells at the end, and without quotes."""
    while cells and not cells[-1]:
        cells = cells[:-1]
    return [cell.strip('"') for cell in cells]


_FACTORS = {"hz": 1.0, "khz": 1e3, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6}
_NUMBER = r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)"
_UNIT = r"(?P<{}>k?hz|ms|us|sec|s)\b"
_RATE = re.compile(r"\b(sampl\w*|scan|acquisition|acq|data|logging)[\s_-]*(rate|freq\w*)\b", re.I)
_STEP = re.compile(r"\b(sampl\w*|scan|acquisition)[\s_-]*(interval|period|time|step)\b|^delta_x\b", re.I)
_LOOK = 200
"""Letters of a line in which it may state the rate."""
_LAST_HEADER = "***End_of_Header***"


@dataclass(frozen=True)
class Preamble:
    """Statements of the lines above the rows.

    Args:
        rate: rows per second [1/s]; None if they do not say.
        columns: by name.
    """

    rate: float | None = None
    columns: dict[str, Stated] = field(default_factory=dict)


def read_preamble(lines: Sequence[str], names: Sequence[str]) -> Preamble:
    """Read rate, units and scales from the lines above the rows.

    A line of labels, such as `Units` and then a cell for each channel, goes by the line `Channel` with their names;
    those of LabVIEW stand in the order of the columns.

    Args:
        lines: above the header.
        names: of the columns.
    """
    rate = next((found for found in (_rate(line[:_LOOK]) for line in lines) if found), None)
    rows = {cells[0].lower(): cells[1:] for cells in (line.split("\t") for line in lines) if len(cells) > 1}
    columns = (
        _labview(rows, names) if _LAST_HEADER.lower() in {line.strip().lower() for line in lines} else {}
    )
    return Preamble(rate, columns or _volt_scales(rows, lines, names))


def _rate(line: str) -> float | None:
    """Rows per second by one line."""
    for pattern, inverse in ((_RATE, False), (_STEP, True)):
        found = pattern.search(line)
        if found is None or not found.start() < 40:
            continue
        number = re.search(_NUMBER, line[found.end() :])
        value = _value(number[1]) if number else None
        if number is None or value is None or not value > 0:
            continue
        after = line[found.end() + number.end() :]
        unit = re.match(r"\s*" + _UNIT.format("a"), after, re.I) or re.search(
            r"[\[(]\s*" + _UNIT.format("a"), line[found.end() : found.end() + number.start()], re.I
        )
        value *= _FACTORS[unit["a"].lower()] if unit else 1.0
        return 1 / value if inverse else value
    return None


def _value(word: str) -> float | None:
    """A number; a comma is decimal unless it parts thousands, as in 2,000."""
    thousands = re.fullmatch(r"[1-9]\d{0,2}(,\d{3})+(\.\d+)?", word)
    try:
        return float(word.replace(",", "" if thousands else "."))
    except ValueError:
        return None


def _labview(rows: dict[str, list[str]], names: Sequence[str]) -> dict[str, Stated]:
    """Units of the channels of a LabVIEW measurement file, whose first column is the time in seconds."""
    found = {names[0]: Stated("s")} if names and names[0] == "X_Value" else {}
    for name, symbol in zip(names[len(found) :], rows.get("y_unit_label", ()), strict=False):
        if known_unit(symbol.strip()):
            found[name] = Stated(symbol.strip(), "the header's Y_Unit_Label")
    return found


def _volt_scales(rows: dict[str, list[str]], lines: Sequence[str], names: Sequence[str]) -> dict[str, Stated]:
    """Channels recorded in volts, with their scales."""
    labels = {label.split()[0].strip(":"): cells for label, cells in rows.items() if label.split()}
    if not {"channel", "units", "scale"} <= set(labels):
        return {}
    if not any("volts" in line.lower() or "/v" in line.lower() for line in lines):
        return {}
    found = {}
    offsets = labels.get("offset", [])
    for place, (name, symbol, scale) in enumerate(
        zip(labels["channel"], labels["units"], labels["scale"], strict=False)
    ):
        factor = _value(scale)
        if name in names and factor and known_unit(symbol.strip()):
            offset = (_value(offsets[place]) if place < len(offsets) else None) or 0.0
            found[name] = Stated(symbol.strip(), "the file's own calibration", factor, offset)
    return found
