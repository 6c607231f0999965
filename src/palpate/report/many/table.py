"""Many logs in a sentence and as tables: of every output, and of a paper."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from palpate.files import write_text
from palpate.identification.causes import cause_of
from palpate.identification.pooling import Pooled, PooledParameter, PooledPoint
from palpate.identification.result import Identification
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification import words
from palpate.report.page import Answer, Table
from palpate.units import NONE, plain, quantity, si_prefix, with_half

POINT = "working point"


@dataclass(frozen=True)
class LogRow:
    """One log of many.

    Args:
        source: where it is from.
        result: None if the log could not be read.
        error: why not, in one line.
    """

    source: words.Source
    result: Identification | None
    error: str = ""

    def parameter(self, name: str) -> Parameter | None:
        """A parameter of it, or the stiffness at the working point; None if it has none."""
        if self.result is None:
            return None
        if name == POINT:
            return self.result.working_point.stiffness if self.result.working_point else None
        return self.result.parameters.get(name)

    def to_json(self) -> dict[str, Any]:
        """The object of one log; that of a log that could not be read has only an `error`."""
        if self.result is None:
            return {"file": self.source.file, "error": self.error}
        return words.as_json(self.result, self.source)


def pooled_json(rows: Sequence[LogRow], pooled: Pooled) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for many logs."""
    return {"logs": [row.to_json() for row in rows], "pooled": pooled.to_json()}


def quantities(pooled: Pooled) -> dict[str, PooledParameter]:
    """Pooled quantities by name, the working point first."""
    first = {POINT: pooled.working_point.stiffness} if pooled.working_point else {}
    return first | pooled.parameters


def quantities_with_number(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """The quantities that at least one log gives a number."""
    return [name for name in quantities(pooled) if any(has_number(row, name) for row in rows)]


def has_number(row: LogRow, name: str) -> bool:
    """True if a log gives a quantity a number."""
    p = row.parameter(name)
    return p is not None and p.value is not None


def sentence(rows: Sequence[LogRow], pooled: Pooled) -> str:
    """The pooled stiffness, the prediction of the next press, its place, its largest cause, and the next step."""
    point = pooled.working_point
    if point is None:
        return f"None of {len(rows)} logs shows a stiffness at a working point."
    stiffness = point.stiffness.parameter
    where = place(rows, point)
    if stiffness.value is None:
        return f"The {len(rows)} logs have no common stiffness {where}: {stiffness.reason}."
    limit = cause_of(next(iter(stiffness.budget), None))
    next_press = point.stiffness.prediction95
    changes = [p for p in point.stiffness.slopes.values() if p.value is not None]
    change = f", it changes by {' and '.join(map(words.full_number, changes))}" if changes else ""
    prediction = (
        f", the next press is predicted at {words.interval(next_press, stiffness.unit)} (95 %)"
        if next_press
        else ""
    )
    return (
        f"Over {len(point.stiffness.logs)} of {len(rows)} logs the stiffness is {words.full_number(stiffness)}"
        f"{change}{prediction}, {where}; its uncertainty is mostly due to {limit.described}: {limit.remedy}."
    )


def slopes(pooled: Pooled) -> dict[str, Parameter]:
    """Slope of each quantity over each covariate, by names like "K by temperature_C"."""
    return {
        f"{name} by {covariate}": p
        for name, pooled_value in quantities(pooled).items()
        for covariate, p in pooled_value.slopes.items()
    }


def place(rows: Sequence[LogRow], point: PooledPoint) -> str:
    """Ranges of force, depth and frequency of a pooled working point, in words."""
    result = next((row.result for row in rows if row.result is not None), None)
    force, position = words.force_and_depth_units(result) if result else ("N", "m")

    def spread(ends: tuple[float, float], unit: str) -> str:
        low, high = (f"{plain(x, 2)} Hz" if unit == "Hz" else quantity(x, unit) for x in ends)
        return low if low == high else f"{low} to {high}"

    depth, frequency = spread(point.depth_m, position), spread(point.frequency_Hz, "Hz")
    known = [f", {name} {plain(value)}" for name, value in point.stiffness.at.items()]
    return f"at {spread(point.force_N, force)}, {depth} deep and {frequency}{''.join(known)}"


def failures(rows: Sequence[LogRow]) -> str:
    """A sentence on the number of logs that could not be read; empty if all could."""
    count = sum(row.result is None for row in rows)
    if not count:
        return ""
    return f"{count} of {len(rows)} logs could not be identified; their rows say why."


def build_answer(rows: Sequence[LogRow], pooled: Pooled) -> Answer:
    """The answer of `palpate identify` for many logs."""
    files = [{"file": row.source.file, "sha256": row.source.sha256} for row in rows]
    json = {"files": files, **pooled_json(rows, pooled)}
    doubts = [
        f"! {row.source.title}: {text}"
        for row in rows
        if row.result
        for text in words.unit_warnings(row.result)
    ]
    return Answer(
        json,
        sentence=sentence(rows, pooled),
        tables=tables(rows, pooled),
        notes=notes(rows, pooled),
        doubts=doubts,
    )


def notes(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """Reasons of pooled quantities and of logs that are not identified."""
    parameters = {name: pooled_value.parameter for name, pooled_value in quantities(pooled).items()} | slopes(
        pooled
    )
    reasons = [f"{name}: {p.reason}" for name, p in parameters.items() if p.verdict is not Verdict.IDENTIFIED]
    return [*reasons, *faults(rows)]


def faults(rows: Sequence[LogRow]) -> list[str]:
    """Number of logs that could not be identified, and the reason of each."""
    refused = [(row.source.title, row.error) for row in rows if row.result is None]
    errors = [f"Not identified: {why if name in why else f'{name}: {why}'}" for name, why in refused]
    return [failures(rows), *errors] if errors else []


def tables(rows: Sequence[LogRow], pooled: Pooled, *, places: bool = False) -> list[Table]:
    """Each log, what is pooled, and how that depends on covariates; with places and models of the logs if asked."""
    parts = [_logs(rows, pooled, places), together(pooled)]
    return [*parts, *([_dependences(pooled)] if slopes(pooled) else [])]


def _logs(rows: Sequence[LogRow], pooled: Pooled, places: bool) -> Table:
    """A row for each log: its quantities, and the verdict of its stiffness."""
    names = quantities_with_number(rows, pooled)
    units = [f"{_title(name)}{_unit(quantities(pooled)[name].parameter)}" for name in names]
    lines = []
    for row in rows:
        *place, verdict = _place_and_verdict(row)
        numbers = (_cell(row.parameter(name)) for name in names)
        lines.append((row.source.title, *numbers, *(place if places else ()), verdict))
    return Table("", ("log", *units, *(("at", "model") if places else ()), "verdict"), lines)


def _place_and_verdict(row: LogRow) -> tuple[str, str, str]:
    """Place of a log's working point, its model, and the verdict of its stiffness."""
    if row.result is None:
        return NONE, NONE, "not identified"
    point = row.result.working_point
    if point is None:
        return NONE, row.result.model, "no working point" if row.result.contacts else "no contact"
    stiffness = row.result.parameters["K"] if words.by_the_model(row.result) else point.stiffness
    return ", ".join(words.point_facts(row.result, point)), row.result.model, str(stiffness.verdict)


def together(pooled: Pooled) -> Table:
    """Each quantity over all logs: mean, next press, deviation between logs, and the verdict."""
    rows = []
    for name, pooled_value in quantities(pooled).items():
        p = pooled_value.parameter
        mean = NONE if p.value is None else words.full_number(p)
        between = NONE if pooled_value.between is None else quantity(pooled_value.between, p.unit, digits=2)
        count = f"{len(pooled_value.logs)} of {pooled.count}"
        rows.append(
            (
                name,
                mean,
                words.interval(pooled_value.prediction95, p.unit) or NONE,
                between,
                count,
                str(p.verdict),
            )
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


_MARK = "log (palpate)"
"""The first cell of a CSV file, which takes no comment: by it a table may be replaced."""
Row = tuple[str, ...]


def write_table(rows: Sequence[LogRow], pooled: Pooled | None, path: Path) -> None:
    """Write the table as CSV.

    Args:
        rows: one of each log.
        pooled: what they say together; None for one log.
        path: where to.

    Raises:
        InputError: palpate may not write there.
    """
    head, body = cells(rows, pooled)
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerows([(_MARK, *head[1:]), *((_as_text(name), *values) for name, *values in body)])
    write_text(path, file.getvalue())


def _as_text(name: str) -> str:
    """The name of a log, quoted where a spreadsheet would take it for a formula."""
    return f"'{name}" if name[:1] in {"=", "+", "-", "@"} else name


def cells(rows: Sequence[LogRow], pooled: Pooled | None) -> tuple[Row, list[Row]]:
    """The head and the rows; an empty cell where there is no number."""
    pooled_values = quantities(pooled) if pooled else {}
    covariates = list(dict.fromkeys(name for p in pooled_values.values() for name in p.slopes))
    labels = ["log", *(" ".join(row.source.title.split()) for row in rows)]
    point = rows[0].result.working_point if not pooled and rows[0].result else None
    if pooled:
        labels += ["n", "mean", "next press", "deviation", *(f"per {name}" for name in covariates)]
    elif point and point.prediction95:
        labels.append("next press")
    columns = []
    for name in _names(rows, pooled_values):
        factor, unit = _scale(rows, name)
        title = _title(name)
        column = [(f"{title} {unit}".strip(), f"{title} ± 95 % {unit}".strip())]
        column += [_number(row.parameter(name), factor) for row in rows]
        if name in pooled_values:
            column += _pooled_cells(pooled_values[name], factor, covariates)
        elif point and name == POINT:
            column.append(_middle_and_half(point.prediction95, factor))
        columns.append(column + [("", "")] * (len(labels) - len(column)))
    verdicts = ["verdict", *(_place_and_verdict(row)[-1] for row in rows)]
    verdicts += [""] * (len(labels) - len(verdicts))
    if pooled:
        stiffness = pooled_values[POINT if POINT in pooled_values else "K"].parameter
        verdicts[len(rows) + 2] = str(stiffness.verdict)
    head, *body = [
        (label, *chain.from_iterable(pairs), verdict)
        for label, *pairs, verdict in zip(labels, *columns, verdicts, strict=False)
    ]
    return head, body


def _pooled_cells(p: PooledParameter, factor: float, covariates: Sequence[str]) -> list[tuple[str, str]]:
    """Number of logs, mean, next press, deviation between logs, and the slope over each covariate."""
    return [
        (str(len(p.logs)), ""),
        _number(p.parameter, factor),
        _middle_and_half(p.prediction95, factor),
        ("", "") if p.between is None else (f"{p.between / factor:.2g}", ""),
        *(_number(p.slopes.get(name), factor) for name in covariates),
    ]


def _names(rows: Sequence[LogRow], pooled_values: dict[str, PooledParameter]) -> list[str]:
    """The quantities with a number, Young's modulus first, then the stiffness at the working point."""
    known = dict.fromkeys(
        [*pooled_values, *(name for row in rows if row.result for name in row.result.parameters)]
    )
    shown = [
        name for name in dict.fromkeys(["E", POINT, *known]) if any(has_number(row, name) for row in rows)
    ]
    return [name for name in shown if name in ("E", POINT) or name in known]


def _title(name: str) -> str:
    return "stiffness" if name == POINT else name


def _scale(rows: Sequence[LogRow], name: str) -> tuple[float, str]:
    """The factor and the unit of a column: that of its largest number."""
    numbers = [p for row in rows if (p := row.parameter(name)) is not None and p.value is not None]
    factor, prefix = si_prefix(max(abs(p.value or 0.0) for p in numbers), numbers[0].unit)
    return factor, "" if numbers[0].unit == "1" else f"[{prefix}{numbers[0].unit}]"


def _number(p: Parameter | None, factor: float) -> tuple[str, str]:
    if p is None or p.value is None:
        return "", ""
    return _pair(p.value / factor, (p.ci95[1] - p.ci95[0]) / 2 / factor if p.ci95 else 0.0)


def _pair(value: float, half: float) -> tuple[str, str]:
    """A value and its half-width, with as many digits as the latter means."""
    number, _, right = with_half(value, half).partition(" ± ")
    plain = re.fullmatch(r"[-0-9.]+", number) and re.fullmatch(r"[-0-9.]+", right)
    return (number, right) if plain else (f"{value:.6g}", f"{half:.2g}" if half else "")


def _middle_and_half(ends: tuple[float, float] | None, factor: float) -> tuple[str, str]:
    return ("", "") if ends is None else _pair(sum(ends) / 2 / factor, (ends[1] - ends[0]) / 2 / factor)
