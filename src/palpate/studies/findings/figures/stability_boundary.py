"""Where the linear model of a study's loop loses its stability, over the parameters of a map."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.bench import Experiment, changed
from palpate.controllers import NeuralController
from palpate.errors import InputError
from palpate.report.study.axes import Scale
from palpate.report.study.maps import Bound
from palpate.studies.definition.plan import Part
from palpate.studies.definition.study import flat
from palpate.studies.definition.tables import Map

LOOKED_AT = 8
"""Places along a row that are looked at first; what changes twice between two of them is not seen."""
EXACT = 5e-3
"""Of a place found, as a share of the row."""
LABEL = "linear model: stability lost"

Growing = Callable[[float], float | None]


def bounds(part: Part, asked: Map, panel: Any, x: Scale, y: Scale) -> list[Bound]:
    """Where stability is lost, along each row of a map; along each column where only the rows are numbers.

    Args:
        part: the study's own.
        asked: the map.
        panel: value of its third parameter; None where it has none.
        x: its axis across.
        y: its axis upwards.
    """
    along, across = (x, y) if x.numeric else (y, x)
    if not along.numeric:
        return []
    names = (asked.x, asked.y) if x.numeric else (asked.y, asked.x)
    found: dict[int, list[tuple[float, float]]] = {}
    for place, value in zip(across.places.tolist(), across.values, strict=True):
        fixed = flat(asked.where) | ({asked.panels: panel} if asked.panels else {})
        for i, lost in enumerate(_lost(along, _growing(part, names[0], {**fixed, names[1]: value}))):
            found.setdefault(i, []).extend([(lost, place)] if across.numeric else _over_cell(lost, place))
    lines = [list(zip(*points, strict=True)) for points in found.values()]
    return [Bound(LABEL, *((a, b) if x.numeric else (b, a))) for a, b in lines]


def equivalent(experiment: Experiment) -> Experiment:
    """The experiment with the plain integrator that its neural controller is to first order.

    Near small weights an output is A s(w) with the slope A/2 in its threshold w, and a tick's learning moves w by
    eta e A/2: the command grows by eta (A/2)² e a tick, K_i = eta (A/2)²/Ts.
    """
    c = experiment.controller
    if not isinstance(c, NeuralController):
        return experiment
    ki = c.learning_rate * (c.amplitude[0] / 2.0) ** 2 * experiment.run.rate
    table = {"kind": "proportional-integral", "kp": c.kp, "kv": c.kv, "kf": c.kf, "ki": ki}
    return changed(experiment, {"controller": table})


def _growing(part: Part, name: str, fixed: Mapping[str, Any]) -> Growing:
    """How fast the linear model grows at a value of a parameter, below 0 where it is stable; None without a model."""
    middle = {a.name: a.settings[len(a.settings) // 2] if a.settings else a.between(0.5) for a in part.axes}
    middle |= {a.name: _set(a.settings, a.labels(), fixed[a.name]) for a in part.axes if a.name in fixed}

    def growing(value: float) -> float | None:
        try:
            experiment = part.experiment({**middle, name: value})
        except InputError:
            return None
        if not isinstance(experiment, Experiment):
            return None
        # Friction is not in the linear model: panels that differ in it alone share their boundary.
        return _growth(changed(equivalent(experiment), {"friction": {}}))

    return growing


@cache
def _growth(experiment: Experiment) -> float | None:
    from palpate.analysis import linearise

    try:
        return math.log(linearise(experiment).growth)
    except InputError:
        return None


def _set(settings: Sequence[Any], labels: Sequence[Any], label: Any) -> Any:
    """The value as it is set, from what stands in the table."""
    return settings[list(labels).index(label)] if label in labels else label


def _lost(scale: Scale, growing: Growing) -> Iterator[float]:
    """The values at which stability is lost or won."""
    from scipy.optimize import brentq

    low, high = float(scale.places.min()), float(scale.places.max())

    def value(share: float) -> float:
        return low * (high / low) ** share if scale.log else low + (high - low) * share

    def rate(share: float) -> float:
        found = growing(value(share))
        return math.nan if found is None else found

    shares = [i / (LOOKED_AT - 1) for i in range(LOOKED_AT)]
    rates = [rate(share) for share in shares]
    for (a, before), (b, after) in pairwise(zip(shares, rates, strict=True)):
        if before * after < 0.0:
            with suppress(ValueError):  # no model somewhere between
                yield value(float(brentq(rate, a, b, xtol=EXACT)))


def _over_cell(lost: float, place: float) -> list[tuple[float, float]]:
    """A stroke across the row of a parameter that is no number, and a gap."""
    return [(lost, place - 0.5), (lost, place + 0.5), (np.nan, np.nan)]
