"""Dates and times as seconds."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from palpate.arrays import Array

if TYPE_CHECKING:
    import polars


def seconds_of_text(text: str | None) -> float | None:
    """A date and time of ISO 8601 in seconds since 1970, a time of day since midnight; None if it is neither.

    Without a zone it counts as UTC. No text at all is no reading: NaN.
    """
    if not text:
        return math.nan
    if len(text) < len("12:00:00") or not text[:2].isdigit():
        return None
    try:
        moment = datetime.fromisoformat(text if text[2] != ":" else f"1970-01-01T{text}")
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def seconds_of_cells(cells: polars.Series) -> Array:
    """A column of dates, times or durations in seconds, NaN where there is none."""
    import polars

    if cells.dtype == polars.Date:
        cells = cells.cast(polars.Datetime("ns"))
    if cells.dtype != polars.Time:  # which counts nanoseconds as it stands
        cells = cells.dt.cast_time_unit("ns")
    seconds: Array = cells.to_physical().cast(polars.Float64).to_numpy() / 1e9
    return seconds
