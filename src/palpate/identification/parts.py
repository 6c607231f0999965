"""Does one answer fit all parts of a log? A model that describes a contact gives the same in each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.fit import Fit, part_of
from palpate.identification.estimators.least_squares import solve
from palpate.identification.models import Motion

Array = NDArray[np.float64]

_MOST_CONTACTS = 12
_SIGNIFICANT = 4.0
_EXPLAINED = 0.5
_FEWEST = 30
_ONE_WAY = ("offset", "Fc")
"""While the probe moves one way only, friction is an offset."""


@dataclass(frozen=True)
class Disagreement:
    """Two parts of a log that give different values of one parameter.

    Args:
        name: the parameter.
        parts: values by part, such as {"loading": 180.0, "unloading": 130.0}.
        spread: standard deviation of the parts' values about the whole log's.
    """

    name: str
    parts: dict[str, float]
    spread: float


def compare_parts(
    fitted: Fit, motion: Motion, force: Array, spans: NDArray[np.intp], tolerance: float
) -> list[Disagreement]:
    """Fit each part of the log by itself and name the parameters on which the parts disagree.

    They disagree where the values differ by more than the noise allows and by more than the tolerance: a misfit that
    can be proved but changes nothing that matters is none.

    Args:
        fitted: of the whole log.
        motion: its position.
        force: filtered, at the motion's rows, shape (n,).
        spans: number of the contact that each row belongs to, shape (n,).
        tolerance: largest half-width of an identified parameter's interval, as a share of its value.
    """
    found: dict[str, Disagreement] = {}
    knobs = {knob.name: fitted[knob.name] for knob in fitted.model.knobs}
    columns = np.column_stack(fitted.model.columns(motion, knobs, fitted.lag))
    for parts in _partitions(motion, spans, fitted.lag):
        if len(parts) < 2 or not _explain(fitted, columns, force, parts):
            continue
        fits = {label: part_of(fitted, motion, force, inside)[0] for label, inside in parts.items()}
        for name in fitted.model.linear:
            hit = _disagree(name, fitted, fits, tolerance) if name not in _ONE_WAY else None
            if hit and (name not in found or hit.spread > found[name].spread):
                found[name] = hit
    return list(found.values())


def _partitions(motion: Motion, spans: NDArray[np.intp], lag: float) -> list[dict[str, NDArray[np.bool_]]]:
    """Ways to cut a log in parts: loading and unloading, contact by contact, thirds of the time."""
    partitions = []
    if not motion.bonded:
        partitions.append(_ways(motion, lag))
    numbers, sizes = np.unique(spans, return_counts=True)
    if len(numbers) > 1 and not motion.bonded:
        largest = np.sort(numbers[np.argsort(sizes)[::-1][:_MOST_CONTACTS]])
        partitions.append({f"contact {int(i) + 1}": spans == i for i in largest})
    if motion.bonded:
        thirds = np.arange(len(spans)) * 3 // len(spans)
        partitions.append(
            {f"{word} third": thirds == i for i, word in enumerate(("first", "second", "last"))}
        )
    return [{k: v for k, v in parts.items() if v.sum() >= _FEWEST} for parts in partitions]


def _ways(motion: Motion, lag: float) -> dict[str, NDArray[np.bool_]]:
    speed = motion.moved(1, lag)
    still = 0.05 * float(np.percentile(np.abs(speed), 95))
    return {"loading": speed > still, "unloading": speed < -still}


def halves(fitted: Fit, motion: Motion, force: Array) -> dict[str, dict[str, float]]:
    """What loading alone and unloading alone give, by label and by parameter."""
    found = {}
    for label, inside in _ways(motion, fitted.lag).items():
        if inside.sum() >= _FEWEST:
            part = part_of(fitted, motion, force, inside)[0]
            found[label] = {name: part[name] for name in part.names}
    return found


def _explain(fitted: Fit, columns: Array, force: Array, parts: dict[str, NDArray[np.bool_]]) -> bool:
    """Whether the parts, each with its own answer, leave much less unexplained than one answer for all does."""
    own = common = 0.0
    for inside in parts.values():
        left = force[inside] - columns[inside] @ solve(columns[inside], force[inside])
        own += float(left @ left)
        common += float(fitted.residuals[inside] @ fitted.residuals[inside])
    return own < (1 - _EXPLAINED) * common


def _disagree(name: str, fitted: Fit, fits: dict[str, Fit], tolerance: float) -> Disagreement | None:
    values = {label: fit[name] for label, fit in fits.items()}
    stds = {label: fit.std(name) for label, fit in fits.items()}
    low, high = min(values, key=values.__getitem__), max(values, key=values.__getitem__)
    apart = values[high] - values[low]
    if apart < _SIGNIFICANT * float(np.hypot(stds[low], stds[high])):
        return None
    if apart < 2 * tolerance * abs(fitted[name]):
        return None
    spread = float(np.sqrt(np.mean([(value - fitted[name]) ** 2 for value in values.values()])))
    return Disagreement(name, {low: values[low], high: values[high]}, spread)
