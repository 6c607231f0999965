"""The one place of output: every printed text passes here, and its control characters are made harmless.

A name from a log or a path may hold escape sequences, or brackets that rich would take for markup.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.cli._streams import flush
from palpate.errors import LONGEST, PalpateError
from palpate.files import as_json
from palpate.text import duration, printable, shorten

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress


KINDS = {".html": "report", ".csv": "table"}
"""Written files of an identification, by their endings; the others are figures."""


def print_lines(*lines: str) -> None:
    """Print lines as they are, however long, for a reader or for another program; at once, on a pipe too."""
    sys.stdout.write("".join(f"{printable(line)}\n" for line in lines))
    flush(sys.stdout)


def print_json(value: Any) -> None:
    """Print one JSON value, in ASCII; numbers that are none are null."""
    import msgspec

    plain = msgspec.json.decode(as_json(value))
    sys.stdout.write(json.dumps(plain, allow_nan=False) + "\n")


def say(text: str) -> None:
    """Print a line about the program itself on standard error."""
    print(f"palpate: {printable(' '.join(text.split()))}", file=sys.stderr)  # noqa: T201


@contextmanager
def guard_picture(path: object) -> Iterator[None]:
    """Turn a defect in drawing a figure or a page into one line on standard error: no answer depends on a picture.

    Args:
        path: of the picture.

    Raises:
        PalpateError, OSError, MemoryError: what the user can correct, as the place or a full disk.
    """
    try:
        yield
    except (PalpateError, OSError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - a drawing fails in as many ways as there are logs
        frames = [f for f in traceback.extract_tb(error.__traceback__) if "palpate" in f.filename]
        where = f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}"
        text = f"{path} is not drawn: {type(error).__name__} in {where}: {error}"
        say(shorten(f"{text}; the answer does not depend on it, and this defect can be reported", LONGEST))


def console(*, stderr: bool = False) -> Console:
    """A console of rich that takes no markup from texts; styles are given beside them."""
    from rich.console import Console
    from rich.segment import Segment

    class Plain(Console):
        def render(self, renderable: Any, options: Any = None) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                yield segment if segment.control else segment._replace(text=printable(segment.text))

    return Plain(stderr=stderr, markup=False, emoji=False, highlight=False)


def confirmed(console: Console, question: str) -> bool:
    """True if a person at the terminal agrees; an end of the input is a no."""
    from rich.prompt import Confirm

    try:
        return Confirm.ask(question, console=console, default=False)
    except EOFError:
        console.print()
        return False


def place(console: Console, label: str, path: object) -> None:
    """Path of a written file, not wrapped, so that it can be copied."""
    console.print(f"{label} {path}", soft_wrap=True)


def kind_of(path: Path) -> str:
    """Kind of a written file by its ending."""
    return KINDS.get(path.suffix.lower(), "figure")


COMPILING = "compiling the loop: some ten seconds, once after installation"
"""Message while a loop is compiled."""
_LINE_INTERVAL = 60.0
"""Time between two lines of progress without a terminal [s]."""


class Counted(Protocol):
    """Receives the name of the work, the finished pieces, and their total."""

    def __call__(self, what: str, done: int, of: int, /) -> None:
        """Show the count after each piece."""
        ...


def bar(screen: Console, *columns: Any, **options: Any) -> Progress:
    """A bar that disappears when done; none without a terminal, where it would leave an empty line."""
    from rich.progress import BarColumn, Progress, TextColumn

    first = TextColumn("{task.description}", markup=False), BarColumn()
    return Progress(
        *first, *columns, console=screen, transient=True, disable=not screen.is_terminal, **options
    )


@contextmanager
def simulation_progress(
    screen: Console, interrupted: Callable[[], bool], start: str = "starting"
) -> Iterator[Callable[[float, str], None]]:
    """Show the progress of a simulation: its time [s] and phase.

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
def progress_of_pieces(screen: Console) -> Iterator[Counted]:
    """Show the progress of a work of several parts, with the time left in each."""
    from rich.progress import MofNCompleteColumn, TimeRemainingColumn

    columns = MofNCompleteColumn(), TimeRemainingColumn()
    with bar(screen, *columns, speed_estimate_period=600) as progress:
        task = progress.add_task("", total=None)
        parts: dict[str, _Lines] = {}

        def show(name: str, done: int, of: int) -> None:
            if name not in parts:
                parts[name] = _Lines(screen, name, of)
                progress.reset(task, total=of, description=name)
            progress.update(task, completed=done)
            if not screen.is_terminal:
                parts[name].show(done)

        yield show


class _Lines:
    """A line each minute, with the remaining time by the pace so far."""

    def __init__(self, screen: Console, what: str, of: int):
        self._screen, self._what, self._of = screen, what, of
        self._start = self._last_line = time.monotonic()
        self._first: int | None = None

    def show(self, done: int) -> None:
        self._first = done if self._first is None else self._first
        now = time.monotonic()
        if now - self._last_line < _LINE_INTERVAL or done == self._first:
            return
        self._last_line = now
        remaining = duration((now - self._start) / (done - self._first) * (self._of - done))
        self._screen.print(f"{self._what}: {done} of {self._of}, some {remaining} left", soft_wrap=True)
