"""A model's parameters and how far each may be off, whatever else is in the log.

The model is linearised where least squares have it; the mixed model then weighs its columns by octave beside other
causes of force, and the budget says what each cause may do. The lag of the force is a column with a prior, never a
free number; the columns are formed again at the lag found until it rests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import Budget, Spread
from palpate.identification.estimators.effects import effect_columns
from palpate.identification.estimators.fit import Fit, fit, relinearised
from palpate.identification.estimators.mixed import (
    Design,
    Levels,
    Solution,
    System,
    estimate,
    expanded,
    solve,
)
from palpate.identification.estimators.octaves import (
    Octaves,
    Segment,
    longest_of,
    octaves_of,
    segments_of,
)
from palpate.identification.models import Model, Motion
from palpate.identification.prior import LAG, mass_std
from palpate.identification.problem import Problem

Array = NDArray[np.float64]

_ROUNDS = 6
_RESTS = 0.02
"""Share of its deviation by which a lag may still move."""
_SEEN = 10.0
"""Power of the position over that of its noise below which an octave is left out: it would be off by a tenth."""
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
    levels, theta = None, None
    if problem.lag.std > 0 and not model.knobs:  # the lag's column needs parameters that are roughly right
        exact = replace(problem, lag=replace(problem.lag, std=0.0))
        first = _Question.of(exact, model, lag, segments, None)
        solution, levels = estimate(first.system)
        theta = dict(zip(first.names, solution.theta, strict=False))
    for _ in range(_ROUNDS):
        question = _Question.of(problem, model, lag, segments, theta)
        solution, levels = estimate(question.system, levels)
        if problem.lag.std == 0:
            break
        theta = dict(zip(question.names, solution.theta, strict=False))
        moved = theta[LAG]
        limit = 3 * problem.lag.std
        moved = float(np.clip(moved, problem.lag.value - limit, problem.lag.value + limit))
        if abs(moved - lag) < _RESTS * problem.lag.std:
            break
        lag = moved
    assert levels is not None
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
    use: NDArray[np.bool_]
    system: System

    @classmethod
    def of(
        cls,
        problem: Problem,
        model: Model,
        lag: float,
        segments: list[Segment],
        theta: dict[str, float] | None,
    ) -> _Question:
        """Linearise the model at a lag, and sum its columns by octave.

        A model without nonlinear parameters is linearised about what the mixed model had for it before, if it has been
        asked: least squares may be far off in a log with other forces, and with them the column of the lag.
        """
        motion = problem.motion
        fitted = fit(model, motion, problem.force, replace(problem.lag, value=lag, std=0.0))
        if theta is not None and not model.knobs:
            fitted = relinearised(fitted, motion, problem.force, {**theta, LAG: lag})
        free = [n for n in fitted.names if n != "offset" and (n != LAG or problem.lag.std > 0)]
        at = [fitted.names.index(n) for n in free]
        jacobian, theta = fitted.jacobian[:, at], fitted.theta[at]
        target = fitted.residuals + jacobian @ theta
        effects = effect_columns(motion, lag, segments)
        columns = np.column_stack([jacobian, *(c for own in effects.values() for c in own), target])
        places, begin = {}, len(free)
        for name, own in effects.items():
            places[name] = tuple(range(begin, begin + len(own)))
            begin += len(own)
        prior = {LAG: (problem.lag.value, problem.lag.std)} if LAG in free else {}
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        design = Design(tuple(free), prior, places)
        dt = float(np.median(np.diff(problem.time)))
        longest = longest_of(segments)
        octaves = octaves_of(columns, segments, dt, longest)
        use = _seen(motion, lag, segments, octaves)
        system = expanded(octaves.only(use), design)
        return cls(problem, fitted, tuple(free), columns, design, segments, octaves, use, system)

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
        budget["repetition"] = self._repetition(solution, levels)
        budget["unexplained"] = causes.of_unexplained(self.system, levels, solution, sensor)
        explained, left = self._explained(solution, levels, sensor)
        theta, cov = solution.theta[:p], solution.cov[:p, :p]
        fitted = self.fit
        if not fitted.model.knobs:
            values = dict(zip(self.names, theta, strict=True))
            fitted = relinearised(fitted, self.problem.motion, self.problem.force, {LAG: fitted.lag, **values})
        noise = float(sensor @ self.system.lines) / max(float(self.system.lines.sum()), 1.0)
        return Answer(self.names, theta, cov, budget, fitted, explained, left, noise)

    def _repetition(self, solution: Solution, levels: Levels) -> Spread:
        """Stretches of the log left out one after the other."""
        octaves = self.octaves.only(self.use)
        count = len(octaves.products)
        if count < 2:
            return Spread(np.zeros(self.system.parameters))
        parts = [solve(expanded(octaves.without(g), self.design), levels) for g in range(count)]
        return causes.of_stretches(solution, parts, self.system.parameters)

    def _sensor(self, levels: Levels) -> Array:
        """Variance of a line by the sensor's own noise in each octave: out of contact, else the quietest octave's."""
        gain = self.problem.motion.chain.force_gain(self.octaves.frequency) ** 2
        lines = self.octaves.all_lines
        enough = lines >= _QUIETEST
        unseen = self.octaves.total[:, -1, -1] / np.maximum(lines, 1.0)
        ratio = np.where(self.use, levels.noise, unseen) / np.maximum(gain, 1e-12)
        floor = float(ratio[enough].min()) if enough.any() else float(ratio.min())
        sensor = floor * gain
        free, longest = self.problem.free, longest_of(self.segments)
        if free:
            edges = np.cumsum([0, *(len(f) for f in free)])
            rest = octaves_of(
                np.concatenate(free)[:, None], [Segment(int(a), int(b)) for a, b in pairwise(edges)], self.dt, longest
            )
            seen = rest.all_lines >= 2
            sensor[seen] = np.maximum(rest.total[seen, 0, 0] / rest.all_lines[seen], sensor[seen])
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


def _seen(
    motion: Motion, lag: float, segments: list[Segment], octaves: Octaves
) -> NDArray[np.bool_]:
    """Octaves up to the first in which the position is mostly its own noise, which pulls every parameter to zero."""
    chain = motion.chain
    dt = float(np.median(np.diff(chain.times(motion.rows))))
    moved = octaves_of(motion.moved(0, lag)[:, None], segments, dt, longest_of(segments))
    line = motion.noise.power(octaves.frequency, chain.dt) * chain.position_gain(octaves.frequency) ** 2
    noise = moved.all_lines * line * chain.dt / dt
    return np.logical_and.accumulate(moved.total[:, 0, 0] >= _SEEN * noise)
