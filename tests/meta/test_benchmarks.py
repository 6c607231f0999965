"""Each script of the benchmarks is started by a small run; without a figure it is named by a page or a constant."""

import ast
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import figures  # noqa: E402 -- beside the scripts that it runs

FIGURES = figures.figures()
RUNNER = "benchmarks/figures.py"
"""Script that starts the others."""


def find_started(root, scripts):
    """Files under `root` that some scripts of it import, directly or not, and those scripts themselves."""
    started, waiting = set(), [root / script for script in scripts]
    while waiting:
        path = waiting.pop()
        if path in started or not path.is_file():
            continue
        started.add(path)
        waiting += [file for name in imported_modules(path) for file in find_module(root, path, name)]
    return started


def imported_modules(path):
    """Names of the modules that a file imports, those in its functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def find_module(root, path, name):
    """Files beside a script that a name may import, or else those of the other folders of benchmarks."""
    file = f"{name.replace('.', '/')}.py"
    beside = path.parent / file
    return [beside] if beside.is_file() else [*(root / "benchmarks").rglob(file)]


def test_every_script_is_started():
    by_tests = re.findall(r"benchmarks/\S+\.py", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    started = find_started(ROOT, [RUNNER, *by_tests, *(figure.script for figure in FIGURES.values())])
    idle = sorted(
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "benchmarks").rglob("*.py")
        if path not in started
    )
    assert not idle, f"give each a small run in benchmarks/figures.toml, or delete it: {', '.join(idle)}"


@pytest.mark.parametrize("name", [figure.name for figure in FIGURES.values() if not figure.page])
def test_a_script_without_a_figure_is_named_by_a_page_or_a_constant(name):
    files = [*ROOT.glob("docs/*.md"), ROOT / "Makefile", *ROOT.glob("src/palpate/**/*.py")]
    script = FIGURES[name].script
    assert any(script in path.read_text(encoding="utf-8") for path in files), f"nothing names {script}"


def test_a_script_that_nothing_starts_is_found(tmp_path):
    folder = tmp_path / "benchmarks" / "force"
    folder.mkdir(parents=True)
    (folder / "started.py").write_text("def main():\n    from beside import number\n")
    (folder / "beside.py").write_text("import common\nnumber = 1\n")
    (folder.parent / "common.py").write_text("")
    (folder / "idle.py").write_text("import beside\n")
    started = find_started(tmp_path, ["benchmarks/force/started.py"])
    assert {path.stem for path in started} == {"started", "beside", "common"}
