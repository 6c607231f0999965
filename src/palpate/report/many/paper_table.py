"""Identifications as a table for a paper: a row a log, and below n, mean, the next press and the deviation.

Each quantity has two columns, its value and the half-width of its 95 % interval, both in one unit.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

from palpate.files import write_text
from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report.many.table import POINT, LogRow, has_number, quantities
from palpate.report.numbers import si_prefix, with_half

ENDINGS = (".csv", ".md", ".tex")
_MARK = "log (palpate)"
"""The first cell of a CSV file, which takes no comment: by it a table may be replaced."""
_TEX = {
    "\\": r"\textbackslash{}", "_": r"\_", "%": r"\%", "&": r"\&", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "±": r"$\pm$",
}  # fmt: skip

Row = tuple[str, ...]


def write_table(rows: Sequence[LogRow], pooled: Pooled | None, path: Path) -> None:
    """Write the table, as CSV, Markdown or LaTeX (booktabs) by the ending of its name.

    Args:
        rows: one of each log.
        pooled: what they say together; None for one log.
        path: where to.

    Raises:
        InputError: palpate may not write there.
    """
    head, body = cells(rows, pooled)
    layout = {".csv": _csv, ".md": _markdown, ".tex": _latex}[path.suffix.lower()]
    write_text(path, layout(head, body))


def cells(rows: Sequence[LogRow], pooled: Pooled | None) -> tuple[Row, list[Row]]:
    """The head and the rows; an empty cell where there is no number."""
    whole = quantities(pooled) if pooled else {}
    names = _names(rows, whole)
    scales = {name: _scale(rows, name) for name in names}
    head = (
        "log",
        *(text for name in names for text in (f"{_title(name)} {scales[name][1]}".strip(), "± 95 %")),
    )
    body = [(row.source.title, *_values(row, scales)) for row in rows]
    if pooled:
        own = [(whole.get(name), scales[name][0]) for name in names]
        body += [
            ("n", *(text for p, _ in own for text in (str(len(p.logs)) if p else "", ""))),
            ("mean", *(text for p, factor in own for text in _mean(p, factor))),
            (
                "next press",
                *(text for p, factor in own for text in _next(p.prediction95 if p else None, factor)),
            ),
            ("deviation", *(text for p, factor in own for text in _deviation(p, factor))),
        ]
    else:
        point = rows[0].found.working_point if rows[0].found else None
        again = point.prediction95 if point else None
        own_next = (_next(again if name == POINT else None, scales[name][0]) for name in names)
        body += [("next press", *(text for pair in own_next for text in pair))] if again else []
    return head, body


def _names(rows: Sequence[LogRow], whole: dict[str, PooledParameter]) -> list[str]:
    """The quantities with a number, Young's modulus first, then the stiffness at the working point."""
    own = dict.fromkeys([*whole, *(name for row in rows if row.found for name in row.found.parameters)])
    there = [name for name in dict.fromkeys(["E", POINT, *own]) if any(has_number(row, name) for row in rows)]
    return [name for name in there if name in ("E", POINT) or name in own]


def _title(name: str) -> str:
    return "stiffness" if name == POINT else name


def _scale(rows: Sequence[LogRow], name: str) -> tuple[float, str]:
    """The factor and the unit of a column: that of its largest number."""
    found = [p for row in rows if (p := row.value_of(name)) is not None and p.value is not None]
    factor, prefix = si_prefix(max(abs(p.value or 0.0) for p in found), found[0].unit)
    return factor, "" if found[0].unit == "1" else f"[{prefix}{found[0].unit}]"


def _values(row: LogRow, scales: dict[str, tuple[float, str]]) -> list[str]:
    texts: list[str] = []
    for name, (factor, _) in scales.items():
        p = row.value_of(name)
        half = (p.ci95[1] - p.ci95[0]) / 2 if p and p.ci95 else 0.0
        texts += ("", "") if p is None or p.value is None else _pair(p.value / factor, half / factor)
    return texts


def _pair(value: float, half: float) -> tuple[str, str]:
    """A value and its half-width, with as many digits as the latter means."""
    left, _, right = with_half(value, half).partition(" ± ")
    plain = re.fullmatch(r"[-0-9.]+", left) and re.fullmatch(r"[-0-9.]+", right)
    return (left, right) if plain else (f"{value:.6g}", f"{half:.2g}" if half else "")


def _mean(p: PooledParameter | None, factor: float) -> tuple[str, str]:
    if p is None or p.parameter.value is None or p.parameter.ci95 is None:
        return "", ""
    low, high = p.parameter.ci95
    return _pair(p.parameter.value / factor, (high - low) / 2 / factor)


def _next(ends: tuple[float, float] | None, factor: float) -> tuple[str, str]:
    return ("", "") if ends is None else _pair(sum(ends) / 2 / factor, (ends[1] - ends[0]) / 2 / factor)


def _deviation(p: PooledParameter | None, factor: float) -> tuple[str, str]:
    return ("", "") if p is None or p.between is None else (f"{p.between / factor:.2g}", "")


def _csv(head: Row, body: list[Row]) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([(_MARK, *head[1:]), *(_text_cell(row) for row in body)])
    return file.getvalue()


def _text_cell(row: Row) -> Row:
    """The name of a log that a spreadsheet would take for a formula is a text."""
    return (f"'{row[0]}", *row[1:]) if row[0][:1] in {"=", "+", "-", "@", "\t"} else row


def _markdown(head: Row, body: list[Row]) -> str:
    rule = ("---", *("---:" for _ in head[1:]))
    rows = [[cell.replace("|", r"\|") for cell in row] for row in (head, rule, *body)]
    return "\n".join(["<!-- Made by palpate -->", "", *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def _latex(head: Row, body: list[Row]) -> str:
    def line(row: Row) -> str:
        return " & ".join("".join(_TEX.get(letter, letter) for letter in cell) for cell in row) + r" \\"

    summary = next((i for i, row in enumerate(body) if row[0] == "n"), len(body))
    parts = [r"\toprule", line(head), r"\midrule", *map(line, body[:summary])]
    parts += [r"\midrule", *map(line, body[summary:])] if summary < len(body) else []
    begin = ["% Made by palpate", rf"\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}"]
    return "\n".join([*begin, *parts, r"\bottomrule", r"\end{tabular}", ""])
