"""A source at real time, in a thread of its own, and the page that shows it.

Readers ask it to pause, to step, to go back. They take new rows from a feed of the last seconds, and a slow reader
loses rows, so that memory stays bounded. All that the page needs lies in its text, and its policy lets nothing else run
or be asked.
"""

from __future__ import annotations

import gc
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from importlib import resources
from typing import Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.report.look.assets import ARM, ARM_IN_SPACE, CHARTS, data, policy, scripts
from palpate.report.page import render
from palpate.text import printable
from palpate_live.view import COLUMNS, STRIDE, RowSource, View

SECONDS = 12.0
"""That are kept [s]."""


class Feed:
    """A ring of rows, written by one thread and read by any.

    Args:
        rows: that are kept.
    """

    def __init__(self, rows: int = round(SECONDS / STRIDE)):
        self._ring = np.full((rows, len(COLUMNS)), np.nan)
        self._count = 0
        self._epoch = 0
        self._lock = threading.Lock()
        self._listeners: list[Callable[[], None]] = []

    def put(self, rows: Array) -> None:
        """Adds rows, shape (n, len(COLUMNS))."""
        if not len(rows):
            return
        with self._lock:
            kept = rows[-len(self._ring) :]
            skipped = len(rows) - len(kept)
            at = (self._count + skipped + np.arange(len(kept))) % len(self._ring)
            self._ring[at] = kept
            self._count += len(rows)
        self.tell()

    def clear(self) -> None:
        """Forgets all rows: what comes is from another time."""
        with self._lock:
            self._epoch += 1
            self._count = 0
        self.tell()

    def since(self, epoch: int, count: int) -> tuple[int, int, Array, int]:
        """The rows that a reader has not received yet.

        Args:
            epoch: of its last row.
            count: of the rows that it has had since.

        Returns:
            Epoch and count to ask with next time, the rows, and how many were lost before them. Where the epoch is
            another, what the reader had is from another time.
        """
        with self._lock:
            had = count if epoch == self._epoch else 0
            oldest = max(0, self._count - len(self._ring))
            first = max(had, oldest)
            rows = self._ring[np.arange(first, self._count) % len(self._ring)]
            lost = first - had if epoch == self._epoch else 0
            return self._epoch, self._count, rows, lost

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Has a function called, from whichever thread, when there is something new; returns what ends that."""
        with self._lock:
            self._listeners.append(listener)

        def end() -> None:
            with self._lock:
                self._listeners.remove(listener)

        return end

    def tell(self) -> None:
        """Calls the listeners of the feed."""
        with self._lock:
            listeners = list(self._listeners)
        for listener in listeners:
            listener()


PERIOD = 0.01
"""Between two looks at the clock [s]."""
BEHIND = 0.1
"""Longest stall that is caught up; a longer one is lost [s]."""
STEP = 0.01
"""Of the step button [s]."""
WAITING = 64
"""Requests that may wait; further ones are dropped."""
PACES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Times real time."""


class Pause(msgspec.Struct, tag="pause", tag_field="do", forbid_unknown_fields=True):
    """Stand still, or go on."""

    on: bool


class NextMoment(msgspec.Struct, tag="step", tag_field="do", forbid_unknown_fields=True):
    """Stand still a moment later."""


class Reset(msgspec.Struct, tag="reset", tag_field="do", forbid_unknown_fields=True):
    """Begin again, with another seed if one is given."""

    seed: int | None = None


class Set(msgspec.Struct, tag="set", tag_field="do", forbid_unknown_fields=True):
    """Command that moves a slider."""

    key: str
    value: float


class Seek(msgspec.Struct, tag="seek", tag_field="do", forbid_unknown_fields=True):
    """Go to a moment [s]."""

    time: float


class Pace(msgspec.Struct, tag="pace", tag_field="do", forbid_unknown_fields=True):
    """So many times real time."""

    value: float


Request = Pause | NextMoment | Reset | Set | Seek | Pace


def made_ready() -> None:
    """Does before anybody watches what the first slider would wait for, some 0.3 s: once everything is loaded.

    A surface that changes under load is solved for by SciPy, which takes long to import; and the garbage collector's
    whole round looks at all that Numba has loaded, unless that is set aside.
    """
    import scipy.optimize  # noqa: F401

    gc.collect()
    gc.freeze()


class Player:
    """Plays a source into a feed; started by `with`.

    It waits until a page is open.

    Args:
        source: of the rows.
        feed: where its rows go.
        changed: called after something was changed that its loop's stability depends on.
        stability: what is known of that, as plain values; None while nothing is.
    """

    def __init__(
        self,
        source: RowSource,
        feed: Feed,
        changed: Callable[[], None] = lambda: None,
        stability: Callable[[], dict[str, Any] | None] = lambda: None,
    ):
        self.source, self.feed = source, feed
        self._set, self._stability = changed, stability
        self.failure: BaseException | None = None
        self.version = 0
        self._playing, self._pace, self._said = True, 1.0, ""
        self._watched = threading.Event()
        self._stop = threading.Event()
        self._requests: queue.Queue[Request] = queue.Queue(WAITING)
        self._thread = threading.Thread(target=self._run_guarded, name="live", daemon=True)

    def __enter__(self) -> Player:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def watch(self) -> None:
        """Somebody watches: from now on it runs."""
        self._watched.set()

    def ask(self, request: Request) -> bool:
        """Has something done at the next look at the clock; False where too much waits already."""
        try:
            self._requests.put_nowait(request)
        except queue.Full:
            return False
        return True

    def wait(self) -> None:
        """Until the thread ends, which it does by a failure alone.

        Raises:
            BaseException: that failure.
        """
        while self._thread.is_alive():
            self._thread.join(0.2)
        if self.failure is not None:
            raise self.failure

    def news(self) -> None:
        """Its state has changed: readers are notified."""
        self.version += 1
        self.feed.tell()

    def description(self) -> dict[str, Any]:
        """How it stands, as the page takes it."""
        state = self.source.state
        return {
            "version": self.version,
            "playing": self._playing,
            "pace": self._pace,
            "values": dict(state.values),
            "seed": state.seed,
            "ended": state.ended,
            "warning": state.warning,
            "stage": state.stage,
            "happened": [asdict(one) for one in state.happened],
            "said": self._said,
            "stability": self._stability(),
        }

    def _run_guarded(self) -> None:
        try:
            self._run()
        except BaseException as error:  # noqa: BLE001 - raised again by whoever started it
            self.failure = error
            self.feed.tell()

    def _run(self) -> None:
        due, last = 0.0, time.monotonic()
        while not self._stop.wait(PERIOD):
            self._obey()
            now = time.monotonic()
            if self._playing and self._watched.is_set():
                due = min(due + self._pace * (now - last), self._pace * BEHIND)
            last = now
            strides = int(due / STRIDE)
            if strides:
                due -= strides * STRIDE
                self._advance(strides * STRIDE)

    def _advance(self, seconds: float) -> None:
        state = self.source.state
        before = state.ended, state.happened, state.warning, state.stage
        self.feed.put(self.source.advance(seconds))
        if (state.ended, state.happened, state.warning, state.stage) != before:
            if state.ended:
                self._playing = False
            self.news()

    def _obey(self) -> None:
        """Applies the requests; of each slider only the last."""
        waiting: list[Request] = []
        while True:
            try:
                waiting.append(self._requests.get_nowait())
            except queue.Empty:
                break
        last = {one.key: one for one in waiting if isinstance(one, Set)}
        for request in waiting:
            if isinstance(request, Set) and last[request.key] is not request:
                continue
            try:
                self._said = ""
                self._do(request)
            except InputError as error:
                self._said = str(error)
            self.news()

    def _do(self, request: Request) -> None:
        match request:
            case Pause(on):
                self._playing = not on
                if not on and self.source.state.ended:
                    self._begin(None)
            case NextMoment():
                self._playing = False
                self._advance(STEP)
            case Reset(seed):
                self._begin(seed)
            case Set(key, value):
                self.source.set(key, value)
                self._set()
            case Seek(moment):
                self.feed.clear()
                self.source.seek(moment)
                self._advance(STEP)
            case Pace(value):
                if value not in PACES:
                    raise InputError(f"the pace must be one of {', '.join(map(str, PACES))}, got {value:g}")
                self._pace = value

    def _begin(self, seed: int | None) -> None:
        self.source.reset(seed)
        self.feed.clear()
        self._playing = True


PAGE_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def page(view: View) -> str:
    """The page of a source as HTML."""
    drawing = ARM if view.scene is None else ARM_IN_SPACE
    codes = (*scripts(*CHARTS, *drawing), _own("strip.js"), _own("live.js"))
    shown_view = replace(
        view,
        title=printable(view.title),
        about=printable(view.about),
        notes=tuple(map(printable, view.notes)),
        units={name: printable(unit) for name, unit in view.units.items()},
    )
    return render(
        "live.html",
        "palpate_live",
        view=shown_view,
        data=data(shown_view.to_json()),
        title=f"{shown_view.title} – palpate live",
        command="",
        own_styles=_own("live.css"),
        scripts=codes,
        policy=policy(codes, "connect-src 'self' ws://127.0.0.1:* ws://localhost:*"),
    )


def _own(name: str) -> str:
    return (resources.files("palpate_live") / name).read_text(encoding="utf-8")
