"""Many logs in a sentence and as tables: of every output, and of a paper."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.files import write_text
from palpate.identification.causes import cause_of
from palpate.identification.pooling import Pooled, PooledParameter, PooledPoint
from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification import words
from palpate.report.page import CommandAnswer, Table
from palpate.units import NONE, plain, quantity, si_prefix, with_half

POINT = "working point"


@dataclass(frozen=True)
class LogRow:
    """One log of many.

    Args:
        source: where it is from.
        found: None if the log could not be read.
        error: why not, in one line.
    """

    source: words.Source
    found: Identification | None
    error: str = ""

    def value_of(self, name: str) -> Parameter | None:
        """A parameter of it, or the stiffness at the working point; None if it has none."""
        if self.found is None:
            return None
        if name == POINT:
            return self.found.working_point.stiffness if self.found.working_point else None
        return self.found.parameters.get(name)

    def to_json(self) -> dict[str, Any]:
        """As of one log; a log that could not be read has an `error` and nothing else."""
        if self.found is None:
            return {"file": self.source.file, "error": self.error}
        return words.as_json(self.found, self.source)


def json_of(rows: Sequence[LogRow], pooled: Pooled) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for many logs."""
    return {"logs": [row.to_json() for row in rows], "pooled": pooled.to_json()}


def quantities(pooled: Pooled) -> dict[str, PooledParameter]:
    """All that is pooled, the working point first."""
    first = {POINT: pooled.working_point.stiffness} if pooled.working_point else {}
    return first | pooled.parameters


def quantities_with_number(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """The quantities that at least one log gives a number."""
    return [name for name in quantities(pooled) if any(has_number(row, name) for row in rows)]


def has_number(row: LogRow, name: str) -> bool:
    """Whether a log gives a quantity a number."""
    p = row.value_of(name)
    return p is not None and p.value is not None


def sentence(rows: Sequence[LogRow], pooled: Pooled) -> str:
    """The pooled stiffness, the prediction of the next press, its place, its largest cause, and the next step."""
    point = pooled.working_point
    if point is None:
        return f"None of {len(rows)} logs shows a stiffness at a working point."
    own = point.stiffness.parameter
    where = place(rows, point)
    if own.value is None:
        return f"The {len(rows)} logs show no stiffness together {where}: {own.reason}."
    limit = cause_of(next(iter(own.budget), None))
    after = point.stiffness.prediction95
    changes = [p for p in point.stiffness.slopes.values() if p.value is not None]
    by = f", it changes by {' and '.join(map(words.full_number, changes))}" if changes else ""
    again = f", the next press is predicted at {words.interval(after, own.unit)} (95 %)" if after else ""
    return (
        f"Over {len(point.stiffness.logs)} of {len(rows)} logs the stiffness is {words.full_number(own)}{by}{again},"
        f" {where}; its uncertainty is mostly due to {limit.described}: {limit.remedy}."
    )


def slopes(pooled: Pooled) -> dict[str, Parameter]:
    """How each quantity depends on each covariate, by "K by temperature_C"."""
    return {
        f"{name} by {covariate}": p
        for name, own in quantities(pooled).items()
        for covariate, p in own.slopes.items()
    }


def place(rows: Sequence[LogRow], point: PooledPoint) -> str:
    """The ranges of force, depth and frequency that it belongs to."""
    found = next((row.found for row in rows if row.found is not None), None)
    force, position = words.units_of(found) if found else ("N", "m")

    def spread(ends: tuple[float, float], unit: str) -> str:
        low, high = (f"{plain(x, 2)} Hz" if unit == "Hz" else quantity(x, unit) for x in ends)
        return low if low == high else f"{low} to {high}"

    depth, frequency = spread(point.depth_m, position), spread(point.frequency_Hz, "Hz")
    known = [f", {name} {plain(value)}" for name, value in point.stiffness.at.items()]
    return f"at {spread(point.force_N, force)}, {depth} deep and {frequency}{''.join(known)}"


def failures(rows: Sequence[LogRow]) -> str:
    """How many logs could not be read; nothing if all could."""
    count = sum(row.found is None for row in rows)
    if not count:
        return ""
    return f"{count} of {len(rows)} logs could not be identified; their rows say why."


def answer_of(rows: Sequence[LogRow], pooled: Pooled) -> CommandAnswer:
    """The answer of `palpate identify` for many logs."""
    files = [{"file": row.source.file, "sha256": row.source.sha256} for row in rows]
    json = {"files": files, **json_of(rows, pooled)}
    doubts = [
        f"! {row.source.title}: {text}"
        for row in rows
        if row.found
        for text in words.unit_warnings(row.found)
    ]
    return CommandAnswer(json, sentence(rows, pooled), "", tables(rows, pooled), notes(rows, pooled), doubts)


def notes(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """Why a pooled quantity is not identified, and why a log is not."""
    own = {name: whole.parameter for name, whole in quantities(pooled).items()} | slopes(pooled)
    reasons = [f"{name}: {p.reason}" for name, p in own.items() if p.verdict is not Verdict.IDENTIFIED]
    return [*reasons, *faults(rows)]


def faults(rows: Sequence[LogRow]) -> list[str]:
    """How many logs could not be identified, and why each could not."""
    errors = [f"{row.source.title}: {row.error}" for row in rows if row.found is None]
    return [failures(rows), *errors] if errors else []


def tables(rows: Sequence[LogRow], pooled: Pooled, *, places: bool = False) -> list[Table]:
    """Each log, what is pooled, and how that depends on covariates; with places and models of the logs if asked."""
    parts = [_logs(rows, pooled, places), together(pooled)]
    return [*parts, *([_dependences(pooled)] if slopes(pooled) else [])]


def _logs(rows: Sequence[LogRow], pooled: Pooled, places: bool) -> Table:
    """A row a log: its quantities, and the verdict of its stiffness, as of one log alone."""
    names = quantities_with_number(rows, pooled)
    units = [f"{_title(name)}{_unit(quantities(pooled)[name].parameter)}" for name in names]
    lines = []
    for row in rows:
        *place, verdict = _place_and_verdict(row)
        numbers = (_cell(row.value_of(name)) for name in names)
        lines.append((row.source.title, *numbers, *(place if places else ()), verdict))
    return Table("", ("log", *units, *(("at", "model") if places else ()), "verdict"), lines)


def _place_and_verdict(row: LogRow) -> tuple[str, str, str]:
    """Where a log's working point is, its model, and the verdict of its stiffness."""
    if row.found is None:
        return NONE, NONE, "not identified"
    point = row.found.working_point
    if point is None:
        return NONE, row.found.model, "no working point" if row.found.contacts else "no contact"
    own = row.found.parameters["K"] if words.by_the_model(row.found) else point.stiffness
    return ", ".join(words.facts_of(row.found, point)), row.found.model, str(own.verdict)


def together(pooled: Pooled) -> Table:
    """Each quantity over all logs: mean, next press, deviation between logs, and the verdict."""
    rows = []
    for name, own in quantities(pooled).items():
        p = own.parameter
        mean = NONE if p.value is None else words.full_number(p)
        between = NONE if own.between is None else quantity(own.between, p.unit, digits=2)
        count = f"{len(own.logs)} of {pooled.count}"
        rows.append(
            (name, mean, words.interval(own.prediction95, p.unit) or NONE, between, count, str(p.verdict))
        )
    return Table("", ("pooled", "mean ± 95 %", "next press", "between", "logs", "verdict"), rows)


def _dependences(pooled: Pooled) -> Table:
    rows = [
        (
            name,
            (words.interval(p.ci95, p.unit) if p.value is None else words.full_number(p)) or NONE,
            str(p.verdict),
        )
        for name, p in slopes(pooled).items()
    ]
    return Table("", ("dependence", "± 95 %", "verdict"), rows)


def _cell(p: Parameter | None) -> str:
    return NONE if p is None or p.value is None else words.number(p)


def _unit(p: Parameter) -> str:
    return f" [{words.unit(p)}]" if words.unit(p) else ""


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
            ("mean", *(text for p, factor in own for text in _number(p.parameter if p else None, factor))),
            (
                "next press",
                *(text for p, factor in own for text in _next(p.prediction95 if p else None, factor)),
            ),
            ("deviation", *(text for p, factor in own for text in _deviation(p, factor))),
        ]
        for name in dict.fromkeys(name for p in whole.values() for name in p.slopes):
            slopes_of = [(p.slopes.get(name) if p else None, factor) for p, factor in own]
            body.append((f"per {name}", *(text for pair in slopes_of for text in _number(*pair))))
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
    return [text for name, (factor, _) in scales.items() for text in _number(row.value_of(name), factor)]


def _number(p: Parameter | None, factor: float) -> tuple[str, str]:
    if p is None or p.value is None:
        return "", ""
    return _pair(p.value / factor, (p.ci95[1] - p.ci95[0]) / 2 / factor if p.ci95 else 0.0)


def _pair(value: float, half: float) -> tuple[str, str]:
    """A value and its half-width, with as many digits as the latter means."""
    left, _, right = with_half(value, half).partition(" ± ")
    plain = re.fullmatch(r"[-0-9.]+", left) and re.fullmatch(r"[-0-9.]+", right)
    return (left, right) if plain else (f"{value:.6g}", f"{half:.2g}" if half else "")


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
