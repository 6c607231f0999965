"""The sources of palpate and of its companions, parsed once for whoever judges them."""

import ast
from pathlib import Path
from typing import NamedTuple

import pytest


class Source(NamedTuple):
    """A file of a package, its path from the project's folder on."""

    path: Path
    text: str
    tree: ast.Module


@pytest.fixture(scope="session")
def sources(root):
    """Every file of the packages."""
    packages = [root / "src" / "palpate", *root.glob("packages/*/src/*/")]
    paths = sorted(path for package in packages for path in package.rglob("*.py"))
    assert {path.relative_to(root).parts[0] for path in paths} == {"src", "packages"}
    texts = [path.read_text("utf-8") for path in paths]
    return [Source(p.relative_to(root), t, ast.parse(t)) for p, t in zip(paths, texts, strict=True)]
