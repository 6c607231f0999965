"""Everything that `palpate map` says of presses: the map on a grid, lumps, next presses, disagreement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import label

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import write_text
from palpate.maps.gaussian_process import Z95
from palpate.maps.presses import AXES, Presses
from palpate.maps.stiffness_map import NextPresses, StiffnessMap, StiffnessPrediction
from palpate.maps.surface import Grid

SHOWN = 2500
"""Places of the grid that is shown and printed: finer than presses lie, and a page of 200 kB."""


@dataclass(frozen=True)
class Lump:
    """A connected part of the surface that is more likely than not stiffer than a threshold.

    Args:
        place: of its stiffest point (d,) [m].
        stiffness: there [N/m].
        ci95: 95 % interval of it [N/m].
        area: where it is more likely than not above the threshold [m^2].
        area95: the same where the probability is above .975, and where it is above .025 [m^2]; place by place.
        is_sure: whether its stiffest point is above the threshold with a probability above .975, and stays so without
            the presses that their neighbours contradict.
        unless: the contradicted press without which the lump is not sure: it may be an outlier instead; "" if none.
    """

    place: tuple[float, ...]
    stiffness: float
    ci95: tuple[float, float]
    area: float
    area95: tuple[float, float]
    is_sure: bool
    unless: str = ""


def lumps_of(grid: Grid, prediction: StiffnessPrediction, threshold: float) -> list[Lump]:
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
        halo = (around.ravel() == around.ravel()[top]) & (part | (parts.ravel() == 0))
        low, area, high = (
            float(np.sum(each) * grid.cell) for each in (part & (probability > 0.975), part, halo)
        )
        where, (left, right) = tuple(map(float, grid.places[top])), map(float, prediction.ci95[top])
        sure = bool(probability[top] > 0.975)
        result.append(Lump(where, float(prediction.stiffness[top]), (left, right), area, (low, high), sure))
    return sorted(result, key=lambda lump: -lump.stiffness)


@dataclass(frozen=True)
class MapRequest:
    """Options of a map.

    Args:
        next: number of next presses.
        stiffer_than: threshold of lumps, whose edge the next presses seek [N/m]; None for none.
        half: relative half-width for which the number of further presses is foretold; None for none.
        common: standard deviation of the error common to all presses, relative [1].
    """

    next: int = 5
    stiffer_than: float | None = None
    half: float | None = None
    common: float = 0.0


@dataclass(frozen=True)
class MapResult:
    """A map of presses and what follows from it.

    Args:
        presses: with their places.
        request: what was asked.
        map: of the presses.
    """

    presses: Presses
    request: MapRequest
    map: StiffnessMap

    @cached_property
    def grid(self) -> Grid:
        """Places that are shown."""
        return self.map.grid(SHOWN)

    @cached_property
    def prediction(self) -> StiffnessPrediction:
        """The stiffness at the grid."""
        return self.map.predict(self.grid.places)

    @cached_property
    def lumps(self) -> list[Lump]:
        """Parts stiffer than the threshold; none without a threshold."""
        threshold = self.request.stiffer_than
        lumps = [] if threshold is None else lumps_of(self.grid, self.prediction, threshold)
        wrong = self.map.disagreeing()
        if threshold is None or not wrong or not lumps:
            return lumps
        tops = np.array([lump.place for lump in lumps])
        stay = self._without(wrong, tops, threshold) > 0.975
        nearest = np.linalg.norm(self.map.places[wrong] - tops[:, None], axis=2).argmin(axis=1)
        return [
            replace(lump, is_sure=bool(sure), unless="" if sure else self.presses.names[wrong[k]])
            if lump.is_sure
            else lump
            for lump, sure, k in zip(lumps, stay, nearest, strict=True)
        ]

    def _without(self, presses: Sequence[int], places: Array, threshold: float) -> Array:
        """Probability of a stiffness above a threshold by all other presses (n,); 0 where these span no surface."""
        others = StiffnessMap(self.request.common)
        line = self.presses.line
        columns = (self.map.places, self.map.stiffness, self.map.half, line)
        try:
            others.update(*(None if each is None else np.delete(each, presses, axis=0) for each in columns))
            return others.predict(places).exceeds(threshold)
        except InputError:
            return np.zeros(len(places))

    @cached_property
    def next(self) -> NextPresses:
        """The places to press next."""
        return self.choose(max(self.request.next, 1))

    def choose(self, count: int, candidates: Array | None = None) -> NextPresses:
        """The next presses, among candidates (m, d) [m] if they are given."""
        return self.map.next(count, candidates, stiffer_than=self.request.stiffer_than)

    @property
    def repeat(self) -> float:
        """Relative half-width by which two presses at one place differ, 95 %, beyond their own intervals."""
        return float(np.expm1(Z95 * self.map.process.repeat))

    def to_json(self) -> dict[str, Any]:
        """The answer for programs; docs/json.md has the keys."""
        inside = self.grid.inside
        prediction = self.prediction
        columns = {"stiffness": prediction.stiffness, "low": prediction.ci95[:, 0], "high": prediction.ci95[:, 1],
                   "next_low": prediction.next95[:, 0], "next_high": prediction.next95[:, 1]}  # fmt: skip
        if self.request.stiffer_than is not None:
            columns["stiffer"] = prediction.exceeds(self.request.stiffer_than)
        answer: dict[str, Any] = {
            "places": _rows(
                self.map.places,
                {"stiffness": self.map.stiffness, "half": self.map.half},
                self.presses.names,
            ),
            "map": _rows(
                self.grid.places[inside], {name: values[inside] for name, values in columns.items()}
            ),
            "next": _rows(self.next.places, {"expected_half": self.next.expected_half})[: self.request.next],
            "repeat_half": self.repeat,
            "line_half": float(np.expm1(Z95 * self.map.process.shared)),
            "disagreeing": [self.presses.names[i] for i in self.map.disagreeing()],
            "refused": self.presses.refused,
        }
        if self.request.stiffer_than is not None:
            answer |= {
                "stiffer_than": self.request.stiffer_than,
                "lumps": [asdict(lump) for lump in self.lumps],
            }
        if self.request.half is not None:
            answer |= {
                "half_asked": self.request.half,
                "presses_until": self.map.presses_until(self.request.half),
            }
        return answer

    def write_csv(self, path: Path) -> None:
        """The map as a table: a row a place, in m and N/m."""
        rows = self.to_json()["map"]
        _write_table(path, list(rows[0]), [list(row.values()) for row in rows], 6)

    def write_presses(self, path: Path) -> None:
        """The presses as a table that `palpate map --table` reads, in m and N/m."""
        p = self.presses
        names = [*AXES[: p.places.shape[1]], "stiffness", "half"]
        _write_table(path, names, np.column_stack([p.places, p.stiffness, p.half]), 9)


def map_of(presses: Presses, request: MapRequest) -> MapResult:
    """The map of presses.

    Raises:
        InputError: they span no surface, or one place has two stiffnesses.
    """
    result = StiffnessMap(request.common)
    result.update(presses.places, presses.stiffness, presses.half, presses.line)
    result.surface.grid(1)
    return MapResult(presses, request, result)


def _write_table(path: Path, names: Sequence[str], rows: Any, digits: int) -> None:
    lines = [",".join(["map (palpate)", *names])]
    lines += [",".join(f"{v:.{digits}g}" for v in (i + 1, *row)) for i, row in enumerate(rows)]
    write_text(path, "\n".join(lines) + "\n")


def _rows(places: Array, columns: dict[str, Array], names: Sequence[str] = ()) -> list[dict[str, Any]]:
    rows = []
    for i, place in enumerate(places):
        where = dict(zip(AXES, map(float, place), strict=False))
        row = where | {name: float(v[i]) for name, v in columns.items() if np.isfinite(v[i])}
        rows.append(row | ({"name": names[i]} if names else {}))
    return rows
