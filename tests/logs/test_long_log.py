"""A long log needs memory for a few times its size, no more."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

ROWS = 2_000_000

SCRIPT = """
import resource, sys
from palpate.logs import read_log
read_log(sys.argv[1], time="time", position="position:mm", force="force")
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(base)
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in kB on Linux only")
def test_memory_of_reading(tmp_path):
    path = tmp_path / "long.csv"
    line = "".join(f"{k / 1000:.3f},{np.sin(k):.6f},{np.cos(k):.6f}\n" for k in range(1000))
    path.write_text("time,position,force\n" + line * (ROWS // 1000))
    used = (
        int(subprocess.run([sys.executable, "-c", SCRIPT, path], capture_output=True, check=True).stdout)
        * 1024
    )
    bare = subprocess.run(
        [
            sys.executable,
            "-c",
            "import resource, polars; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)",
        ],
        capture_output=True,
        check=True,
    )
    assert used - int(bare.stdout) * 1024 < 4 * path.stat().st_size
