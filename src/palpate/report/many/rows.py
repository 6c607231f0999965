"""Results of many logs: a row each, and the pooled one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from palpate.identification.pooling import Pooled, PooledParameter
from palpate.identification.result import Identification, Parameter
from palpate.report.identification.source import Source, as_json

POINT = "working point"


@dataclass(frozen=True)
class LogRow:
    """One log of many.

    Args:
        source: where it is from.
        found: None if the log could not be read.
        error: why not, in one line.
    """

    source: Source
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
        return as_json(self.found, self.source)


def json_of(rows: Sequence[LogRow], pooled: Pooled) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for many logs."""
    return {"logs": [row.to_json() for row in rows], "pooled": pooled.to_json()}


def quantities(pooled: Pooled) -> dict[str, PooledParameter]:
    """All that is pooled, the working point first."""
    first = {POINT: pooled.working_point.stiffness} if pooled.working_point else {}
    return first | pooled.parameters


def drawn(rows: Sequence[LogRow], pooled: Pooled) -> list[str]:
    """The quantities that at least one log gives a number."""
    return [name for name in quantities(pooled) if any(has_number(row, name) for row in rows)]


def has_number(row: LogRow, name: str) -> bool:
    """Whether a log gives a quantity a number."""
    p = row.value_of(name)
    return p is not None and p.value is not None
