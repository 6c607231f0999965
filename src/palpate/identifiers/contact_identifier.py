"""Position and force in, mass, damping and stiffness out, a reading at a time: the on-line twin of an identification.

The position is read through the force sensor's own low-pass at the instants of the sensor's samples, with the weights
that `palpate.identification` uses for a log, so that a stream and a log of it give the same regressors.
"""

from __future__ import annotations

from collections import deque
from math import ceil, floor
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.errors import InputError
from palpate.identifiers.recursive_least_squares import RecursiveLeastSquares
from palpate.signals.low_pass import LowPass
from palpate.signals.taps import FRACTIONS, taps
from palpate.signals.types import Estimate

Array = NDArray[np.float64]

NAMES = ("M", "B", "K", "offset")
_FORGOTTEN = 10.0
_ROOM = 1e-9
"""Of a period, for the rounding of an instant that falls on a row."""
_VAGUE = (10.0, 1e4, 1e6, 1e3)
"""Deviation of each parameter before anything is known [kg], [N s/m], [N/m], [N], in the force's noise."""


class Estimator(Protocol):
    """What takes the regressors: any estimator of `palpate.identifiers`."""

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Take one sample in."""

    def estimate(self) -> Estimate:
        """What is known so far."""


class Refresh:
    """Follows the instants at which a sensor slower than the loop puts out its samples.

    A change seen in a row says that a sample came out within the row before it; the rows seen so far leave the phase
    of an even grid in a small interval, whose middle is taken.

    Args:
        period: rows between two samples, at least 1.
    """

    def __init__(self, period: float):
        self.period = period
        self._low, self._high = -np.inf, np.inf
        self._last = -1

    def seen(self, row: int, changed: bool) -> float | None:
        """The instant of the sample that this row shows for the first time, in rows; None if it shows none."""
        if changed:
            self._narrow(row)
        elif not np.isfinite(self._high) or self._high + (self._last + 1) * self.period > row:
            return None
        else:  # it has come out, and equals the one before
            self._last += 1
        return (self._low + self._high) / 2 + self._last * self.period

    def _narrow(self, row: int) -> None:
        if not np.isfinite(self._high):
            self._low, self._high, self._last = row - 1.0, float(row), 0
            return
        number = (
            floor((row - 1 - self._high) / self.period + _ROOM) + 1
        )  # the first that may have come out since
        if self._low + number * self.period > row:  # the clock drifts: the nearest
            number = round((row - 0.5 - (self._low + self._high) / 2) / self.period)
        self._last = max(number, self._last)
        start = self._last * self.period
        low, high = max(self._low, row - 1 - start), min(self._high, row - start)
        drifted = low >= high - _ROOM  # it comes after `low`, and no later than `high`
        self._low, self._high = (row - 1 - start, row - start) if drifted else (low, high)


class ContactIdentifier:
    """Identifies a contact on line from what a control loop has: a position and a force each tick.

    When to use it: the force sensor's low-pass and lag are known, and the loop runs at an even rate. What it says of
    a tick, it says some ticks later (`delay`): to read the position at an instant takes its neighbours on both sides.

    Args:
        low_pass: of the force sensor, or its text, as `butterworth3:120`.
        rate: ticks a second [Hz].
        lag: how much later a fresh force reading stands in the loop than the force it measured, the low-pass
            included [s].
        sampling: samples of the force sensor a second [Hz]; None if each tick has a fresh one.
        touch: force above which the tip is in contact, and half of which it is again free below [N]; None while it
            never leaves the surface. It is the mean over some samples that counts, for noise must not choose which
            samples of a light contact are taken; so that none taken is too late to be in contact, all wait for it.
        estimator: of `NAMES`, four regressors; recursive least squares that forget nothing if None.

    Raises:
        InputError: a low-pass of less than second order, a rate that is too low for it, a number out of range.
    """

    def __init__(
        self,
        low_pass: LowPass | str,
        rate: float,
        lag: float,
        *,
        sampling: float | None = None,
        touch: float | None = None,
        estimator: Estimator | None = None,
    ):
        self.low_pass = LowPass.parse(low_pass) if isinstance(low_pass, str) else low_pass
        _check(self.low_pass, rate, lag, sampling, touch)
        vague = np.diag(np.square(_VAGUE))
        self.estimator = estimator or RecursiveLeastSquares(np.zeros(4), vague, names=NAMES)
        self.touch = touch
        dt = 1 / rate
        weights = taps(self.low_pass, dt, 3)
        self._weights = weights.weights[:, ::-1] / np.array([dt**2, dt, 1.0])[:, None]
        self._before, self._after = weights.before, weights.after
        self._late = (lag - self.low_pass.lag) * rate
        self._count = self._weights.shape[2]
        self._settling = _FORGOTTEN / self.low_pass.decay * rate
        self._held = 2 * self._settling if touch is not None else 0.0
        self._samples = ceil(self._settling * (sampling or rate) / rate)
        self._recent: deque[float] = deque(maxlen=self._samples)
        self._room = self._count + ceil(abs(self._late)) + ceil(self._held) + 2
        self._ring = np.zeros(2 * self._room)
        self._phi = np.ones(4)
        self._refresh = Refresh(rate / sampling) if sampling is not None else None
        self._waiting: deque[tuple[float, float]] = deque()
        self._row, self._since, self._origin, self._force = -1, 0.0, 0.0, np.nan
        self._touching = touch is None

    @property
    def delay(self) -> int:
        """Ticks between a reading and its part in the estimate."""
        return max(ceil(self._after - self._late), ceil(self._held), 0) + 1

    def update(self, position: float, force: float) -> None:
        """Takes in a tick's position [m], growing into the surface, and force on the surface [N].

        Raises:
            InputError: a number that is not finite; the estimate is unchanged.
        """
        if not (abs(position) < np.inf and abs(force) < np.inf):
            raise InputError(f"a tick must be finite, got position {position}, force {force}; leave it out")
        row = self._row = self._row + 1
        if row == 0:
            self._origin = position
        slot = row % self._room
        self._ring[slot] = self._ring[slot + self._room] = position - self._origin
        instant = float(row) if self._refresh is None else self._refresh.seen(row, force != self._force)
        self._force = force
        if instant is not None and self._in_contact(instant, force):
            self._waiting.append((instant, force))
        while self._waiting and self._ripe(self._waiting[0][0]):
            self._take(*self._waiting.popleft())

    def update_many(self, positions: ArrayLike, forces: ArrayLike) -> None:
        """Takes k ticks in, as k calls of `update` would: positions and forces of shape (k,)."""
        x, f = np.asarray(positions, dtype=np.float64), np.asarray(forces, dtype=np.float64)
        if x.ndim != 1 or x.shape != f.shape:
            raise InputError(f"positions and forces must have one shape (k,), got {x.shape} and {f.shape}")
        for position, force in zip(x.tolist(), f.tolist(), strict=True):
            self.update(position, force)

    def estimate(self) -> Estimate:
        """The estimator's own."""
        return self.estimator.estimate()

    def _in_contact(self, instant: float, force: float) -> bool:
        """Whether a sample belongs to a contact that its low-pass has seen nothing else than."""
        if self.touch is not None:
            self._recent.append(force)
            mean = sum(self._recent) / self._samples
            if not self._touching and mean > self.touch:
                self._touching, self._since = True, instant
            elif self._touching and mean < self.touch / 2:
                self._touching = False
                self._waiting.clear()
        return self._touching and instant >= self._since + self._settling

    def _ripe(self, instant: float) -> bool:
        """Whether the position around a sample is there, and the tip has been in contact for long enough after it."""
        return floor(instant - self._late) + self._after < self._row and instant + self._held <= self._row

    def _take(self, instant: float, force: float) -> None:
        place = round((instant - self._late) * FRACTIONS)
        whole, part = divmod(place, FRACTIONS)
        first = whole - self._before
        if first < 0:
            return
        start = first % self._room
        np.dot(self._weights[part], self._ring[start : start + self._count], out=self._phi[:3])
        self.estimator.update(self._phi, force)


def _check(low_pass: LowPass, rate: float, lag: float, sampling: float | None, touch: float | None) -> None:
    if low_pass.roll_off < 2:
        raise InputError(f"the low-pass must be of second order at least, got {low_pass}")
    if not 4 * low_pass.cutoff <= rate < np.inf:
        raise InputError(
            f"the rate must be at least four times the cut-off of {low_pass.cutoff:g} Hz, got {rate:g} Hz"
        )
    if not 0 <= lag < np.inf:
        raise InputError(f"the lag must be a number of seconds from 0, got {lag:g}")
    if sampling is not None and not 0 < sampling <= rate:
        raise InputError(f"sampling must be above 0 and at most the rate of {rate:g} Hz, got {sampling:g}")
    if touch is not None and not 0 < touch < np.inf:
        raise InputError(f"touch must be a force above 0 N, got {touch:g}")
