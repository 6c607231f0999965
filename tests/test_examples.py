"""Every example runs as it stands, in an empty folder, and says something."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parent.parent / "examples"
EXAMPLES = sorted(FOLDER.glob("[0-9]*.py"))
SHORT = ("00", "02")
"""The others compile a loop of their own, march through many runs, or design: seconds each."""


def marks(path):
    """A press over a wire keeps up with a clock."""
    if "--wire" in path.read_text(encoding="utf-8"):
        return pytest.mark.real_time
    return () if path.stem[:2] in SHORT else pytest.mark.long


def test_examples_are_numbered_without_gaps():
    assert EXAMPLES
    for number, path in enumerate(EXAMPLES):
        assert re.fullmatch(rf"{number:02d}_[a-z0-9_]+\.py", path.name), path.name


@pytest.mark.timeout(1900)
@pytest.mark.parametrize("path", [pytest.param(p, marks=marks(p), id=p.stem) for p in EXAMPLES])
def test_the_example_runs(path, tmp_path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), "an example says what it shows"
    ran = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.strip()


def test_the_log_that_is_shipped_is_what_its_generator_makes(tmp_path):
    """Not to the bit: through an encoder, the last bit of another machine's arithmetic grows to a count."""
    made = tmp_path / "press.csv"
    subprocess.run(
        [sys.executable, str(FOLDER / "make_press.py"), str(made)], check=True, capture_output=True
    )
    shipped = FOLDER / "data" / "press.csv"
    assert made.read_text().splitlines()[0] == shipped.read_text().splitlines()[0]
    new, old = (np.loadtxt(path, delimiter=",", skiprows=1) for path in (made, shipped))
    assert new.shape == old.shape
    rms = np.sqrt(np.mean((new - old) ** 2, axis=0))
    assert rms[0] == 0.0
    assert rms[1] < 0.02, "position [mm]"
    assert rms[2] < 0.3, "force [N]; another seed's noise alone makes 0.6"
