"""Lines of instruments above the rows: the rate, the units, the scales of their channels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from palpate.logs.tables.sheet import Stated
from palpate.units import known_unit

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
