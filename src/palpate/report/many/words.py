"""The pooled result of many logs, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.identification.causes import cause_of
from palpate.identification.pooling import Pooled, PooledPoint
from palpate.report.identification.words import formatted, interval, units_of
from palpate.report.many.rows import LogRow
from palpate.report.numbers import plain, quantity


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
    again = f", the next press is predicted at {interval(after, own.unit)} (95 %)" if after else ""
    return (
        f"Over {len(point.stiffness.logs)} of {len(rows)} logs the stiffness is {formatted(own)}{again}, {where};"
        f" its uncertainty is mostly due to {limit.described}: {limit.remedy}."
    )


def place(rows: Sequence[LogRow], point: PooledPoint) -> str:
    """The ranges of force, depth and frequency that it belongs to."""
    found = next((row.found for row in rows if row.found is not None), None)
    force, position = units_of(found) if found else ("N", "m")

    def spread(ends: tuple[float, float], unit: str) -> str:
        low, high = (f"{plain(x, 2)} Hz" if unit == "Hz" else quantity(x, unit) for x in ends)
        return low if low == high else f"{low} to {high}"

    depth, frequency = spread(point.depth_m, position), spread(point.frequency_Hz, "Hz")
    return f"at {spread(point.force_N, force)}, {depth} deep and {frequency}"


def failures(rows: Sequence[LogRow]) -> str:
    """How many logs could not be read; nothing if all could."""
    count = sum(row.found is None for row in rows)
    if not count:
        return ""
    return f"{count} of {len(rows)} logs could not be identified; their rows say why."
