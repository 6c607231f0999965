"""The package's sources, parsed once for whoever judges them."""

import ast
from pathlib import Path
from typing import NamedTuple

import pytest


class Source(NamedTuple):
    """A file of the package, its path from the project's folder on."""

    path: Path
    text: str
    tree: ast.Module


@pytest.fixture(scope="session")
def sources(root):
    """Every file of the package."""
    paths = sorted((root / "src" / "palpate").rglob("*.py"))
    assert len(paths) > 5
    texts = [path.read_text("utf-8") for path in paths]
    return [Source(p.relative_to(root), t, ast.parse(t)) for p, t in zip(paths, texts, strict=True)]
