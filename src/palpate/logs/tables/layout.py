"""Layout of a text log: its delimiter, its first row, the names and units above it."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import groupby
from pathlib import Path

from palpate.errors import InputError
from palpate.files.reading import ReadingBudget
from palpate.logs.naming import read_name
from palpate.logs.tables.lines import THOUSANDS, Dialect, TextLine
from palpate.logs.tables.sheet import Stated
from palpate.units import known_unit, unit

_DIALECTS = (
    Dialect(","),
    Dialect(";"),
    Dialect(";", decimal_comma=True),
    Dialect("\t"),
    Dialect("\t", decimal_comma=True),
    Dialect("|"),
    Dialect("|", decimal_comma=True),
    Dialect(" "),
    Dialect(" ", decimal_comma=True),
    Dialect(",", decimal_comma=True),  # between quotes
)
"""Dialects in the order of preference, among those that split a log equally well."""
_NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "space"}


@dataclass(frozen=True)
class Layout:
    """Layout of a text log.

    Args:
        dialect: delimiter of the cells and format of the numbers.
        names: of the columns; numbers from 0 where the file has no header.
        units: the row of units below the header, by name; empty without one.
        first_row: the line of the file, from 1, that holds the first row of numbers.
        header: the text of the header's line; empty without one.
        above: the lines before the header.
        quoted: cells may stand in quotes.
        glued: line of the names that the first row hangs on; 0 of other texts.
    """

    dialect: Dialect
    names: tuple[str, ...]
    units: dict[str, str]
    first_row: int
    header: str
    above: tuple[str, ...]
    quoted: bool
    glued: int = 0

    @property
    def delimiter_name(self) -> str:
        """Name of the delimiter in a sentence."""
        return _NAMES.get(self.dialect.delimiter, repr(self.dialect.delimiter))


def find_layout(
    path: Path, lines: Sequence[TextLine], budget: ReadingBudget, delimiter: str | None = None
) -> Layout:
    """Look at the first lines of a text log.

    Args:
        path: of the log.
        lines: its first.
        budget: of it.
        delimiter: between two cells; found when None.

    Raises:
        InputError: they hold no rows of numbers, or a header that does not fit the rows.
    """
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"the delimiter must be one character, got {delimiter!r}")
    plain = [line for line in lines if not line.comment]
    if not plain:
        raise InputError(f"{path} is empty; give a log with a row of numbers for each sample")
    block = _find_block(tuple(plain), delimiter)
    budget.take(0)
    if block is None:
        if delimiter is not None:
            separator = _NAMES.get(delimiter, repr(delimiter))
            raise InputError(
                f"{path} holds no rows of numbers separated by {separator}; is the delimiter right?"
            )
        if len(plain) == 1 and len(_DIALECTS[0].split(plain[0].text)) > 1:
            raise InputError(f"{path} holds a header and no rows; give a log with a row for each sample")
        raise InputError(f"{path} holds no rows of numbers in columns; give a log with a row for each sample")
    if block.dialect.delimiter != ";":
        lines = [replace(line, comment=True) if line.text[0] == ";" else line for line in lines]
    return _layout(path, lines, block)


@dataclass(frozen=True)
class _Block:
    """The rows of numbers, as far as they are looked at.

    Args:
        dialect: likewise.
        first: line of the first.
        width: cells in each.
        filled: columns up to the last that holds something.
        score: how well this dialect suits: no other text, a delimiter that is seen, most numbers.
        quoted: some cells stand in quotes.
    """

    dialect: Dialect
    first: int
    width: int
    filled: int
    score: tuple[bool, bool, float]
    quoted: bool


@lru_cache(maxsize=1)
def _find_block(lines: tuple[TextLine, ...], delimiter: str | None) -> _Block | None:
    """The rows of numbers in the dialect that suits best; the last answer is kept, as a log is opened several times."""
    tried = [p for p in _DIALECTS if delimiter in {None, p.delimiter}]
    if not tried and delimiter is not None:
        tried = [Dialect(delimiter), Dialect(delimiter, decimal_comma=delimiter != ",")]
    blocks = [block for block in (_longest_block(lines, dialect) for dialect in tried) if block is not None]
    return max(blocks, key=lambda block: block.score, default=None)


def _longest_block(lines: Sequence[TextLine], dialect: Dialect) -> _Block | None:
    """The rows of numbers in one dialect: the longest run of lines of one width that hold some."""
    cells = [dialect.split(line.text) for line in lines]
    kinds = dialect.kinds(cells)
    runs = [
        (width, list(group))
        for width, group in groupby(range(len(lines)), lambda i: len(kinds[i]) if 1 in kinds[i] else 0)
        if width
    ]
    if not runs:
        return None
    width, run = max(runs, key=lambda run: (len(run[1]), run[1][-1]))
    usual = [Counter(kinds[i][index] for i in run).most_common(1)[0][0] for index in range(width)]
    numeric = [index for index, kind in enumerate(usual) if kind == 1]
    if not numeric:
        return None
    first = next((i for i in range(run[-1] + 1) if _is_row(kinds[i], width, numeric)), None)
    if first is None:
        return None
    first = _below_header(kinds, width, first, numeric)
    filled = max(index for index in range(width) if any(cells[i][index] for i in run)) + 1
    text = usual.count(-1)
    delimited = dialect.delimiter != " " and width > 1
    quoted = any('"' in lines[i].text for i in run)
    return _Block(
        dialect, lines[first].number, width, filled, (not text, delimited, len(numeric) - text), quoted
    )


def _below_header(kinds: Sequence[Sequence[int]], width: int, first: int, numeric: Sequence[int]) -> int:
    """The first row: lines between the header and it that hold numbers are rows, though a cell of them is wrong.

    One number beside a word is a label and its value; numbers where the rows have none are of a table beside them.
    """
    begin = first
    while (
        begin > 0
        and len(above := kinds[begin - 1]) == width
        and sum(above[index] == 1 for index in numeric) >= (2 if width == 2 else 1)
    ):
        begin -= 1
    named = (
        begin > 0 and len(above := kinds[begin - 1]) == width and all(above[index] < 1 for index in numeric)
    )
    return begin if named else first


def _is_row(kinds: Sequence[int], width: int, numeric: Sequence[int]) -> bool:
    """True if a line is a row as the others are: as wide, with numbers in half of the places where they have some.

    A line that begins with a word, among lines that begin with a number, is a label and its value.
    """
    labelled = numeric[0] == 0 and bool(kinds) and kinds[0] < 0
    complete = len(kinds) == width and not labelled
    return complete and 2 * sum(kinds[index] == 1 for index in numeric) >= len(numeric)


def _layout(path: Path, lines: Sequence[TextLine], block: _Block) -> Layout:
    above = [line for line in lines if line.number < block.first]
    symbols: list[str] = []
    titles, cells = ([block.dialect.header(line.text) for line in above[-2:]] + [[], []])[:2]
    if len(above) > 1 and _is_units(titles, cells, block):
        symbols = cells
        above = above[:-1]
    unglued = _unglue(above[-1], block) if above else []
    glued = above[-1].number if unglued else 0
    titles = unglued or (_header(above[-1], block) if above else [])
    header = above.pop().text if titles else ""
    if titles and len(titles) < block.filled:
        raise InputError(
            f"{path}: its rows hold more cells than its header's {len(titles)}; name every column,"
            " or part the cells by something that no number holds"
        )
    names = titles[: max(block.filled, min(len(titles), block.width))]
    names = [name or str(i) for i, name in enumerate(names)] or [str(i) for i in range(block.filled)]
    units = {name: symbol.strip("[]() ") for name, symbol in zip(names, symbols, strict=False)}
    return Layout(
        block.dialect,
        tuple(names),
        {name: symbol for name, symbol in units.items() if symbol},
        block.first,
        header,
        tuple(line.text for line in above),
        block.quoted,
        glued,
    )


def _is_units(titles: Sequence[str], cells: Sequence[str], block: _Block) -> bool:
    """True if a line is a row of units: fewer other words, and at least half of the names above it have one."""
    symbols = [cell.strip("[]() ") for cell in cells]
    units = [symbol for symbol in symbols if symbol and known_unit(symbol)]
    words = [symbol for symbol in symbols if symbol and not known_unit(symbol)]
    names = sum(bool(title) for title in titles[: block.filled]) or block.filled
    return len(cells) >= block.filled and len(units) >= max(1, names / 2) and len(words) < len(units)


def _header(line: TextLine, block: _Block) -> list[str]:
    """The names in the line above the rows; none if it is something else.

    A header may be parted otherwise than its rows are; it then has a name for each column.
    """
    text = line.text.lstrip("; ") if line.comment else line.text
    titles = _trim_cells(block.dialect.header(text))
    if len(titles) == block.filled:
        return titles
    for dialect in _DIALECTS:
        fitting = _trim_cells(dialect.header(text))
        if len(fitting) == block.filled > 1:
            return fitting
    words = all(block.dialect.kind(cell) < 1 for cell in titles[: block.filled])
    if line.comment or block.dialect.delimiter == " " or not words or 2 * len(titles) < block.filled:
        return []
    return titles if len(titles) > 1 or block.filled == 1 else []


def _unglue(line: TextLine, block: _Block) -> list[str]:
    """The names in a line whose end is the first row, as the line break between them is missing; none otherwise."""
    cells = block.dialect.header(line.text) if block.dialect.delimiter != " " else []
    if len(cells) != 2 * block.filled - 1 or block.filled < 2:
        return []
    glued = re.fullmatch(r"(.+?)\s*([+-]?\d[\d.]*(?:[eE][+-]?\d+)?)", cells[block.filled - 1])
    titles = cells[: block.filled - 1]
    if glued is None or any(block.dialect.kind(cell) == 1 for cell in titles):
        return []
    return [*titles, glued[1]]


def _trim_cells(cells: list[str]) -> list[str]:
    """Cells without quotes, and without empty ones at the end."""
    while cells and not cells[-1]:
        cells = cells[:-1]
    return [cell.strip('"') for cell in cells]


_FACTORS = {"hz": 1.0, "khz": 1e3, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6}
_NUMBER = r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)"
_UNIT = r"(?P<{}>k?hz|ms|us|sec|s)\b"
_RATE = re.compile(r"\b(sampl\w*|scan|acquisition|acq|data|logging)[\s_-]*(rate|freq\w*)\b", re.I)
_STEP = re.compile(r"\b(sampl\w*|scan|acquisition)[\s_-]*(interval|period|time|step)\b|^delta_x\b", re.I)
_MAX_RATE_LETTERS = 200
"""Letters of a line in which it may state the rate."""
LABVIEW_HEADER_END = "***End_of_Header***"


@dataclass(frozen=True)
class Preamble:
    """Statements of the lines above the rows.

    Args:
        rate: rows per second [1/s]; None if they do not say.
        columns: by name.
        speed: of the probe [m/s], likewise.
        spring: stiffness of a cantilever [N/m], likewise.
    """

    rate: float | None = None
    columns: dict[str, Stated] = field(default_factory=dict)
    speed: float | None = None
    spring: float | None = None


def read_preamble(lines: Sequence[str], names: Sequence[str], cells: Sequence[str] = ()) -> Preamble:
    """Read rate, units and scales from the lines above the rows.

    A line of labels, such as `Units` and then a cell for each channel, goes by the line `Channel` with their names;
    those of LabVIEW stand in the order of the columns.

    Args:
        lines: above the header.
        names: of the columns.
        cells: of the first row.
    """
    rate = next(
        (frequency for frequency in (_rate(line[:_MAX_RATE_LETTERS]) for line in lines) if frequency), None
    )
    rows = {cells[0].lower(): cells[1:] for cells in (line.split("\t") for line in lines) if len(cells) > 1}
    columns = (
        _labview(rows, names)
        if LABVIEW_HEADER_END.lower() in {line.strip().lower() for line in lines}
        else {}
    )
    matches = (_LABEL.match(line[:_MAX_RATE_LETTERS]) for line in lines)
    labels: list[_Label] = [(m[1], m[2], m[3], m[4]) for m in matches if m]
    spring = _labelled_ratio(labels, r"(?:spring|force).?const", ("force", "length")) or _labelled_plain(
        labels, r"spring.?const"
    )
    speed = _labelled_ratio(
        labels, r"(?:z|approach|tip|ramp|extend|forward).?(?:rate|speed|velocity)", ("length", "time")
    )
    columns = columns or _volt_scales(rows, lines, names) or _counts(labels, names, cells)
    return Preamble(rate, columns or _cantilever(labels, names, spring), speed, spring)


_LABEL = re.compile(
    r"[\s#%;\"'-]*([A-Za-z][A-Za-z .()/_-]{1,50}?)(?:[\"']?[\s]*[\[(,]\s*([A-Za-z\u00b5/]{1,8})\s*[\])]?)?[\"']?\s*"
    r"[:=\t,]\s*[\"']?([+-]?[\d.]+(?:[eE][+-]?\d+)?|[A-Za-z\u00b5]{1,5}$)\s*([A-Za-z\u00b5/]{0,8})"
)
"""A label, its unit in brackets or behind a comma, its value, and the unit behind that."""
_VOLTS = {"V": 1.0, "mV": 1e-3}
_Label = tuple[str, str | None, str, str]


def _ratio(symbol: str) -> tuple[str, str, float] | None:
    """Quantities and factor to SI of a unit such as `nN/nm` or `nm/V`."""
    top, slash, bottom = symbol.partition("/")
    parts = [
        ("voltage", _VOLTS[part]) if part in _VOLTS else (unit(part).quantity, unit(part).factor)
        for part in (top, bottom)
        if part in _VOLTS or known_unit(part)
    ]
    return (parts[0][0], parts[1][0], parts[0][1] / parts[1][1]) if slash and len(parts) == 2 else None


def _labelled_ratio(labels: Sequence[_Label], pattern: str, quantities: tuple[str, str]) -> float | None:
    """The value of a label in SI, where its unit is a ratio of two quantities."""
    for label, before, number, after in labels:
        ratio = _ratio(before or after or "")
        value = _value(number)
        if re.search(pattern, label, re.IGNORECASE) and value and ratio and ratio[:2] == quantities:
            return value * ratio[2]
    return None


def _labelled_plain(labels: Sequence[_Label], pattern: str) -> float | None:
    """The value of a label without a unit, which is SI."""
    numbers = (_value(number) for label, before, number, after in labels
               if re.search(pattern, label, re.IGNORECASE) and not (before or after))  # fmt: skip
    return next((number for number in numbers if number), None)


def _cantilever(labels: Sequence[_Label], names: Sequence[str], spring: float | None) -> dict[str, Stated]:
    """The force of channels in volts, by the stiffness and the sensitivity of a cantilever."""
    words = r"sensitiv|lever.?gain|inv.?ols"
    gain = _labelled_ratio(labels, words, ("voltage", "length"))
    sensitivity = _labelled_ratio(labels, words, ("length", "voltage")) or (1 / gain if gain else None)
    if spring is None or sensitivity is None:
        return {}
    volts = {name: re.search(r"[\[(]\s*(m?V)\s*[\])]$", name) for name in names}
    where = "the header's force constant and sensitivity"
    return {
        name: Stated("N", where, spring * sensitivity * _VOLTS[match[1]], of=match[1])
        for name, match in volts.items()
        if match and not re.search(r"lateral|frict|sum|ampl|phase|aux|user", name, re.IGNORECASE)
    }


def _counts(labels: Sequence[_Label], names: Sequence[str], cells: Sequence[str]) -> dict[str, Stated]:
    """Forces and torques in counts, by the counts per unit that the header states."""
    stated = {}
    for kind, usual in (("force", "N"), ("torque", "Nm")):
        label = rf"counts?.?(?:per|/).?(?:unit.?)?{kind}|{kind}.*counts?.?(?:per|/)"
        counts = _labelled_plain(labels, label)
        symbols = [
            number for name, _, number, _ in labels if re.search(rf"{kind}.?units?", name, re.IGNORECASE)
        ]
        symbol = next((symbol for symbol in symbols if known_unit(symbol)), usual)
        for name, cell in zip(names, cells, strict=False):
            if counts and read_name(name).kind == kind and re.fullmatch(r"[+-]?\d+", cell):
                stated[name] = Stated(symbol, f"the header's counts per {kind}", 1 / counts, of="count")
    return stated


def _rate(line: str) -> float | None:
    """Rows per second by one line."""
    for pattern, inverse in ((_RATE, False), (_STEP, True)):
        match = pattern.search(line)
        if match is None or not match.start() < 40:
            continue
        number = re.search(_NUMBER, line[match.end() :])
        value = _value(number[1]) if number else None
        if number is None or value is None or not value > 0:
            continue
        after = line[match.end() + number.end() :]
        unit = re.match(r"\s*" + _UNIT.format("a"), after, re.I) or re.search(
            r"[\[(]\s*" + _UNIT.format("a"), line[match.end() : match.end() + number.start()], re.I
        )
        value *= _FACTORS[unit["a"].lower()] if unit else 1.0
        return 1 / value if inverse else value
    return None


def _value(word: str) -> float | None:
    """A number; a comma is decimal unless it parts thousands, as in 2,000."""
    thousands = re.fullmatch(THOUSANDS, word)
    try:
        return float(word.replace(",", "" if thousands else "."))
    except ValueError:
        return None


def _labview(rows: dict[str, list[str]], names: Sequence[str]) -> dict[str, Stated]:
    """Units of the channels of a LabVIEW measurement file, whose first column is the time in seconds."""
    stated = {names[0]: Stated("s")} if names and names[0] == "X_Value" else {}
    for name, symbol in zip(names[len(stated) :], rows.get("y_unit_label", ()), strict=False):
        if known_unit(symbol.strip()):
            stated[name] = Stated(symbol.strip(), "the header's Y_Unit_Label")
    return stated


def _volt_scales(rows: dict[str, list[str]], lines: Sequence[str], names: Sequence[str]) -> dict[str, Stated]:
    """Channels recorded in volts, with their scales."""
    labels = {label.split()[0].strip(":"): cells for label, cells in rows.items() if label.split()}
    if not {"channel", "units", "scale"} <= set(labels):
        return {}
    if not any("volts" in line.lower() or "/v" in line.lower() for line in lines):
        return {}
    scales = {}
    offsets = labels.get("offset", [])
    for index, (name, symbol, scale) in enumerate(
        zip(labels["channel"], labels["units"], labels["scale"], strict=False)
    ):
        factor = _value(scale)
        if name in names and factor and known_unit(symbol.strip()):
            offset = (_value(offsets[index]) if index < len(offsets) else None) or 0.0
            scales[name] = Stated(symbol.strip(), "the file's own calibration", factor, offset)
    return scales
