"""Slides on surfaces from files of triangles, and files that are none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate_slide.ground import SPACING, ground_of, height_at
from palpate_slide.mesh import heights_of

pytest.importorskip("mujoco", reason="the extra `arms` is not installed")

Heights = Callable[[np.ndarray, np.ndarray], np.ndarray]


def saddle(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x**2 - y**2) / 0.3


def flat(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.0 * x


def triangles(height: Heights = saddle, width: float = 0.16, n: int = 81) -> np.ndarray:
    """Corners [mm] of the triangles of a graph, shape (m, 3, 3)."""
    x = np.linspace(-width / 2, width / 2, n)
    P = 1e3 * np.stack([*(grid := np.meshgrid(x, x, indexing="ij")), height(*grid)], -1)
    a, b, c, d = P[:-1, :-1], P[1:, :-1], P[1:, 1:], P[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3, 3)


def stl(path: Path, corners: np.ndarray) -> Path:
    rows = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = corners
    path.write_bytes(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())
    return path


def obj(path: Path, corners: np.ndarray) -> Path:
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in corners.reshape(-1, 3))
    path.write_text(points + "".join(f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(len(corners))))
    return path


def stl_text(path: Path, corners: np.ndarray) -> Path:
    facets = (
        "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n".format(
            "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in corner)
        )
        for corner in corners.tolist()
    )
    path.write_text(f"solid part\n{''.join(facets)}endsolid part\n")
    return path


@pytest.mark.parametrize("write", [stl, stl_text, obj])
def test_heights_are_those_of_the_file(write, tmp_path: Path) -> None:
    corners = triangles() + np.array([500.0, -300.0, 40.0])  # wherever it lies
    heights = heights_of(write(tmp_path / f"part.{write.__name__[:3]}", corners), 1e-3, 0.03)
    ground = ground_of("mesh", 0.1, 2e4, heights=heights)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(-0.03, 0.03, (50, 2)):
        h, hx, hy = height_at(ground, x, y)
        assert h == pytest.approx(saddle(x, y), abs=2e-5)  # triangles 2 mm wide lie below and above it
        assert (hx, hy) == pytest.approx((x / 0.15, -y / 0.15), abs=0.015)


def test_beyond_the_grid_the_surface_goes_on() -> None:
    ground = ground_of("mesh", 0.1, 2e4, heights=np.stack([np.ones((5, 5)), *np.zeros((2, 5, 5))]))
    assert height_at(ground, 0.2, -0.3) == (1.0, 0.0, 0.0)
    assert height_at(ground, 2 * SPACING, -2 * SPACING) == (1.0, 0.0, 0.0)


def test_the_command_holds_the_force_on_a_mesh(tmp_path: Path, capsys) -> None:
    words = [
        "--shape",
        f"mesh:{stl(tmp_path / 'part.stl', triangles())}:mm",
        "--length",
        "20:mm",
        "--seconds",
        "3",
    ]
    assert main(["slide", *words, "--normal", "0.1,0.1,-1", "--out", str(tmp_path / "out"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["end"] == "held"
    assert answer["normal"]["median_error_deg"] < 0.7  # facets of 2 mm are 0.8 degrees apart


def hole(corners: np.ndarray) -> np.ndarray:
    return corners[~(np.abs(corners.mean(axis=1)[:, :2] - [10.0, 0.0]) < 3.0).all(axis=1)]


@pytest.mark.parametrize(
    ("corners", "scale", "reach", "said"),
    [
        (hole(triangles()), 1e-3, 0.03, "has a hole or ends at x 6"),
        (triangles(width=0.06), 1e-3, 0.03, "has a hole or ends"),
        (triangles(lambda x, y: 0.02 * (x > 0.011)), 1e-3, 0.03, "is steeper than 60 degrees at x 1"),
        (triangles(), 1.0, 0.03, "160 m wide"),
        (triangles(), 1e-6, 0.03, "credible"),
        (
            np.concatenate([triangles(flat, n=9), [[[0, 0, 0], [20, 0, 0], [0, 0, 30]]]]),
            1e-3,
            0.03,
            "non-manifold",
        ),
        (triangles() * [1.0, 1.0, np.nan], 1e-3, 0.03, "no mesh is read from it"),
        (triangles(), 1e-3, 0.5, "may reach"),
    ],
)
def test_a_mesh_that_is_none_is_one_line(corners, scale, reach, said, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said) as error:
        heights_of(stl(tmp_path / "part.stl", corners), scale, reach)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("mesh", "needs a file and its unit"),
        ("mesh:part.stl", "needs a file and its unit"),
        ("mesh:none.stl:mm", "No such file"),
        ("mesh:odd.stl:mm", "no mesh is read from it"),
        ("mesh:odd.stl:kg", "unit"),
        ("mesh:odd.txt:mm", r"a file .stl or .obj"),
        ("sphere:0:mm", "--shape sphere needs a radius"),
    ],
)
def test_wrong_words_are_one_line(shape: str, said: str, tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("odd.stl").write_text("solid nothing")
    Path("odd.txt").write_text("v 0 0 0")
    assert main(["slide", "--shape", shape, "--out", "out"]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
