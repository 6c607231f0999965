"""Everything that `palpate map` says of presses: the map on a grid, lumps, next presses, disagreement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import label
from scipy.spatial.distance import cdist

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import whole, write_text
from palpate_maps.gaussian_process import Z95
from palpate_maps.next_press import Goal, NextPresses
from palpate_maps.presses import AXES, LEAST, Presses
from palpate_maps.stiffness_map import FieldMap, FieldPrediction, StiffnessMap
from palpate_maps.surface import Grid

SHOWN = 2500
"""Places of the grid that is shown and printed: finer than presses lie, and a page of 200 kB."""
FRAMES = 16
"""Of the map as it grew."""
TOPIC, COLUMNS = "/palpate/map", ("x", "y", "z", "stiffness", "low", "high")
"""Of an MCAP file: its topic, and the columns of its points."""


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


def lumps_of(grid: Grid, prediction: FieldPrediction, threshold: float) -> list[Lump]:
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
        goal: for which they are chosen.
        stiffer_than: threshold of lumps [N/m]; None for none.
        half: relative half-width for which the number of further presses is foretold; None for none.
        common: standard deviation of the error common to all presses, relative [1].
        start: where the robot stands (d,) [m].
        way: that it travels in the time of a press [m].
    """

    next: int = 5
    goal: Goal = "interval"
    stiffer_than: float | None = None
    half: float | None = None
    common: float = 0.0
    start: tuple[float, ...] | None = None
    way: float = float("inf")


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
    def prediction(self) -> FieldPrediction:
        """The stiffness at the grid."""
        return self.map.predict(self.grid.places)

    @cached_property
    def lumps(self) -> list[Lump]:
        """Parts stiffer than the threshold; none without a threshold."""
        threshold = self.request.stiffer_than
        return [] if threshold is None else lumps_of(self.grid, self.prediction, threshold)

    @cached_property
    def next(self) -> NextPresses:
        """Where to press next."""
        return self.choose(max(self.request.next, 1), None, start=self.request.start)

    def choose(self, count: int, candidates: Array | None, *, start: Any) -> NextPresses:
        """The next presses among candidates (m, d) [m], for a robot that stands at `start` (d,) [m]."""
        r = self.request
        return self.map.next(
            count, candidates, goal=r.goal, stiffer_than=r.stiffer_than, start=start, way=r.way
        )

    @cached_property
    def fields(self) -> dict[str, FieldPrediction]:
        """Further fields at the grid, by name: those that vary, over presses that span a surface."""
        found = {name: self._field(name) for name in self.presses.fields}
        return {name: field for name, field in found.items() if not isinstance(field, str)}

    @property
    def missing_maps(self) -> dict[str, str]:
        """Further quantities of the presses without a map, by name, each with the reason."""
        return {name: str(self._field(name)) for name in self.presses.fields if name not in self.fields}

    def _field(self, name: str) -> FieldPrediction | str:
        values = self.presses.fields[name]
        known = np.isfinite(values)
        if known.sum() < LEAST:
            return f"presses that show it: {known.sum()}; a map needs {LEAST}"
        if np.ptp(values[known]) <= 1e-9 * np.abs(values[known]).max():
            return "it is the same at every press"
        field = FieldMap(name=name)
        field.update(self.presses.places[known], values[known])
        try:
            return field.predict(self.grid.places)
        except InputError as error:
            return str(error)

    @cached_property
    def film(self) -> list[tuple[int, FieldPrediction]]:
        """The map of the first presses, of ever more of them, at `coarse`, all with the scales of the whole map."""
        whole, n = self.map.process.likeliest, len(self.map)
        counts = np.unique(np.linspace(min(n, 4), n, FRAMES).round().astype(int))
        distance = cdist(whole.places, self.coarse.places)
        frames = []
        for k in map(int, counts):
            mean, variance = whole.first(k).reduction.predict(distance[:k])
            std, common = np.sqrt(variance), self.request.common
            frames.append((k, FieldPrediction(mean, std, std, common, z95=self.map.process.z95)))
        return frames

    @cached_property
    def coarse(self) -> Grid:
        """Places of the film."""
        return self.map.grid(SHOWN // 4)

    @property
    def repeat(self) -> float:
        """Relative half-width by which two presses at one place differ, 95 %, beyond their own intervals."""
        return float(np.expm1(Z95 * self.map.process.repeat))

    def to_json(self) -> dict[str, Any]:
        """The answer for programs; docs/json.md has the keys."""
        inside, seen = self.grid.inside, self.prediction
        columns = {"stiffness": seen.stiffness, "low": seen.ci95[:, 0], "high": seen.ci95[:, 1],
                   "next_low": seen.next95[:, 0], "next_high": seen.next95[:, 1]}  # fmt: skip
        if self.request.stiffer_than is not None:
            columns["stiffer"] = seen.exceeds(self.request.stiffer_than)
        for name, field in self.fields.items():
            columns |= {name: field.value, f"{name}_low": field.ci95[:, 0], f"{name}_high": field.ci95[:, 1]}
        found: dict[str, Any] = {
            "places": _rows(
                self.map.places,
                {"stiffness": self.map.stiffness, "half": self.map.half} | self.presses.fields,
                self.presses.names,
            ),
            "units": {"stiffness": "N/m"} | self.presses.units,
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
            found |= {
                "stiffer_than": self.request.stiffer_than,
                "lumps": [asdict(lump) for lump in self.lumps],
            }
        if self.request.half is not None:
            found |= {
                "half_asked": self.request.half,
                "presses_until": self.map.presses_until(self.request.half),
            }
        return found

    def write_csv(self, path: Path) -> None:
        """The map as a table: a row a place, in m and N/m."""
        rows = self.to_json()["map"]
        _write_table(path, list(rows[0]), [list(row.values()) for row in rows], 6)

    def write_presses(self, path: Path) -> None:
        """The presses as a table that `palpate map --table` reads, in m and N/m."""
        p = self.presses
        names = [*AXES[: p.places.shape[1]], "stiffness", "half"]
        _write_table(path, names, np.column_stack([p.places, p.stiffness, p.half]), 9)

    def write_ply(self, path: Path) -> None:
        """The map as points in the PLY format, coloured from soft (dark) to stiff (light), with the stiffness."""
        inside, seen = self.grid.inside, self.prediction
        places, spread = self.grid.places[inside], seen.mean[inside]
        places = np.column_stack([places, np.zeros(len(places))])[:, :3]
        light = (255 * (spread - spread.min()) / max(float(np.ptp(spread)), 1e-12)).astype(int)
        numbers = np.column_stack([places, seen.stiffness[inside], seen.ci95[inside]])
        kinds = dict.fromkeys(COLUMNS, "float") | dict.fromkeys(("red", "green", "blue"), "uchar")
        lines = ["ply", "format ascii 1.0", "comment Made by palpate, m and N/m"]
        lines += [f"element vertex {len(places)}", *(f"property {k} {name}" for name, k in kinds.items())]
        rows = np.column_stack([numbers, light // 3, light, 155 + light // 3])
        body = (" ".join(f"{value:.6g}" for value in row) for row in rows)
        write_text(path, "\n".join([*lines, "end_header", *body]) + "\n")

    def write_mcap(self, path: Path) -> None:
        """The map as it grew, a second for each press, as point clouds [m, N/m] for Foxglove and Lichtblick.

        Raises:
            InputError: foxglove-sdk is not installed, or palpate may not write there.
        """
        try:
            import foxglove
            from foxglove import messages
            from foxglove.channels import PointCloudChannel
            from foxglove.mcap import MCAPWriteOptions
        except ImportError:
            raise InputError('an MCAP file needs foxglove-sdk: pip install "palpate[foxglove]"') from None
        grid, context = self.coarse, foxglove.Context()
        places = np.column_stack([grid.places, np.zeros(len(grid.places))])[:, :3]
        number = messages.PackedElementFieldNumericType.Float32
        fields = [
            messages.PackedElementField(name=n, offset=4 * i, type=number) for i, n in enumerate(COLUMNS)
        ]
        with whole(path) as draft, draft.open("wb") as file:
            writer = foxglove.open_mcap(
                file, context=context, writer_options=MCAPWriteOptions(profile="palpate")
            )
            with writer:
                channel = PointCloudChannel(TOPIC, context=context)
                for count, seen in self.film:
                    points = np.column_stack([places, seen.stiffness, seen.ci95])[grid.inside].astype("<f4")
                    cloud = messages.PointCloud(
                        timestamp=messages.Timestamp(sec=count, nsec=0), frame_id="surface",
                        point_stride=4 * len(COLUMNS), fields=fields, data=points.tobytes(),
                    )  # fmt: skip
                    channel.log(cloud, log_time=count * 1_000_000_000)


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
