"""A model's parameters and how far each may be off, whatever else is in the log.

The model is linearised where least squares have it; the mixed model then weighs its columns by octave beside other
causes of force, and the budget says what each cause may do. The lag of the force is a column with a prior, never a
free number; the columns are formed again at the lag found until it rests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import Budget, Spread
from palpate.identification.estimators.effects import effect_columns
from palpate.identification.estimators.fit import Fit, fit
from palpate.identification.estimators.mixed import Design, Levels, Solution, System, estimate, expanded, solve
from palpate.identification.estimators.octaves import (
    Octaves,
    Segment,
    line_frequencies,
    lowest_line,
    octave_of,
    octaves_of,
    segments_of,
)
from palpate.identification.models import Model
from palpate.identification.prior import LAG, mass_std
from palpate.identification.problem import Problem

Array = NDArray[np.float64]

_ROUNDS = 4
_RESTS = 0.02
"""Share of its deviation by which a lag may still move."""
_QUIETEST = 16
"""Lines of an octave that may stand for the sensor's noise."""


@dataclass(frozen=True)
class Answer:
    """The parameters of a model.

    Args:
        names: of the parameters, the lag last if it is not known exactly.
        theta: shape (p,).
        cov: of the mixed model, shape (p, p).
        budget: by cause.
        fit: least squares at the same lag.
        explained: share of the force's variance in contact that the model alone accounts for.
        unexplained: rms of what is left beyond the sensor's noise [N].
        sensor: mean square of the sensor's own noise [N^2].
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    budget: Budget
    fit: Fit
    explained: float
    unexplained: float
    sensor: float

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    @property
    def half(self) -> Array:
        """95 % half-widths of all causes together, shape (p,)."""
        return causes.half_widths(self.budget)

    def half_of(self, name: str) -> float:
        """The same of one parameter."""
        return float(self.half[self.names.index(name)])

    def parts(self, name: str) -> dict[str, float]:
        """Half-width of one parameter by cause, largest first."""
        i = self.names.index(name)
        found = {
            cause: float(causes.half_widths({cause: Spread(part.variance[i : i + 1], part.freedom)})[0])
            for cause, part in self.budget.items()
        }
        return dict(sorted(found.items(), key=lambda item: -item[1]))


def answer(problem: Problem, model: Model) -> Answer:
    """Fit a model and find how far to trust each parameter.

    Raises:
        InputError: the stretches in contact are too short.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        raise InputError("every stretch in contact is too short; log longer or faster")
    lag = problem.lag.value
    for _ in range(_ROUNDS):
        question = _Question.of(problem, model, lag, segments)
        solution, levels = estimate(question.system)
        if problem.lag.std == 0:
            break
        moved = float(solution.theta[question.names.index(LAG)])
        limit = 3 * problem.lag.std
        moved = float(np.clip(moved, problem.lag.value - limit, problem.lag.value + limit))
        if abs(moved - lag) < _RESTS * problem.lag.std:
            break
        lag = moved
    return question.answered(solution, levels)


@dataclass(frozen=True)
class _Question:
    problem: Problem
    fit: Fit
    names: tuple[str, ...]
    columns: Array
    design: Design
    segments: list[Segment]
    octaves: Octaves
    lowest: float
    system: System

    @classmethod
    def of(cls, problem: Problem, model: Model, lag: float, segments: list[Segment]) -> _Question:
        """Linearise the model at a lag, and sum its columns by octave."""
        motion = problem.motion
        fitted = fit(model, motion, problem.force, replace(problem.lag, value=lag, std=0.0))
        free = [n for n in fitted.names if n != "offset" and (n != LAG or problem.lag.std > 0)]
        at = [fitted.names.index(n) for n in free]
        jacobian, theta = fitted.jacobian[:, at], fitted.theta[at]
        target = fitted.residuals + jacobian @ theta
        effects = effect_columns(motion, lag, segments, problem.time)
        columns = np.column_stack([jacobian, *(c for own in effects.values() for c in own), target])
        places, begin = {}, len(free)
        for name, own in effects.items():
            places[name] = tuple(range(begin, begin + len(own)))
            begin += len(own)
        prior = {LAG: (problem.lag.value, problem.lag.std)} if LAG in free else {}
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        local = tuple(free.index(n) for n in ("K", "B") if n in free)
        design = Design(tuple(free), prior, places, local)
        dt = float(np.median(np.diff(problem.time)))
        lowest = lowest_line(segments, dt)
        octaves = octaves_of(columns, segments, dt, lowest)
        system = expanded(octaves, design)
        return cls(problem, fitted, tuple(free), columns, design, segments, octaves, lowest, system)

    @property
    def dt(self) -> float:
        """From row to row [s]."""
        return float(np.median(np.diff(self.problem.time)))

    def answered(self, solution: Solution, levels: Levels) -> Answer:
        """The answer with its budget."""
        p = self.system.parameters
        lag = self.names.index(LAG) if LAG in self.names else None
        sensor = self._sensor(levels)
        budget = causes.of_system(self.system, levels, solution, lag)
        budget["octaves"] = causes.of_octaves(self.system, levels, solution)
        budget["repetition"] = self._repetition(levels)
        budget["strokes"] = self._strokes(solution, levels)
        budget["unexplained"] = causes.of_unexplained(self.system, levels, solution, sensor)
        explained, left = self._explained(solution, levels, sensor)
        theta, cov = solution.theta[:p], solution.cov[:p, :p]
        noise = float(sensor @ self.system.lines) / max(float(self.system.lines.sum()), 1.0)
        return Answer(self.names, theta, cov, budget, self.fit, explained, left, noise)

    def _repetition(self, levels: Levels) -> Spread:
        """Two disjoint parts of the log: every other contact, or the two halves of a single one."""
        groups = sorted({s.group for s in self.segments})
        if len(groups) > 1:
            one, other = groups[::2], groups[1::2]
            octaves = self.octaves
        else:
            halves = [h for s in self.segments for h in _halves(s)]
            if len({h.group for h in halves}) < 2:
                return Spread(np.zeros(self.system.parameters), 1.0)
            octaves = octaves_of(self.columns, halves, self.dt, self.lowest)
            one, other = [0], [1]
        p = self.system.parameters
        first, second = (solve(expanded(octaves.of_groups(g), self.design), levels) for g in (one, other))
        return causes.of_halves(first, second, p)

    def _strokes(self, solution: Solution, levels: Levels) -> Spread:
        """Motion into the surface and out of it, each by itself."""
        p = self.system.parameters
        speed = self.problem.motion.moved(1, self.fit.lag)
        pieces = _strokes(speed, self.segments)
        if not pieces:
            return Spread(np.zeros(p), 2.0)
        octaves = octaves_of(self.columns, pieces, self.dt, self.lowest)
        ways = sorted({piece.group for piece in pieces})
        part = solve(expanded(octaves.of_groups(ways), self.design), levels)
        spread = causes.of_strokes(solution, part, p)
        if len(ways) == 2:
            both = [solve(expanded(octaves.of_groups([w]), self.design), levels) for w in ways]
            apart = causes.of_halves(both[0], both[1], p)
            spread = Spread(np.maximum(spread.variance, apart.variance), 2.0)
        return spread

    def _sensor(self, levels: Levels) -> Array:
        """Variance of a line by the sensor's own noise in each octave: out of contact, else the quietest octave's."""
        from scipy.fft import dct

        count = len(levels.noise)
        gain = self.problem.motion.chain.gain(self.octaves.frequency) ** 2
        enough = self.system.lines >= _QUIETEST
        ratio = levels.noise / np.maximum(gain, 1e-12)
        floor = float(ratio[enough].min()) if enough.any() else float(ratio.min())
        sensor = floor * gain
        power, lines = np.zeros(count), np.zeros(count)
        for stretch in self.problem.free:
            own = dct(stretch - stretch.mean(), norm="ortho")[1:] ** 2
            number = octave_of(line_frequencies(len(stretch), self.dt), self.lowest)
            keep = number < count
            power += np.bincount(number[keep], own[keep], count)
            lines += np.bincount(number[keep], minlength=count)
        seen = lines >= 2
        sensor[seen] = np.maximum(power[seen] / lines[seen], sensor[seen])
        return np.minimum(sensor, levels.noise)

    def _explained(self, solution: Solution, levels: Levels, sensor: Array) -> tuple[float, float]:
        """Share of the force's variance in contact that the model's own columns account for, noise left aside."""
        p, total = self.system.parameters, self.octaves.total.sum(axis=0)
        full = np.zeros(total.shape[0])
        full[:p], full[-1] = -solution.theta[:p], 1.0
        offset = np.zeros_like(full)
        offset[-1] = 1.0
        if LAG in self.names:  # the target counts the lag from zero
            at = self.names.index(LAG)
            offset[at] = -self.fit.lag
        noise = float(sensor @ self.system.lines)
        left = max(float(full @ total @ full) - noise, 0.0)
        whole = max(float(offset @ total @ offset) - noise, 1e-300)
        count = max(float(self.system.lines.sum()), 1.0)
        return 1 - left / whole, float(np.sqrt(left / count))


def _halves(segment: Segment) -> list[Segment]:
    middle = (segment.first + segment.last) // 2
    parts = [Segment(segment.first, middle, 0), Segment(middle, segment.last, 1)]
    return [s for s in parts if s.last - s.first >= 8]


def _strokes(speed: Array, segments: list[Segment]) -> list[Segment]:
    """Stretches that move one way, of 8 rows or more; group 0 into the surface, 1 out of it, if both are there."""
    still = 0.05 * float(np.percentile(np.abs(speed), 95))
    way = np.where(speed > still, 1, np.where(speed < -still, -1, 0)).astype(np.int8)
    found = []
    for s in segments:
        own = way[s.first : s.last]
        edges = np.flatnonzero(np.diff(own)) + 1
        for a, b in zip(np.r_[0, edges], np.r_[edges, len(own)], strict=True):
            if b - a >= 8 and own[a] != 0:
                found.append(Segment(s.first + int(a), s.first + int(b), 0 if own[a] > 0 else 1))
    groups = {s.group for s in found}
    return [replace(s, group=0) for s in found] if groups == {1} else found
