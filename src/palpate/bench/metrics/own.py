"""Metrics by name: those that come with palpate, and the user's own as ``module:name``."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any

from palpate.bench.metrics.window import Look, Metric, Value
from palpate.errors import InputError
from palpate.plugins import plugin, reason


@cache
def own_metric(name: str) -> Metric:
    """A user's metric: a `Metric`, or a function of a `Look`, described by the first line of its docstring.

    It is asked only of a run that has samples in the study's window.

    Raises:
        InputError: it cannot be imported, or is neither.
    """
    found = plugin(name).value()
    if isinstance(found, Metric):
        return Metric(
            name, found.unit, found.text, _where_there_is_something(found.of), found.words, found.better
        )
    if not callable(found) or inspect.isclass(found):
        raise InputError(f"{name} is a {type(found).__name__}; a metric is a function of a Look, or a Metric")
    try:
        inspect.signature(found).bind(None)
    except (TypeError, ValueError):
        raise InputError(
            f"{name} takes {inspect.signature(found)}; a metric takes one argument, a Look: look['force'] is a column"
        ) from None
    text = (inspect.getdoc(found) or name).splitlines()[0].rstrip(".")
    return Metric(name, "1", text, _where_there_is_something(found))


def tried(metric: Metric, look: Look) -> None:
    """Asks a metric once.

    Raises:
        InputError: it raises, or does not return a number.
    """
    try:
        metric.measured(look)
    except Exception as error:
        raise InputError(
            f"the metric {metric.name} fails: {reason(error)}; it returns a number, or None"
        ) from error


def _where_there_is_something(of: Any) -> Any:
    def value(look: Look) -> Value:
        return of(look) if look.inside.any() else None

    return value
