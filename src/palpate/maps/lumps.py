"""Lumps: connected parts of a surface that are stiffer than a threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from palpate.arrays import Array
from palpate.maps.stiffness_map import Prediction
from palpate.maps.surface import Grid


@dataclass(frozen=True)
class Lump:
    """A connected part of the surface that is more likely than not stiffer than a threshold.

    Args:
        place: of its stiffest point (d,) [m].
        stiffness: there [N/m].
        ci95: 95 % interval of it [N/m].
        area: where it is more likely than not above the threshold [m^2].
        area95: the same where the probability is above .975, and where it is above .025 [m^2]; place by place.
        is_sure: whether its stiffest point is above the threshold with a probability above .975.
    """

    place: tuple[float, ...]
    stiffness: float
    ci95: tuple[float, float]
    area: float
    area95: tuple[float, float]
    is_sure: bool


def lumps_of(grid: Grid, prediction: Prediction, threshold: float) -> list[Lump]:
    """The lumps on a grid within the hull of the presses, the stiffest first.

    Args:
        grid: of places.
        prediction: at them.
        threshold: [N/m].
    """
    probability = np.where(grid.inside, prediction.exceeds(threshold), 0.0)
    parts, count = label((probability > 0.5).reshape(grid.shape))
    around, _ = label((probability > 0.025).reshape(grid.shape))
    result = []
    for k in range(1, count + 1):
        part = (parts == k).ravel()
        top = int(np.argmax(np.where(part, prediction.stiffness, 0.0)))
        halo = around.ravel() == around.ravel()[top]
        area = (
            np.sum(part & (probability > 0.975)),
            np.sum(halo & ((parts.ravel() == k) | (parts.ravel() == 0))),
        )
        result.append(
            Lump(
                tuple(float(c) for c in grid.places[top]), float(prediction.stiffness[top]),
                _pair(prediction.ci95[top]),
                float(part.sum() * grid.cell), (float(area[0] * grid.cell), float(area[1] * grid.cell)),
                bool(probability[top] > 0.975),
            )
        )  # fmt: skip
    return sorted(result, key=lambda lump: -lump.stiffness)


def _pair(ends: Array) -> tuple[float, float]:
    return float(ends[0]), float(ends[1])
