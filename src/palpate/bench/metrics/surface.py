"""Final estimates of a run's on-line estimators, and their errors."""

from __future__ import annotations

from collections.abc import Callable

from palpate.bench.metrics.summary import FRONT_ENDS, IDENTIFIER, PARAMETERS
from palpate.bench.metrics.window import Look, Metric, Value

QUOTIENT = "force_over_displacement"
TOLD = {
    "thesis": "recursive least squares on the thesis' signals",
    "raw": "recursive least squares on raw signals",
    "matched": "recursive least squares on channels of equal lag",
    IDENTIFIER: "the experiment's [identifier]",
    QUOTIENT: "force over displacement",
}


def estimate(front: str, parameter: str) -> Callable[[Look], Value]:
    """An estimate at the end of a run, in SI units; None without contact."""

    def of(look: Look) -> Value:
        found = look.summary["identified"]
        return None if found is None else found.get(front, {}).get(parameter)

    return of


def error(front: str, parameter: str) -> Callable[[Look], Value]:
    """The estimate over the truth, less one; None where the surface has no such parameter."""
    estimated = estimate(front, parameter)

    def of(look: Look) -> Value:
        truth, found = look.summary["truth"].get(parameter), estimated(look)
        return None if truth is None or found is None or not truth["value"] else found / truth["value"] - 1.0

    return of


def _pair(front: str, parameter: str, unit: str) -> tuple[Metric, Metric]:
    name = "quotient" if front == QUOTIENT else front
    return (
        Metric(f"{parameter}_{name}", unit, f"{parameter} by {TOLD[front]}", estimate(front, parameter)),
        Metric(
            f"{parameter}_error_{name}",
            "1",
            "its error, as a share of the truth",
            error(front, parameter),
            signed=True,
        ),
    )


SURFACE = (
    *(
        m
        for front in (*FRONT_ENDS, IDENTIFIER)
        for parameter, unit in PARAMETERS.items()
        for m in _pair(front, parameter, unit)
    ),
    *_pair(QUOTIENT, "K", PARAMETERS["K"]),
)
"""Metrics of the estimators."""
