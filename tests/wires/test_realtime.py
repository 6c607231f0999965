"""Priority of a loop: all threads of the process have it in the block, and none afterwards."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from palpate.wires.realtime import realtime_priority


def policies() -> set[int]:
    return {os.sched_getscheduler(int(thread.name)) for thread in Path("/proc/self/task").iterdir()}


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="this system has no such priorities")
def test_all_threads_have_the_priority_that_is_told_and_none_afterwards():
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    before = policies()
    try:
        with realtime_priority(True) as told:
            within = policies()
    finally:
        done.set()
        other.join()
    assert within == ({os.SCHED_FIFO} if told.startswith("real-time priority") else before)
    assert policies() == {os.SCHED_OTHER}
    with realtime_priority(False) as told:
        assert told == "ordinary priority, as asked"
        assert policies() == {os.SCHED_OTHER}
