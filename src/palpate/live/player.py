"""A simulation in real time, in a thread of its own, and the page that shows it.

Pages ask the player to pause, to step, to begin again. They take new rows from a feed of the last seconds; a slow page
loses rows, so that memory stays bounded. The page is self-contained, and its policy forbids any other code and host.
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
from palpate.live.view import COLUMNS, STRIDE, LiveSource, View
from palpate.report.look.assets import ARM, ARM_IN_SPACE, CHARTS, data, policy, scripts
from palpate.report.page import render
from palpate.text import printable

FEED_SECONDS = 12.0
"""Duration of the rows in the feed [s]."""


class Feed:
    """A ring of rows, written by one thread and read by any.

    Args:
        rows: capacity.
    """

    def __init__(self, rows: int = round(FEED_SECONDS / STRIDE)):
        self._ring = np.full((rows, len(COLUMNS)), np.nan)
        self._count = 0
        self._epoch = 0
        self._lock = threading.Lock()
        self._listeners: list[Callable[[], None]] = []

    def put(self, rows: Array) -> None:
        """Add rows, shape (n, len(COLUMNS))."""
        if not len(rows):
            return
        with self._lock:
            newest = rows[-len(self._ring) :]
            first = self._count + len(rows) - len(newest)
            self._ring[(first + np.arange(len(newest))) % len(self._ring)] = newest
            self._count += len(rows)
        self.notify()

    def clear(self) -> None:
        """Drop all rows, and begin a new epoch."""
        with self._lock:
            self._epoch += 1
            self._count = 0
        self.notify()

    def since(self, epoch: int, count: int) -> tuple[int, int, Array, int]:
        """Rows that a reader has not received yet.

        Args:
            epoch: of the reader's last row.
            count: number of rows that the reader has received in this epoch.

        Returns:
            Epoch and count for the next call, the new rows, and the number of rows lost before them. After a change of
            the epoch the reader's rows are of another time.
        """
        with self._lock:
            received = count if epoch == self._epoch else 0
            oldest = max(0, self._count - len(self._ring))
            first = max(received, oldest)
            rows = self._ring[np.arange(first, self._count) % len(self._ring)]
            lost = first - received if epoch == self._epoch else 0
            return self._epoch, self._count, rows, lost

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function, from whichever thread, when there are new rows; returns a function that ends this."""
        with self._lock:
            self._listeners.append(listener)

        def end() -> None:
            with self._lock:
                self._listeners.remove(listener)

        return end

    def notify(self) -> None:
        """Call all listeners of the feed once."""
        with self._lock:
            listeners = list(self._listeners)
        for listener in listeners:
            listener()


PERIOD = 0.01
"""Time between two looks at the clock [s]."""
MAX_LAG = 0.1
"""Longest stall that the simulation catches up [s]."""
STEP = 0.01
"""Simulated time of the step button [s]."""
MAX_REQUESTS = 64
"""Number of requests that may wait; further ones are dropped."""


class Pause(msgspec.Struct, tag="pause", tag_field="do", forbid_unknown_fields=True):
    """Request to pause, or to go on."""

    on: bool


class SingleStep(msgspec.Struct, tag="step", tag_field="do", forbid_unknown_fields=True):
    """Request to pause after one step."""


class Reset(msgspec.Struct, tag="reset", tag_field="do", forbid_unknown_fields=True):
    """Request to begin again, with another seed if one is given."""

    seed: int | None = None


class Set(msgspec.Struct, tag="set", tag_field="do", forbid_unknown_fields=True):
    """Request to move a slider."""

    key: str
    value: float


Request = Pause | SingleStep | Reset | Set


def load_late_imports() -> None:
    """Do what the first slider would wait for, some 0.3 s, before anybody watches.

    A surface that changes under load is solved by SciPy, which takes long to import; and a whole garbage collection
    looks at all that Numba has loaded, unless that is set aside.
    """
    import scipy.optimize  # noqa: F401

    gc.collect()
    gc.freeze()


class Player:
    """Runs a simulation into a feed while a page is open; started by `with`.

    Args:
        source: the simulation.
        feed: for its rows.
    """

    def __init__(self, source: LiveSource, feed: Feed):
        self.source, self.feed = source, feed
        self.failure: BaseException | None = None
        self.version = 0
        self._playing, self._refusal = True, ""
        self._watched = threading.Event()
        self._stop = threading.Event()
        self._requests: queue.Queue[Request] = queue.Queue(MAX_REQUESTS)
        self._thread = threading.Thread(target=self._run_guarded, name="live", daemon=True)

    def __enter__(self) -> Player:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def watch(self) -> None:
        """Start the simulation, as a page is open."""
        self._watched.set()

    def ask(self, request: Request) -> bool:
        """Queue a request; False if too many wait already."""
        try:
            self._requests.put_nowait(request)
        except queue.Full:
            return False
        return True

    def wait(self) -> None:
        """Wait for the end of the thread, which only a failure brings.

        Raises:
            BaseException: that failure.
        """
        while self._thread.is_alive():
            self._thread.join(0.2)
        if self.failure is not None:
            raise self.failure

    def description(self) -> dict[str, Any]:
        """Plain JSON values of the present state, for the page."""
        state = self.source.state
        return {
            "version": self.version,
            "playing": self._playing,
            "values": dict(state.values),
            "seed": state.seed,
            "ended": state.ended,
            "warning": state.warning,
            "events": [asdict(event) for event in state.events],
            "refusal": self._refusal,
        }

    def _run_guarded(self) -> None:
        try:
            self._run()
        except BaseException as error:  # noqa: BLE001 - `wait` raises it again
            self.failure = error
            self.feed.notify()

    def _run(self) -> None:
        due, last = 0.0, time.monotonic()
        while not self._stop.wait(PERIOD):
            self._obey()
            now = time.monotonic()
            if self._playing and self._watched.is_set():
                due = min(due + now - last, MAX_LAG)
            last = now
            strides = int(due / STRIDE)
            if strides:
                due -= strides * STRIDE
                self._advance(strides * STRIDE)

    def _advance(self, seconds: float) -> None:
        state = self.source.state
        before = state.ended, state.events, state.warning
        self.feed.put(self.source.advance(seconds))
        if (state.ended, state.events, state.warning) != before:
            if state.ended:
                self._playing = False
            self._publish()

    def _publish(self) -> None:
        """Tell the pages that the state has changed."""
        self.version += 1
        self.feed.notify()

    def _obey(self) -> None:
        """Apply the waiting requests; of each slider only the last."""
        waiting: list[Request] = []
        while not self._requests.empty():
            waiting.append(self._requests.get_nowait())
        last = {request.key: request for request in waiting if isinstance(request, Set)}
        for request in waiting:
            if isinstance(request, Set) and last[request.key] is not request:
                continue
            try:
                self._refusal = ""
                self._apply(request)
            except InputError as error:
                self._refusal = str(error)
            self._publish()

    def _apply(self, request: Request) -> None:
        match request:
            case Pause(on):
                self._playing = not on
                if not on and self.source.state.ended:
                    self._restart(None)
            case SingleStep():
                self._playing = False
                self._advance(STEP)
            case Reset(seed):
                self._restart(seed)
            case Set(key, value):
                self.source.set(key, value)

    def _restart(self, seed: int | None) -> None:
        self.source.reset(seed)
        self.feed.clear()
        self._playing = True


_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def page_response(view: View) -> tuple[dict[str, str], bytes]:
    """Headers and HTML of the page of a simulation; both have its content policy."""
    drawing = ARM if view.scene is None else ARM_IN_SPACE
    codes = (*scripts(*CHARTS, *drawing), _read_asset("strip.js"), _read_asset("live.js"))
    shown = replace(
        view,
        title=printable(view.title),
        about=printable(view.about),
        notes=tuple(map(printable, view.notes)),
    )
    rules = policy(codes, "connect-src 'self' ws://127.0.0.1:* ws://localhost:*")
    html = render(
        "live.html",
        "palpate.live",
        view=shown,
        data=data(shown.to_json()),
        title=f"{shown.title} – palpate live",
        command="",
        own_styles=_read_asset("live.css"),
        scripts=codes,
        policy=rules,
    )
    return {**_HEADERS, "Content-Security-Policy": f"{rules}; frame-ancestors 'none'"}, html.encode()


def _read_asset(name: str) -> str:
    return (resources.files("palpate.live") / name).read_text(encoding="utf-8")
