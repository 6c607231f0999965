"""The stiffness map of a surface from presses at places: its interval everywhere, and where to press next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice, pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from palpate._jit.typed_edge import cast_array, cast_number
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.maps.gaussian_process import LEVEL, Z95, GaussianProcess, fit
from palpate.maps.surface import Grid, Surface

CANDIDATES = 600
"""Places among which the next press is chosen: in a plane 25 by 25, as fine as hundreds of presses are apart."""
LARGEST = 1e12
"""Bound of coordinates [m] and of values in SI units, above those that anything has; its inverse bounds from below."""
MAX_CANDIDATES, MAX_PLACES = 5000, 1_000_000
"""Places to choose the next press from (their covariance has 200 MB), and places of a grid, at most."""
MAX_PRESSES = 1000
"""Further presses that `presses_until` counts at most."""


def _number(name: str, value: Any, low: float, high: float) -> float:
    """A number within its range, whole where its bounds are."""
    number = cast_number(name, value)
    if not low <= number <= high or (isinstance(low, int) and number % 1):
        raise InputError(f"{name} must be from {low:g} to {high:g}, got {number:g}")
    return number


def _log_threshold(threshold: Any) -> float:
    return float(np.log(_number("a threshold", threshold, 1.0 / LARGEST, LARGEST)))


def _exp(log: Array) -> Array:
    """Exponential, of finite numbers: an interval that says nothing ends at `LARGEST` squared and at its inverse."""
    return np.exp(np.clip(log, -2.0 * np.log(LARGEST), 2.0 * np.log(LARGEST)))


@dataclass(frozen=True)
class StiffnessPrediction:
    """The stiffness at places.

    Args:
        mean: of its natural logarithm (n,).
        std: of the logarithm of the surface's own stiffness (n,).
        next_std: of the logarithm of the stiffness that a next press would state (n,).
        common: relative standard deviation of the error that all presses share [1].
        z95: half-width of the surface's 95 % interval over its standard deviation.
        next_z95: that of a next press.
    """

    mean: Array
    std: Array
    next_std: Array
    common: float
    z95: float = Z95
    next_z95: float = Z95

    @property
    def stiffness(self) -> Array:
        """The median of the stiffness (n,) [N/m]."""
        return _exp(self.mean)

    @property
    def relative_half(self) -> Array:
        """Half-width of the 95 % interval over the surface's own value (n,)."""
        return _exp(self.z95 * np.hypot(self.std, self.common)) - 1.0

    @property
    def ci95(self) -> Array:
        """95 % interval of the surface's own stiffness (n, 2) [N/m]."""
        return self._interval(self.z95 * np.hypot(self.std, self.common))

    @property
    def next95(self) -> Array:
        """95 % interval of the stiffness that a next press states (n, 2) [N/m]; it shares the error common to all."""
        return self._interval(self.next_z95 * self.next_std)

    def exceeds(self, threshold: float) -> Array:
        """Probability that the stiffness is above a threshold [N/m] (n,)."""
        return np.asarray(ndtr((self.mean - _log_threshold(threshold)) / np.hypot(self.std, self.common)))

    def _interval(self, half: Array) -> Array:
        return _exp(self.mean[:, None] + np.outer(half, [-1.0, 1.0]))


@dataclass(frozen=True)
class NextPresses:
    """Places to press next, in order; an array of them where one is wanted.

    Args:
        places: (count, d) [m].
        expected_half: half-width of the 95 % interval of the stiffness there after these presses (count,) [N/m].
    """

    places: Array
    expected_half: Array

    def __len__(self) -> int:
        return len(self.places)

    def __array__(self, dtype: object = None, copy: object = None) -> Array:
        return np.array(self.places, dtype=float)


class StiffnessMap:
    """A Gaussian process on the logarithm of the stiffness over a surface.

    Args:
        common: standard deviation of an error that all presses share, such as the scale of the force sensor, relative
            to the stiffness [1].
    """

    def __init__(self, common: float = 0.0):
        self._common = _number("common", common, 0.0, np.nextafter(1.0, 0.0))
        self._places, self._stiffness, self._half = np.empty((0, 2)), np.empty(0), np.empty(0)
        self._line = np.empty(0)
        self._process: GaussianProcess | None = None
        self._surface: Surface | None = None

    def __len__(self) -> int:
        return len(self._stiffness)

    @property
    def places(self) -> Array:
        """Places of the presses (n, d) [m]."""
        return self._places

    @property
    def stiffness(self) -> Array:
        """Stiffness of the presses (n,) [N/m]."""
        return self._stiffness

    @property
    def half(self) -> Array:
        """Half-width of each press' own 95 % interval (n,) [N/m]."""
        return self._half

    @property
    def surface(self) -> Surface:
        """The hull of the presses."""
        if self._surface is None:
            self._surface = Surface(self._places)
        return self._surface

    def update(self, places: Any, stiffness: Any, half: Any, line: Any = None) -> None:
        """Add presses.

        Args:
            places: (n, 2) or (n, 3) [m], of one frame.
            stiffness: (n,) [N/m].
            half: half-width of each 95 % interval (n,) [N/m].
            line: a number of each press (n,), such as that of its slide or session: presses of one number share an
                error, which is estimated; NaN or None for presses that share none.

        Raises:
            InputError: shapes differ, a number is not finite or not above zero, or one place has two values.
        """
        where = cast_array("places", places)
        value = cast_array("stiffness", stiffness)
        width = cast_array("half", half)
        number = np.full(value.shape, np.nan) if line is None else cast_array("line", line)
        shapes = (value.shape, width.shape, number.shape)
        if where.ndim != 2 or where.shape[1] not in (2, 3) or {*shapes} != {(len(where),)}:
            raise InputError(
                "a map takes places (n, 2) or (n, 3), stiffness (n,), half (n,) and line (n,), got shapes "
                f"{where.shape}, {', '.join(map(str, shapes))}"
            )
        if len(self) and where.shape[1] != self._places.shape[1]:
            raise InputError(
                f"the map has places of {self._places.shape[1]} coordinates, these have {where.shape[1]}; a map has "
                "one frame"
            )
        _check_numbers("places", where, positive=False)
        _check_numbers("stiffness", value, positive=True)
        _check_numbers("half", width, positive=True)
        where = np.concatenate([self._places.reshape(-1, where.shape[1]), where])
        value = np.concatenate([self._stiffness, value])
        width = np.concatenate([self._half, width])
        _refuse_contradictions(where, value, width)
        self._places, self._stiffness, self._half = where, value, width
        self._line = np.concatenate([self._line, number])
        self._process = self._surface = None

    @property
    def process(self) -> GaussianProcess:
        """The Gaussian process of all presses."""
        if self._process is None:
            self.surface  # noqa: B018 - refuses presses that span no surface
            lines, line = np.unique(self._line, return_inverse=True, equal_nan=False)
            shared = line.astype(float) if 1 < len(lines) < len(line) else None
            std = self._half / (Z95 * self._stiffness)
            self._process = fit(self._places, np.log(self._stiffness), std, shared)
        return self._process

    def predict(self, places: Any) -> StiffnessPrediction:
        """The stiffness at places (n, d) [m], and that of a next press whose own interval is the presses' median."""
        at = self._checked("places", np.atleast_2d(cast_array("places", places)))
        mean, variance = self.process.predict(at)
        next_std = np.sqrt(variance + self._noise)
        z95 = (self.process.z95, self.process.next_z95)
        return StiffnessPrediction(mean, np.sqrt(variance), next_std, self._common, *z95)

    def next(
        self, count: int = 1, candidates: Any = None, *, stiffer_than: float | None = None
    ) -> NextPresses:
        """Choose the next presses: each place takes most off the variance, given those before it.

        Args:
            count: places.
            candidates: among which to choose (m, d) [m]; a grid within the hull of the presses if None.
            stiffer_than: a threshold [N/m] whose edge is sought: half of the weight lies where the stiffness may cross
                it (Picheny et al. 2010, eq. 8), half everywhere, for lumps not yet found. Without it every place counts
                alike.
        """
        count = int(_number("the next presses", count, 1, MAX_PRESSES))
        among = self._candidates() if candidates is None else self._checked("candidates", candidates)
        _number("the number of candidates", len(among), 1, MAX_CANDIDATES)
        mean, variance = self.process.predict(among)
        weights = np.ones(len(mean))
        if stiffer_than is not None:
            std = np.sqrt(np.maximum(variance, 1e-12))
            density = np.exp(-0.5 * ((_log_threshold(stiffer_than) - mean) / std) ** 2) / std
            weights = 1.0 + density / max(float(density.mean()), 1e-300)
        covariance = self.process.likeliest.covariance(among)
        steps = list(islice(choose(covariance, weights, self._noise), count))
        chosen = [place for place, _ in steps]
        left = steps[-1][1]
        unknown = np.maximum(variance - np.diag(covariance), 0.0)  # of the process' parameters
        width = self.process.z95 * np.sqrt(left[chosen] + unknown[chosen] + self._common**2)
        return NextPresses(among[chosen], 0.5 * (_exp(mean[chosen] + width) - _exp(mean[chosen] - width)))

    def presses_until(self, half: float) -> int | None:
        """Presses after which the interval is under a half-width nearly everywhere.

        Args:
            half: of the 95 % interval wanted of 95 % of the surface, relative to the stiffness.

        Returns:
            How many more presses; None if it needs more than `MAX_PRESSES` or the presses' common error is larger.
        """
        half = _number("the half-width", half, 1.0 / LARGEST, LARGEST)
        max_variance = (np.log1p(half) / self.process.z95) ** 2 - self._common**2
        if not max_variance > 0.0:
            return None
        covariance = self.process.likeliest.covariance(self._candidates())
        noise = self._noise
        presses = choose(covariance, np.ones(len(covariance)), noise)
        variances = chain([np.diag(covariance)], (variance for _, variance in presses))
        is_reached = (
            np.quantile(variance, 0.95) <= max_variance for variance in islice(variances, MAX_PRESSES + 1)
        )
        return next((count for count, enough in enumerate(is_reached) if enough), None)

    def disagreeing(self) -> list[int]:
        """Presses that their neighbours contradict: of such a deviation n presses have one in 20 maps by chance."""
        errors, variance = self.process.likeliest.leave_one_out()
        bound = ndtri(1.0 - 0.025 / len(self))
        return [int(i) for i in np.flatnonzero(np.abs(errors) > bound * np.sqrt(variance))]

    def grid(self, count: int = 10_000) -> Grid:
        """A grid of some `count` places over the hull of the presses."""
        return self.surface.grid(int(_number("the places of a grid", count, 1, MAX_PLACES)))

    def _checked(self, name: str, places: Any) -> Array:
        """Places (n, d) of the map's coordinates, finite."""
        at = cast_array(name, places, (None, self._places.shape[1]))
        if not (np.abs(at) < LARGEST).all():
            raise InputError(f"{name} must be finite, below {LARGEST:g} m")
        return at

    @property
    def _noise(self) -> float:
        """Variance of a normal next press, on its own line, whose 95 % are those of one that errs as any before."""
        stated = self._half / (Z95 * self._stiffness)
        std = np.sqrt(stated**2 + self.process.repeat**2 + self.process.shared**2)
        outside = lambda half: 2.0 * np.mean(ndtr(-half / std)) - LEVEL  # noqa: E731
        return float(brentq(outside, Z95 * std.min() / 2.0, 2.0 * Z95 * std.max()) / Z95) ** 2

    def _candidates(self) -> Array:
        grid = self.grid(CANDIDATES)
        return grid.places[grid.inside]


def _check_numbers(name: str, values: Array, *, positive: bool) -> None:
    bad = ~(np.abs(values) < LARGEST) | (positive & (values < 1.0 / LARGEST))
    if bad.any():
        raise InputError(
            f"{name} must be finite{' and above 0' if positive else ''}, of a size that is measured (below "
            f"{LARGEST:g}), got {values[bad][0]:g} at press {int(np.argwhere(bad)[0][0]) + 1}"
        )


def _refuse_contradictions(places: Array, stiffness: Array, half: Array) -> None:
    """Refuse two presses at one place that no repetition explains.

    They differ by more than their intervals and twice the span of all other presses. Of twenty normal values the
    span is 3.7 standard deviations (Tippett 1925), so that two repeated presses differ so with a probability below
    1e-6.
    """
    value = np.log(stiffness)
    std = half / (Z95 * stiffness)
    _, place = np.unique(places, axis=0, return_inverse=True)
    place = place.ravel()
    for i, j in pairwise(np.argsort(place, kind="stable")):
        remaining = np.delete(value, [i, j])
        if place[i] != place[j] or not len(remaining):
            continue
        if abs(value[i] - value[j]) > Z95 * np.hypot(std[i], std[j]) + 2.0 * np.ptp(remaining):
            where = ", ".join(f"{1e3 * c:.6g}" for c in places[i])
            raise InputError(
                f"presses {i + 1} and {j + 1} are at one place ({where} mm) with a stiffness of {stiffness[i]:.4g} "
                f"and {stiffness[j]:.4g}, further apart than their intervals and than the map; leave the wrong one out"
            )


def choose(covariance: Array, weights: Array, noise: float) -> Iterator[tuple[int, Array]]:
    """Choose places one after the other, each by what it takes off the weighted variance given those before.

    Args:
        covariance: of the logarithm at the candidates (m, m).
        weights: of the candidates' variances (m,).
        noise: variance of one press.

    Yields:
        The next candidate, and the variance at each candidate after a press there (m,).
    """
    remaining = covariance
    while True:
        gain = np.einsum("i,ij,ij->j", weights, remaining, remaining) / (np.diag(remaining) + noise)
        best = int(np.argmax(gain))
        column = remaining[:, best] / np.sqrt(remaining[best, best] + noise)
        yield best, np.maximum(np.diag(remaining) - column**2, 0.0)
        remaining = remaining - np.outer(column, column)
