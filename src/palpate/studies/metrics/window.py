"""A metric of a run, and the window in which it sees a record: since the first contact, as the study asks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import CONTACT, DIVERGED, LOST_CONTACT, TICK_ROUNDING, summarise
from palpate.records import Record

Value = float | None
LATE = 1.0
"""A force is judged over the last second of each interval between two steps [s]."""


@dataclass(frozen=True)
class Metric:
    """One number of a run.

    Args:
        name: as studies have it.
        unit: SI; "1" for a plain number.
        text: its description, in a line.
        of: from a window at a record; None where the run does not have it.
        words: meanings of its whole numbers, from 0 on; empty for a quantity.
        better: whether the least or the most of it is better; "" where neither is.
    """

    name: str
    unit: str
    text: str
    of: Callable[[Window], Value]
    words: tuple[str, ...] = ()
    better: Literal["", "least", "most"] = ""
    signed: bool = False
    """True for an error with a sign: of two values the nearer to 0 is the better."""

    @property
    def side(self) -> Literal["", "least", "most"]:
        """The better side, least or most; of a signed error the least magnitude."""
        return "least" if self.signed else self.better

    @property
    def title(self) -> str:
        """Name with unit, for an axis."""
        return f"{self.name} [{self.unit}]" if self.unit != "1" else self.name

    @property
    def sentence(self) -> str:
        """Text of the metric as the beginning of a sentence."""
        return self.text[0].upper() + self.text[1:]

    @property
    def phrase(self) -> str:
        """Name of the metric in a sentence."""
        return f"{self.name} by magnitude" if self.signed else self.name

    def value_in(self, window: Window) -> Value:
        """The number, or None where there is none or it is not finite."""
        with np.errstate(all="ignore"):
            value = self.of(window)
        return float(value) if value is not None and math.isfinite(value) else None


@dataclass(frozen=True)
class Window:
    """A record, and from when to when after the first contact it is judged [s].

    What several metrics need is computed once.
    """

    record: Record
    window: tuple[float, float] | None = None

    def __getitem__(self, name: str) -> Array:
        """A column within the window, while the contact controller runs."""
        return self.record[name][self.inside]

    @cached_property
    def pressing(self) -> Mask:
        """True where the contact controller runs, shape (n,)."""
        return self.record["phase"] == CONTACT

    @cached_property
    def touched(self) -> bool:
        """True if there was any contact."""
        return bool(self.pressing.any())

    @cached_property
    def since(self) -> Array:
        """Time since the first contact [s], shape (n,); negative before."""
        t = self.record["t"]
        return t - t[np.argmax(self.pressing)] if len(t) else t

    @cached_property
    def inside(self) -> Mask:
        """Rows in contact and within the window; none where the run ended before the window did."""
        if not self.touched:
            return self.pressing
        low, high = self.window or (0.0, math.inf)
        last = self.since[-1]
        if self.window is not None and self.ended and last < high - 2e-3:
            return np.zeros_like(self.pressing)
        return self.pressing & (self.since >= low - TICK_ROUNDING) & (self.since < high - TICK_ROUNDING)

    @cached_property
    def ended(self) -> bool:
        """True if the run ended before its time: contact was lost, or numbers were not finite."""
        return self.record.meta["end"] in {LOST_CONTACT, DIVERGED}

    @cached_property
    def error(self) -> Array:
        """True force less the desired one within the window [N]."""
        return self["force"] - self["force_desired"]

    @cached_property
    def intervals(self) -> Sequence[tuple[Array, Array]]:
        """Error and desired force [N] in the last second of each interval between two steps, within the window."""
        period = float(self.record.meta["experiment"]["force"]["period"])
        t = self.since[self.inside] + TICK_ROUNDING
        number = np.floor(t / period)
        late = t - period * number >= max(0.0, period - LATE)
        desired = self["force_desired"]
        edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(number)]
        parts = [slice(a, b) for a, b in pairwise(edges)]
        return [(self.error[p][late[p]], desired[p][late[p]]) for p in parts if late[p].any()]

    @cached_property
    def after_steps(self) -> Array:
        """Error [N] within the window, but for the first half second after each step of the desired force."""
        period = float(self.record.meta["experiment"]["force"]["period"])
        t = self.since[self.inside] + TICK_ROUNDING
        return self.error[t - period * np.floor(t / period) >= SETTLE]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Summary of the record by `palpate run`."""
        return summarise(self.record)


SETTLE = 0.5
"""Seconds after a step of the desired force that are not judged where so it is said [s]."""


def rms(error: Array) -> float:
    """Root of the mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(error**2))) if len(error) else math.nan
