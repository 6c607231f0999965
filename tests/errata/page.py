"""The errata page as data, and the two words in which its tests speak: `holds` and `fails`."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "docs" / "errata.md"
COLUMNS = ["id", "verdict", "where", "printed", "right", "how it is seen"]
VERDICTS = {"error", "error or scan", "scan", "right", "undecided"}


class Row(NamedTuple):
    id: str
    verdict: str
    where: str
    printed: str
    right: str
    seen: str


def rows() -> list[Row]:
    """All rows of all tables of the page, in its order."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    table = [line.strip("|").split(" | ") for line in lines if line.startswith("|")]
    cells = [[cell.strip() for cell in line] for line in table]
    return [Row(*row) for row in cells if row != COLUMNS and not set("".join(row)) <= set("-| ")]


def calls() -> dict[str, set[str]]:
    """For each id the functions that its tests call: the name of a test begins with its row's id."""
    found: dict[str, set[str]] = {}
    for path in sorted(HERE.glob("test_*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_E"):
                row = node.name.split("_")[1]
                names = (getattr(n.func, "id", "") for n in ast.walk(node) if isinstance(n, ast.Call))
                found.setdefault(row, set()).update(names)
    return found


def holds(deviation, tolerance: float) -> None:
    """What is right deviates by at most the tolerance."""
    worst = np.max(np.abs(deviation))
    assert worst <= tolerance, f"{worst:.3g} exceeds the tolerance {tolerance:.3g}"


def fails(deviation, margin: float) -> None:
    """What is printed deviates by at least the margin, somewhere."""
    worst = np.max(np.abs(deviation))
    assert worst >= margin, f"{worst:.3g} does not reach the margin {margin:.3g}"
