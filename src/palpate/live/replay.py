"""A log or a run's record, played again at the pace at which it was taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.live.view import AT, COLUMNS, STRIDE, Happened, State, View, planar_bones

FEWEST = 3
"""Rows that are worth playing."""


@dataclass(frozen=True)
class Signals:
    """The replayed columns: any of `COLUMNS`, by name, each of shape (n,), with times that grow.

    Args:
        columns: signals by name; `t` is among them.
        happened: moments to be marked.
    """

    columns: dict[str, Array]
    happened: tuple[Happened, ...] = ()

    def rows(self) -> Array:
        """One row a stride: its last, with the least and the largest measured force by turns."""
        t = self.columns["t"]
        whole = np.full((len(t), len(COLUMNS)), np.nan)
        for name, values in self.columns.items():
            whole[:, AT[name]] = values
        bins = np.floor((t - t[0]) / STRIDE + 1e-9).astype(np.int64)
        first = np.flatnonzero(np.diff(bins, prepend=-1))
        last = np.append(first[1:], len(t)) - 1
        rows = whole[last]
        measured = np.nan_to_num(whole[:, AT["measured"]], nan=-np.inf)
        highest = np.maximum.reduceat(measured, first)
        lowest = np.minimum.reduceat(np.nan_to_num(whole[:, AT["measured"]], nan=np.inf), first)
        turn = np.where(np.arange(len(rows)) % 2 == 0, highest, lowest)
        rows[:, AT["measured"]] = np.where(np.isfinite(turn), turn, np.nan)
        return rows


class Replay:
    """Signals played again.

    Args:
        view: of them; its span is set here.
        signals: at least three rows.
        first: when it begins [s]; at its first row if none is given.

    Raises:
        InputError: too few rows, or times that do not grow.
    """

    def __init__(self, view: View, signals: Signals, first: float | None = None):
        t = signals.columns["t"]
        if len(t) < FEWEST:
            raise InputError(f"there is nothing to show: {len(t)} rows")
        if not (np.diff(t) > 0).all():
            raise InputError(
                "the times of the log do not grow from row to row; mend the log, or name its clock"
            )
        self._rows = signals.rows()
        self._times = self._rows[:, AT["t"]]
        self._all = signals.happened
        there = tuple(name for name in COLUMNS if np.isfinite(self._rows[:, AT[name]]).any())
        self.view = View(**{**vars(view), "shown": there, "span": (float(t[0]), float(t[-1]))})
        self.state = State()
        self._first = float(t[0]) if first is None else first
        self._now, self._at = self._first, 0

    @property
    def loop_asked(self) -> None:
        """A log has no loop."""
        return

    def bones(self, row: Array) -> Array:
        """See `Source`."""
        return planar_bones(self.view.links, row)

    def reset(self, seed: int | None = None) -> None:
        """To the beginning; a log has no noise to draw again."""
        assert self.view.span is not None
        self.seek(max(self._first, self.view.span[0]))

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come."""
        if self.state.ended:
            return np.empty((0, len(COLUMNS)))
        self._now += seconds
        stop = int(np.searchsorted(self._times, self._now, side="right"))
        rows, self._at = self._rows[self._at : stop], max(stop, self._at)
        for one in self._all:
            if len(rows) and rows[0, 0] <= one.x <= rows[-1, 0] + STRIDE:
                self.state.note(one)
        if self._at >= len(self._rows):
            self.state.ended = "done: the log ends here"
        return rows

    def set(self, key: str, value: float) -> None:
        """Refused: a recording cannot change.

        Raises:
            InputError: always.
        """
        raise InputError("a replayed log has nothing to change")

    def seek(self, time: float) -> None:
        """To a moment; the seconds before it come at once, so that there is something to see.

        Raises:
            InputError: it is no time of the log.
        """
        assert self.view.span is not None
        first, last = self.view.span
        if not first <= time <= last:
            raise InputError(f"the log spans {first:.6g} to {last:.6g} s, got {time:.6g}")
        self._now = time
        self._at = int(np.searchsorted(self._times, time - 10.0, side="left"))
        self.state.ended, self.state.happened = "", []
