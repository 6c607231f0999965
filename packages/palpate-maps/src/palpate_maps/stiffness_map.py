"""Maps of a surface from presses at places, with an interval everywhere: of its stiffness, and of any other field."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, islice, pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from palpate.arrays import Array
from palpate.errors import InputError
from palpate_maps.gaussian_process import LEVEL, Z95, GaussianProcess, fit
from palpate_maps.next_press import Goal, NextPresses, choose, importance, travel
from palpate_maps.surface import Grid, Surface

CANDIDATES = 600
"""Places among which the next press is chosen: in a plane 25 by 25, as fine as hundreds of presses are apart."""
LARGEST = 1e12
"""Bound of coordinates [m] and of values in SI units, above those that anything has; its inverse bounds from below."""
MOST_PRESSES = 1000
"""Presses that `presses_until` foretells at most."""


@dataclass(frozen=True)
class FieldPrediction:
    """A field at places.

    Args:
        mean: of the field's natural logarithm or, where it is not logarithmic, of the field itself (n,).
        std: of the surface's own value, alike (n,).
        next_std: of the value that a next press would state, alike (n,).
        common: standard deviation of the error that all presses share, alike.
        logarithmic: whether the four are of the logarithm.
        z95: half-width of the surface's 95 % interval over its standard deviation.
        next_z95: that of a next press.
    """

    mean: Array
    std: Array
    next_std: Array
    common: float
    logarithmic: bool = True
    z95: float = Z95
    next_z95: float = Z95

    @property
    def value(self) -> Array:
        """The median of the field (n,), in the unit of its presses."""
        return np.exp(self.mean) if self.logarithmic else self.mean

    @property
    def stiffness(self) -> Array:
        """The median of the stiffness (n,) [N/m]."""
        return self.value

    @property
    def relative_half(self) -> Array:
        """Half-width of the 95 % interval over the surface's own value (n,), of a logarithmic field."""
        return np.expm1(self.z95 * np.hypot(self.std, self.common))

    @property
    def ci95(self) -> Array:
        """95 % interval of the surface's own value (n, 2)."""
        return self._interval(self.z95 * np.hypot(self.std, self.common))

    @property
    def next95(self) -> Array:
        """95 % interval of what a next press states (n, 2) [N/m]; it shares the error common to all."""
        return self._interval(self.next_z95 * self.next_std)

    def exceeds(self, threshold: float) -> Array:
        """Probability that the field is above a threshold (n,)."""
        level = np.log(threshold) if self.logarithmic else threshold
        return np.asarray(norm.sf(level, self.mean, np.hypot(self.std, self.common)))

    def _interval(self, half: Array) -> Array:
        ends = self.mean[:, None] + np.outer(half, [-1.0, 1.0])
        return np.exp(ends) if self.logarithmic else ends


class FieldMap:
    """A Gaussian process on a quantity over a surface, such as relaxation, loss or depth.

    Args:
        logarithmic: whether the process is on the logarithm of the quantity, which is then above zero.
        common: standard deviation of an error that all presses share, such as the scale of the force sensor: relative
            to the value if logarithmic, else in its unit.
        name: of the quantity, for messages.
    """

    def __init__(self, *, logarithmic: bool = False, common: float = 0.0, name: str = "value"):
        if not 0.0 <= common < (1.0 if logarithmic else np.inf):
            raise InputError(
                f"common must be at least 0{' and below 1' if logarithmic else ''}, got {common:g}"
            )
        self.logarithmic, self.name, self._common = logarithmic, name, common
        self._places, self._values, self._half = np.empty((0, 2)), np.empty(0), np.empty(0)
        self._line = np.empty(0)
        self._process: GaussianProcess | None = None
        self._surface: Surface | None = None

    def __len__(self) -> int:
        return len(self._values)

    @property
    def places(self) -> Array:
        """Of the presses (n, d) [m]."""
        return self._places

    @property
    def values(self) -> Array:
        """Of the presses (n,)."""
        return self._values

    @property
    def half(self) -> Array:
        """Half-width of each press' own 95 % interval (n,), in the values' unit."""
        return self._half

    @property
    def surface(self) -> Surface:
        """The hull of the presses."""
        if self._surface is None:
            self._surface = Surface(self._places)
        return self._surface

    def update(self, places: Any, values: Any, half: Any = None, line: Any = None) -> None:
        """Add presses.

        Args:
            places: (n, 2) or (n, 3) [m], of one frame.
            values: (n,), such as stiffness [N/m].
            half: half-width of each 95 % interval (n,), in the values' unit; None where presses state none, and the
                presses' own scatter is all that is known of their error.
            line: a number of each press (n,), such as that of its slide or session: presses of one number share an
                error, which is estimated; NaN or None for presses that share none.

        Raises:
            InputError: shapes differ, a number is not finite or not above zero, or one place has two values.
        """
        where, value = np.asarray(places, dtype=float), np.asarray(values, dtype=float)
        width = np.zeros(len(value)) if half is None and value.ndim else np.asarray(half, dtype=float)
        number = np.full(value.shape, np.nan) if line is None else np.asarray(line, dtype=float)
        shapes = (value.shape, width.shape, number.shape)
        if where.ndim != 2 or where.shape[1] not in (2, 3) or {*shapes} != {(len(where),)}:
            raise InputError(
                f"a map takes places (n, 2) or (n, 3), {self.name} (n,), half (n,) and line (n,), got shapes "
                f"{where.shape}, {', '.join(map(str, shapes))}"
            )
        if len(self) and where.shape[1] != self._places.shape[1]:
            raise InputError(
                f"the map has places of {self._places.shape[1]} coordinates, these have {where.shape[1]}; a map has "
                "one frame"
            )
        numbers = (
            ("places", where, False),
            (self.name, value, self.logarithmic),
            ("half", width, half is not None),
        )
        for name, each, positive in numbers:
            bad = ~(np.abs(each) < LARGEST) | (positive & (each < 1.0 / LARGEST))
            if bad.any():
                raise InputError(
                    f"{name} must be finite{' and above 0' if positive else ''}, of a size that is measured (below "
                    f"{LARGEST:g}), got {each[bad][0]:g} at press {int(np.argwhere(bad)[0][0]) + 1}"
                )
        together = [np.concatenate(pair) for pair in (
            (self._places.reshape(-1, where.shape[1]), where), (self._values, value), (self._half, width),
        )]  # fmt: skip
        if half is not None:
            self._refuse_contradictions(*together)
        self._places, self._values, self._half = together
        self._line = np.concatenate([self._line, number])
        self._process = self._surface = None

    @property
    def process(self) -> GaussianProcess:
        """The Gaussian process of all presses."""
        if self._process is None:
            self.surface  # noqa: B018 - refuses presses that span no surface
            lines, line = np.unique(self._line, return_inverse=True, equal_nan=False)
            shared = line.astype(float) if 1 < len(lines) < len(line) else None
            self._process = fit(self._places, *self._on_scale(self._values, self._half), shared)
        return self._process

    def predict(self, places: Any) -> FieldPrediction:
        """The field at places (n, d) [m], and that of a next press whose own interval is the presses' median."""
        at = np.atleast_2d(np.asarray(places, dtype=float))
        if len(self) and (at.ndim != 2 or at.shape[1] != self._places.shape[1]):
            raise InputError(
                f"the map has places of {self._places.shape[1]} coordinates, got shape {at.shape}"
            )
        mean, variance = self.process.predict(at)
        next_std = np.sqrt(variance + self._noise)
        z95 = (self.process.z95, self.process.next_z95)
        return FieldPrediction(mean, np.sqrt(variance), next_std, self._common, self.logarithmic, *z95)

    def next(
        self,
        count: int = 1,
        candidates: Any = None,
        *,
        goal: Goal = "interval",
        stiffer_than: float | None = None,
        start: Any = None,
        way: float = np.inf,
    ) -> NextPresses:
        """Where to press next.

        Args:
            count: places.
            candidates: among which to choose (m, d) [m]; a grid within the hull of the presses if None.
            goal: least `interval` over the candidates, the `edge` where the field crosses a threshold, or the
                `maximum`.
            stiffer_than: threshold of the edge, in the values' unit.
            start: where the robot stands (d,) [m].
            way: that the robot travels in the time of one press [m]; infinite where travel costs nothing.
        """
        if not 1 <= count <= MOST_PRESSES:
            raise InputError(f"the next presses must be 1 to {MOST_PRESSES}, got {count}")
        among = self._candidates() if candidates is None else np.asarray(candidates, dtype=float)
        if start is not None and np.shape(start) != among.shape[1:]:
            raise InputError(
                f"the robot stands at {np.size(start)} coordinates, the map has places of {among.shape[1]}"
            )
        mean, variance = self.process.predict(among)
        level = np.log(stiffer_than) if stiffer_than is not None and self.logarithmic else stiffer_than
        weights = importance(goal, mean, variance, level)
        cost = None if np.isinf(way) else travel(among, None if start is None else np.asarray(start), way)
        covariance = self.process.likeliest.covariance(among)
        steps = list(islice(choose(covariance, weights, self._noise, cost), count))
        chosen, left = [place for place, _ in steps], steps[-1][1]
        std = np.sqrt(
            left[chosen] + np.maximum(variance - np.diag(covariance), 0.0)[chosen] + self._common**2
        )
        half = self.process.z95 * std
        half = np.exp(mean[chosen]) * np.sinh(half) if self.logarithmic else half
        return NextPresses(among[chosen], half)

    def presses_until(self, half: float) -> int | None:
        """Presses after which the interval is under a half-width nearly everywhere.

        Args:
            half: of the 95 % interval asked of 95 % of the surface, relative to the value if logarithmic, else in its
                unit.

        Returns:
            How many more presses; None if it needs more than `MOST_PRESSES` or the presses' common error is larger.
        """
        if not half > 0.0:
            raise InputError(f"the half-width must be above 0, got {half:g}")
        asked = ((np.log1p(half) if self.logarithmic else half) / self.process.z95) ** 2 - self._common**2
        covariance, noise = self.process.likeliest.covariance(self._candidates()), self._noise
        presses = choose(covariance, np.ones(len(covariance)), noise)
        variances = chain([np.diag(covariance)], (variance for _, variance in presses))
        reached = (np.quantile(variance, 0.95) <= asked for variance in islice(variances, MOST_PRESSES + 1))
        return next((count for count, enough in enumerate(reached) if enough), None)

    def disagreeing(self) -> list[int]:
        """Presses that their neighbours contradict: of such a deviation n presses have one in 20 maps by chance."""
        bound = norm.ppf(1.0 - 0.025 / len(self))
        errors, variance = self.process.likeliest.leave_one_out()
        return [int(i) for i in np.flatnonzero(np.abs(errors) > bound * np.sqrt(variance))]

    def grid(self, count: int = 10_000) -> Grid:
        """A grid of some `count` places over the hull of the presses."""
        return self.surface.grid(count)

    @property
    def _noise(self) -> float:
        """Variance of a normal next press, on its own line, whose 95 % are those of one that errs as any before."""
        _, own = self._on_scale(self._values, self._half)
        std = np.sqrt(own**2 + self.process.repeat**2 + self.process.shared**2)
        outside = lambda half: 2.0 * np.mean(norm.sf(half / std)) - LEVEL  # noqa: E731
        return float(brentq(outside, Z95 * std.min() / 2.0, 2.0 * Z95 * std.max()) / Z95) ** 2

    def _candidates(self) -> Array:
        grid = self.grid(CANDIDATES)
        return grid.places[grid.inside]

    def _on_scale(self, values: Array, half: Array) -> tuple[Array, Array]:
        """Values (n,) and their own standard deviations (n,) on the scale of the process."""
        return (np.log(values), half / (Z95 * values)) if self.logarithmic else (values, half / Z95)

    def _refuse_contradictions(self, places: Array, values: Array, half: Array) -> None:
        """Refuse two presses at one place that no repetition explains.

        They differ by more than their intervals and twice what all other presses span. Of twenty normal values the
        span is 3.7 standard deviations (Tippett 1925), so that two repeated presses differ so with a probability below
        1e-6.
        """
        value, std = self._on_scale(values, half)
        _, place = np.unique(places, axis=0, return_inverse=True)
        place = place.ravel()
        for i, j in pairwise(np.argsort(place, kind="stable")):
            others = np.delete(value, [i, j])
            if place[i] != place[j] or not len(others):
                continue
            if abs(value[i] - value[j]) > Z95 * np.hypot(std[i], std[j]) + 2.0 * np.ptp(others):
                where = ", ".join(f"{1e3 * c:.6g}" for c in places[i])
                raise InputError(
                    f"presses {i + 1} and {j + 1} are at one place ({where} mm) with a {self.name} of {values[i]:.4g} "
                    f"and {values[j]:.4g}, further apart than their intervals and than the map; leave the wrong one out"
                )


class StiffnessMap(FieldMap):
    """A Gaussian process on the logarithm of the stiffness over a surface.

    Args:
        common: standard deviation of an error that all presses share, such as the scale of the force sensor, relative
            to the stiffness [1].
    """

    def __init__(self, common: float = 0.0):
        super().__init__(logarithmic=True, common=common, name="stiffness")

    @property
    def stiffness(self) -> Array:
        """Of the presses (n,) [N/m]."""
        return self.values
