"""The one place of output: every printed text passes here, and its control characters are made harmless.

A name from a log or a path may hold escape sequences, or brackets that rich would take for markup.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.cli._streams import flush
from palpate.files import as_json
from palpate.text import duration, printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from palpate.report.page import CommandAnswer, Table

STYLE = "yellow"
"""Style of warnings."""


KINDS = {".html": "report", ".csv": "table", ".md": "table", ".tex": "table"}
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
    """Whether a person at the terminal agrees; an end of the input is a no."""
    from rich.prompt import Confirm

    try:
        return Confirm.ask(question, console=console, default=False)
    except EOFError:
        console.print()
        return False


def head(console: Console, title: str, rest: str) -> None:
    """A title and its details, on one line."""
    from rich.text import Text

    console.print(Text.assemble((title, "bold"), rest))


def show_table(console: Console, table: Table, styles: Sequence[str] = ()) -> None:
    """A table: the first column names, the others hold figures.

    Args:
        console: where to.
        table: its contents.
        styles: of the rows' last cells, to distinguish them.
    """
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    if table.title:
        console.print(Text(table.title, style="italic"))
    drawn = RichTable(box=box.SIMPLE_HEAD, show_edge=False, show_header=any(table.head))
    for i, title in enumerate(table.head):
        drawn.add_column(
            title, justify="left" if i == 0 or styles or table.read(i) else "right", overflow="fold"
        )
    for i, row in enumerate(table.rows):
        last = Text(row[-1], style=styles[i] if styles else "")
        drawn.add_row(*row[:-1], last)
    console.print(drawn)
    console.print()


def show_answer(answer: CommandAnswer) -> Console:
    """Print an answer, whole or its title, sentence, tables and warnings; returns the console for further output."""
    screen = console()
    if answer.show is not None:
        answer.show(screen)
        return screen
    for doubt in answer.doubts:
        screen.print(doubt, style=STYLE, soft_wrap=True)
    head(screen, answer.title, answer.sentence)
    for table in answer.tables:
        show_table(screen, table)
    for note in answer.notes:
        screen.print(note, style=STYLE, soft_wrap=True)
    return screen


def place(console: Console, what: str, where: object) -> None:
    """Path of a written file, not wrapped, so that it can be copied."""
    console.print(f"{what} {where}", soft_wrap=True)


def kind_of(path: Path) -> str:
    """The kind of a written file, by its ending."""
    return KINDS.get(path.suffix.lower(), "figure")


COMPILING = "compiling the loop: some ten seconds, once after installation"
"""Message while a loop is compiled."""
_EVERY = 60.0
"""Between two lines where there is no terminal [s]."""


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
def progress_of_pieces(screen: Console) -> Iterator[Counted]:
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
        self._first = done if self._first is None else self._first
        now = time.monotonic()
        if now - self._told < _EVERY or done == self._first:
            return
        self._told = now
        left = duration((now - self._begun) / (done - self._first) * (self._of - done))
        self._screen.print(f"{self._what}: {done} of {self._of}, some {left} left", soft_wrap=True)
