"""Claims of the thesis about a run, as numbers as yes or no, and metrics by name, with the user's ``module:name``."""

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from palpate.bench.summary import STEADY, losses
from palpate.errors import InputError
from palpate.plugins import plugin, reason
from palpate.studies.metrics.following import (
    LIMIT,
    QUOTIENT,
    SHARE,
    estimate,
    interval_error,
    rings,
    settled_rms,
)
from palpate.studies.metrics.window import Metric, Value, Window

APART = 0.10
"""Largest relative difference between two stiffnesses that agree."""
YES_OR_NO = ("no", "yes")
OUTCOMES = ("follows", "slow", "rings")


def outcome(window: Window) -> Value:
    """0 if the force follows; 1 if it is still on its way at the ends of intervals; 2 if it shakes or rings."""
    off, shaking = interval_error(window), settled_rms(window)
    if off is None or shaking is None:
        return None
    if off > SHARE:
        return 1.0
    return 0.0 if shaking <= LIMIT and not rings(window) else 2.0


def _follows(window: Window) -> Value:
    if not window.touched:
        return None
    if window.ended or losses(window.record):
        return 0.0
    off, shaking = interval_error(window), settled_rms(window)
    return None if off is None or shaking is None else float(off <= SHARE and shaking <= LIMIT)


def _steady(window: Window) -> Value:
    if not window.touched:
        return None
    error = window.error
    if not len(error) or losses(window.record):
        return 0.0
    return float(np.std(error) <= STEADY * abs(np.mean(window["force_desired"])))


def adaptation_time(window: Window) -> Value:
    """Time from the first contact to the first interval from which on none ends far off [s].

    Far off is a mean error in the last second of more than 10 % of the desired force. None if one of the last two
    intervals ends far off (steps alternate between two forces, and only the lower one may be reached), or if contact
    was lost. The study's window does not count.
    """
    if not window.touched or losses(window.record) or window.ended:
        return None
    period = float(window.record.meta["experiment"]["force"]["period"])
    far = [
        abs(float(np.mean(error))) > SHARE * abs(float(np.mean(desired)))
        for error, desired in Window(window.record).intervals
    ]
    if not far or any(far[-2:]):
        return None
    return period * (max((i for i, off in enumerate(far) if off), default=-1) + 1)


def _negative(front: str, parameter: str) -> Callable[[Window], Value]:
    estimated = estimate(front, parameter)

    def of(window: Window) -> Value:
        value = estimated(window)
        return None if value is None else float(value < 0.0)

    return of


def _agrees(window: Window) -> Value:
    K, quotient = estimate("thesis", "K")(window), estimate(QUOTIENT, "K")(window)
    return None if K is None or not quotient else float(abs(K / quotient - 1.0) <= APART)


CLAIMS = (
    Metric(
        "follows",
        "1",
        f"whether contact is kept, the RMS error outside the steps is at most {LIMIT:g} N, and no interval ends "
        f"more than {100 * SHARE:.0f} % off",
        _follows,
        YES_OR_NO,
        "most",
    ),
    Metric(
        "outcome",
        "1",
        "follows; slow: still an error at the end of an interval; rings: no error there, but oscillation, of more than "
        f"{LIMIT:g} N RMS or with an amplitude of more than 5 % of the force at the end",
        outcome,
        OUTCOMES,
    ),
    Metric(
        "steady",
        "1",
        f"whether contact is kept and the force's standard deviation is at most {100 * STEADY:.0f} % of the desired",
        _steady,
        YES_OR_NO,
        "most",
    ),
    Metric(
        "adaptation_time",
        "s",
        "time from the first contact until every interval between steps ends within 10 %",
        adaptation_time,
        better="least",
    ),
    Metric(
        "K_agrees",
        "1",
        f"whether K by the thesis' least squares is within {100 * APART:.0f} % of force over displacement",
        _agrees,
        YES_OR_NO,
    ),
    *(
        Metric(
            f"{parameter}_negative_{front}",
            "1",
            f"whether {parameter} is negative, {front} signals",
            _negative(front, parameter),
            YES_OR_NO,
        )
        for parameter, front in (("M", "thesis"), ("M", "raw"), ("B", "raw"))
    ),
)
"""Metrics that are claims of the thesis."""


@cache
def own_metric(name: str) -> Metric:
    """A user's metric: a `Metric`, or a function of a `Window`, described by the first line of its docstring.

    It is asked only of a run that has samples in the study's window.

    Raises:
        InputError: it cannot be imported, or is neither.
    """
    metric = plugin(name).value()
    if isinstance(metric, Metric):
        return Metric(
            name, metric.unit, metric.text, _where_there_is_something(metric.of), metric.words, metric.better
        )
    if not callable(metric) or inspect.isclass(metric):
        raise InputError(
            f"{name} is a {type(metric).__name__}; a metric is a function of a Window, or a Metric"
        )
    try:
        inspect.signature(metric).bind(None)
    except (TypeError, ValueError):
        raise InputError(
            f"{name} takes {inspect.signature(metric)}; a metric takes one argument, a Window: window['force'] is a "
            "column"
        ) from None
    text = (inspect.getdoc(metric) or name).splitlines()[0].rstrip(".")
    return Metric(name, "1", text, _where_there_is_something(metric))


def try_metric(metric: Metric, window: Window) -> None:
    """Compute a metric once.

    Raises:
        InputError: it raises, or does not return a number.
    """
    try:
        metric.value_in(window)
    except Exception as error:
        raise InputError(
            f"the metric {metric.name} fails: {reason(error)}; it returns a number, or None"
        ) from error


def _where_there_is_something(of: Any) -> Any:
    def value(window: Window) -> Value:
        return of(window) if window.inside.any() else None

    return value
