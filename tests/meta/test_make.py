"""`make test-all`: those tests that may share the cores, then those of real time; the failure of either counts."""

import shutil
import subprocess

import pytest

PYTHON = """#!/bin/sh
echo "$*"
case "$*" in
*"not real_time"*) exit {parallel} ;;
*real_time*) exit {real_time} ;;
esac
"""


def run(root, folder, **codes):
    """Exit code and lines of `make test-all` with a Python that only says what it was given, and ends with a code."""
    stub = folder / "python"
    stub.write_text(PYTHON.format(**codes))
    stub.chmod(0o755)
    make = ["make", "--silent", "--old-file", ".venv/dev.stamp", "test-all", f"BIN={folder}"]
    ended = subprocess.run(make, cwd=root, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout.splitlines()


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
@pytest.mark.parametrize(("parallel", "real_time"), [(0, 0), (1, 0), (0, 1), (1, 1), (5, 0)])
def test_either_failure_counts(root, tmp_path, parallel, real_time):
    code, said = run(root, tmp_path, parallel=parallel, real_time=real_time)
    assert (code == 0) == (parallel == real_time == 0)
    shared, alone = [line for line in said if "pytest" in line]
    assert "--numprocesses auto" in shared
    assert alone.endswith("--numprocesses 1 -m real_time")
