"""Users import from facades: palpate, the `__init__` of a room, and some modules of one idea."""

import ast
import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import palpate

ROOT = Path(__file__).resolve().parents[2]
MODULES = {"records", "errors", "plugins", "units"}
"""Modules without a room that are public as they are."""
MAX_NAMES = 400
"""Number of public names of palpate that a user can still survey."""
PATHS = [*ROOT.glob("examples/*.py"), *ROOT.glob("docs/*.md"), ROOT / "README.md"]


def find_facades():
    """Names that each facade exports, by its own name."""
    facades = {"palpate": set(palpate.__all__)}
    for module in pkgutil.walk_packages(palpate.__path__, "palpate."):
        if module.ispkg and not any(part.startswith("_") for part in module.name.split(".")):
            facades[module.name] = set(getattr(importlib.import_module(module.name), "__all__", ()))
    return facades


FACADES = find_facades()


def imports_of(path):
    """Module and name of each import from palpate in a script, or in the Python of a document."""
    text = path.read_text(encoding="utf-8")
    sources = (
        re.findall(r"```python\n(?!\s*--8<--)(.*?)```", text, re.DOTALL) if path.suffix == ".md" else [text]
    )
    for source in sources:
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "palpate":
                yield from ((node.module, alias.name) for alias in node.names)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
def test_examples_and_documents_import_public_names_alone(path):
    for module, name in imports_of(path):
        if module.removeprefix("palpate.") not in MODULES:
            submodule = f"{module}.{name}" in FACADES or name in MODULES
            assert submodule or name in FACADES.get(module, ()), f"{module} does not export {name}"


@pytest.mark.parametrize("facade", FACADES)
def test_each_exported_name_is_there(facade):
    module = importlib.import_module(facade)
    for name in FACADES[facade]:
        getattr(module, name)


def test_the_public_names_can_be_surveyed():
    assert sum(map(len, FACADES.values())) <= MAX_NAMES
