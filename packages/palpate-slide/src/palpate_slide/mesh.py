"""A surface of a simulated slide from a file of triangles, STL or OBJ: its heights on a grid, as seen from above."""

from __future__ import annotations

import re
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from palpate._jit import kernel, law
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files.reading import GB
from palpate.robots.serial.loading import load_mjcf, mujoco
from palpate_slide.ground import SPACING

MARGIN = 0.012
"""About the path [m]: touches beside its beginning, and the way to them."""
WIDTHS = 5e-3, 5.0
"""Extents of a mesh between which its unit is credible [m]."""
MOST = 1500
"""Points of the grid along a side, at most."""
STEEPEST = 1.75
"""Largest slope, 60 degrees: heights show no wall and no overhang."""


def heights_of(path: Path, scale: float, reach: float) -> Array:
    """Heights over the uppermost point at the middle of a mesh [m], and their slopes, shape (3, n, n).

    Args:
        path: of the file.
        scale: of its unit [m].
        reach: of the path from the first point, in x and in y [m].

    Raises:
        InputError: no mesh of finite numbers, more than two triangles at an edge, a size that no unit explains, a hole
            or a wall within reach.
        OSError: no such file.
    """
    points, faces = _triangles(path, scale)
    low, high = points.min(axis=0), points.max(axis=0)
    width = float((high - low).max())
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        raise InputError(
            f"{path}: with this unit the mesh is {width:.3g} m wide, and from {WIDTHS[0]:g} to {WIDTHS[1]:g} m are "
            "credible; a mesh has no unit of its own: mesh:FILE:mm, or m, or inch"
        )
    half = int(np.ceil((reach + MARGIN) / SPACING)) + 2
    if 2 * half + 1 > MOST:
        raise InputError(f"a path on a mesh may reach {MOST * SPACING / 2 - MARGIN:.2g} m, got {reach:.2g} m")
    grid = np.full((2 * half + 1, 2 * half + 1), -np.inf)
    points = (points - [*(low + high)[:2] / 2, 0.0]) / SPACING + [half, half, 0.0]
    _raster(np.ascontiguousarray(points), faces, grid)
    _check(path, grid, half)
    heights = SPACING * (grid - grid[half, half])
    return np.stack([heights, *np.gradient(heights, SPACING)])


def _triangles(path: Path, scale: float) -> tuple[Array, Array]:
    """Corners [m], shape (n, 3), and triangles of them, shape (m, 3)."""
    if path.suffix.lower() not in {".stl", ".obj"}:
        raise InputError(f"{path}: a mesh is a file .stl or .obj")
    if path.stat().st_size > GB / 4:
        raise InputError(
            f"{path}: {path.stat().st_size / GB:.2g} GB are more than a mesh may have; thin it out"
        )
    asset = f'<mesh name="surface" inertia="shell" {_content(path)}/>'
    geom = '<geom type="mesh" mesh="surface" contype="0" conaffinity="0"/>'
    try:
        model, _ = load_mjcf(path, f"<mujoco><asset>{asset}</asset><worldbody>{geom}</worldbody></mujoco>")
    except InputError:  # in MuJoCo's words, which name elements that no user wrote
        raise InputError(
            f"{path}: no mesh is read from it (4 corners, 200000 triangles at most, finite numbers); export it again"
        ) from None
    turn = np.zeros(9)
    mujoco().mju_quat2Mat(turn, model.mesh_quat[0])
    points = scale * (model.mesh_vert @ turn.reshape(3, 3).T + model.mesh_pos[0])
    grain = max(float(np.ptp(points, axis=0).max()) * 1e-6, 1e-12)
    same = np.unique(np.round(points / grain), axis=0, return_inverse=True)[1].reshape(-1)
    faces = model.mesh_face.astype(np.int64)
    edges = np.sort(same[faces][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    count = np.unique(edges, axis=0, return_counts=True)[1]
    if (count > 2).any():
        raise InputError(
            f"{path}: {int((count > 2).sum())} edges have more than two triangles: no surface (non-manifold); mend it"
        )
    return points, faces


def _content(path: Path) -> str:
    """Attributes of a mesh of MuJoCo: its file, or the triangles of an STL in text, which MuJoCo does not read."""
    data = path.read_bytes()
    in_text = re.match(rb"solid.*\s+facet", data)
    corners = re.findall(rb"\bvertex\s+(\S+\s+\S+\s+\S+)", data) if in_text else []
    if not corners:
        return f"file={quoteattr(str(path.resolve()))}"
    numbers = b" ".join(corners).decode("ascii", "replace")
    return f'vertex={quoteattr(numbers)} face="{" ".join(map(str, range(len(corners))))}"'


def _check(path: Path, grid: Array, half: int) -> None:
    grid = np.where(np.isfinite(grid), grid, np.nan)
    slope = np.maximum(np.abs(np.diff(grid, axis=0))[:, :-1], np.abs(np.diff(grid, axis=1))[:-1])
    holes = np.isnan(grid[:-1, :-1])
    for bad, what in ((holes, "has a hole or ends"), (~(slope <= STEEPEST), "is steeper than 60 degrees")):
        if bad.any():
            away = np.argwhere(bad) - half
            x, y = 1e3 * SPACING * away[np.abs(away).max(axis=1).argmin()]
            raise InputError(
                f"{path}: the mesh {what} at x {x:.3g}, y {y:.3g} mm from its middle, within reach of the path; choose "
                "a smaller --length, or mend the mesh"
            )


@law
def raster(points, faces, grid):
    """Fills the uppermost heights at the points of a grid, all in its spacing."""
    for k in range(len(faces)):
        a, b, c = points[faces[k, 0]], points[faces[k, 1]], points[faces[k, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        x0, x1 = max(int(min(a[0], b[0], c[0])), 0), min(int(max(a[0], b[0], c[0])) + 1, len(grid) - 1)
        y0, y1 = max(int(min(a[1], b[1], c[1])), 0), min(int(max(a[1], b[1], c[1])) + 1, len(grid) - 1)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                u = ((i - a[0]) * (c[1] - a[1]) - (j - a[1]) * (c[0] - a[0])) / area
                v = ((b[0] - a[0]) * (j - a[1]) - (b[1] - a[1]) * (i - a[0])) / area
                if u >= -1e-9 and v >= -1e-9 and u + v <= 1.0 + 1e-9:
                    grid[i, j] = max(grid[i, j], a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]))


_raster = kernel(raster)
