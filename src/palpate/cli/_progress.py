"""Progress of a command: a bar on a terminal; elsewhere occasional lines for long work."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

COMPILING = "compiling the loop: some ten seconds, once after installation"
"""Message while a loop is compiled."""
_EVERY = 60.0
"""Between two lines where there is no terminal [s]."""


class Counted(Protocol):
    """Receives the name of the work, the finished pieces, and their total."""

    def __call__(self, what: str, done: int, of: int, /) -> None:
        """After each piece."""
        ...


def bar(screen: Console, *columns: Any, **options: Any) -> Progress:
    """A bar that disappears when done; none without a terminal, where it would leave an empty line."""
    from rich.progress import BarColumn, Progress, TextColumn

    first = TextColumn("{task.description}", markup=False), BarColumn()
    return Progress(
        *first, *columns, console=screen, transient=True, disable=not screen.is_terminal, **options
    )


@contextmanager
def simulated(
    screen: Console, interrupted: Callable[[], bool], start: str = "starting"
) -> Iterator[Callable[[float, str], None]]:
    """Shows the progress of a simulation: its time [s] and phase.

    Raises:
        KeyboardInterrupt: it was interrupted; the run ends there and keeps the simulated part.
    """
    from rich.progress import TextColumn

    with bar(screen, TextColumn("{task.fields[time]}")) as progress:
        task = progress.add_task(start, total=None, time="")

        def show(seconds: float, phase: str) -> None:
            if interrupted():
                raise KeyboardInterrupt
            progress.update(task, description=f"{phase:12}", time=f"{seconds:6.1f} s simulated")

        yield show


@contextmanager
def counted(screen: Console) -> Iterator[Counted]:
    """Shows pieces of work, part after part, with the time left in each."""
    from rich.progress import MofNCompleteColumn, TimeRemainingColumn

    columns = MofNCompleteColumn(), TimeRemainingColumn()
    with bar(screen, *columns, speed_estimate_period=600) as progress:
        task = progress.add_task("", total=None)
        parts: dict[str, _Lines] = {}

        def show(what: str, done: int, of: int) -> None:
            if what not in parts:
                parts[what] = _Lines(screen, what, of)
                progress.reset(task, total=of, description=what)
            progress.update(task, completed=done)
            if not screen.is_terminal:
                parts[what].show(done)

        yield show


class _Lines:
    """A line each minute, with the remaining time by the pace so far."""

    def __init__(self, screen: Console, what: str, of: int):
        self._screen, self._what, self._of = screen, what, of
        self._begun = self._told = time.monotonic()
        self._first: int | None = None

    def show(self, done: int) -> None:
        from palpate.studies.preview import in_words

        self._first = done if self._first is None else self._first
        now = time.monotonic()
        if now - self._told < _EVERY or done == self._first:
            return
        self._told = now
        left = in_words((now - self._begun) / (done - self._first) * (self._of - done))
        self._screen.print(f"{self._what}: {done} of {self._of}, some {left} left", soft_wrap=True)
