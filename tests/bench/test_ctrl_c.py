"""Ctrl-C while the compiled loop runs."""

import subprocess
import sys

import pytest

SCRIPT = """
import os, signal, threading
from palpate.bench import build, load

bench = build(load("foam-hybrid"))
bench.run(0.1)
for delay in (0.05, 0.1, 0.15):
    timers = [threading.Timer(delay, os.kill, (os.getpid(), signal.SIGINT))]
    # On a busy machine a timer that is started before the run may end before its first row.
    record = bench.run(600.0, progress=lambda *_: timers and timers.pop().start())
    print(record.meta["end"], len(record) > 0)
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
"""


@pytest.mark.long
def test_the_rows_so_far_are_kept():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], check=False, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:3] == ["interrupted True"] * 3
