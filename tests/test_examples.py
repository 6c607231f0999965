"""Every example runs as it stands, in an empty folder, and says something."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "examples"
EXAMPLES = sorted(FOLDER.glob("[0-9]*.py"))


def test_examples_are_numbered_without_gaps():
    assert EXAMPLES
    for number, path in enumerate(EXAMPLES):
        assert re.fullmatch(rf"{number:02d}_[a-z0-9_]+\.py", path.name), path.name


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_runs(path, tmp_path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), "an example says what it shows"
    ran = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.strip()
