"""The last seconds of rows: readers take the new ones, and a slow reader loses rows, so that memory stays bounded."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from palpate.arrays import Array
from palpate.live.view import COLUMNS, STRIDE

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
        """Calls the listeners."""
        with self._lock:
            listeners = list(self._listeners)
        for listener in listeners:
            listener()
