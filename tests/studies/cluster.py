"""A Dask cluster of real processes on this machine."""

import json
import signal
import subprocess
import sys
import time
from contextlib import contextmanager


class LocalCluster:
    """A scheduler and workers, each a process of its own that a test may kill."""

    def __init__(self, folder, words, place=None):
        self._place = place
        self._file = folder / "scheduler.json"
        here = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(self._file))
        self._words = words
        self.scheduler = _started("dask_scheduler", "--port", "0", *here, *words)
        self.workers = []
        deadline = time.monotonic() + 60.0
        while not self._file.exists() or not self._file.read_text().endswith("}"):
            assert time.monotonic() < deadline, "no scheduler"
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]

    def start(self, workers):
        """So many more workers, of one thread each."""
        for _ in range(workers):
            words = (self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", *self._words)
            self.workers.append(_started("dask_worker", *words, place=self._place))

    def stop(self):
        """Kills whatever is left."""
        for process in (*self.workers, self.scheduler):
            process.send_signal(signal.SIGKILL)
            process.wait()


def _started(program, *words, place=None):
    command = [sys.executable, "-m", f"distributed.cli.{program}", *words]
    return subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@contextmanager
def local_cluster(folder, workers, words=(), place=None):
    """A cluster with so many workers, in a folder of theirs; `words` go to its programs."""
    cluster = LocalCluster(folder, words, place)
    try:
        cluster.start(workers)
        yield cluster
    finally:
        cluster.stop()
