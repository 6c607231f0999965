"""The program in a process of its own, and headless Chromium; for measurements and for tests, each with a deadline."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

PATIENCE = 120.0
"""Within which what has to happen does, on whatever machine [s]: a loaded one is slow, not wrong."""
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
COSTS = ("TaskDuration", "ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
"""What the page's own thread spends its time on, as the browser counts it."""


def chromium() -> str | None:
    """Where it is; None where there is none."""
    return next((found for name in CHROMIUM if (found := shutil.which(name))), None)


@contextmanager
def browser() -> Iterator[Any]:
    """Headless Chromium within the block."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        own = playwright.chromium.launch(executable_path=chromium(), args=QUIET, timeout=1000 * PATIENCE)
        try:
            yield own
        finally:
            own.close()


@contextmanager
def ended_within(process: subprocess.Popen[str], seconds: float) -> Iterator[None]:
    """Kills the process if the block lasts longer: whoever reads from it then reads the end."""
    timer = threading.Timer(seconds, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


@contextmanager
def running(*words: object, lines: int = 1) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """`palpate live` with these words within the block: the process, and its first lines.

    It has to write them at once whatever the environment says.

    Afterwards the process has its `said`, a pair of standard output and standard error.

    Raises:
        TimeoutError: the lines did not come within `PATIENCE`.
    """
    command = [sys.executable, "-m", "palpate", "live", *map(str, words)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(  # noqa: S603 - our own interpreter
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        try:
            with ended_within(process, PATIENCE):
                said = [process.stdout.readline().strip() for _ in range(lines)]
            if not all(said):
                raise TimeoutError(f"{' '.join(command)} ended, or did not begin: {process.communicate()}")
            yield process, said
        finally:
            process.send_signal(signal.SIGINT)
            with ended_within(process, PATIENCE):
                process.said = process.communicate()  # type: ignore[attr-defined]


class Costs:
    """What a page costs its own thread, in time of the processor: another program's load does not count.

    Args:
        page: of Playwright.
    """

    def __init__(self, page: Any):
        self._session = page.context.new_cdp_session(page)
        self._session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def now(self) -> dict[str, float]:
        """Seconds since the page began, by `COSTS`."""
        told = self._session.send("Performance.getMetrics")["metrics"]
        by_name = {one["name"]: one["value"] for one in told}
        return {name: by_name[name] for name in COSTS}
