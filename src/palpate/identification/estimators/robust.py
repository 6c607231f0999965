"""A model's parameters and how far each may be off, whatever else is in the log.

The model is linearised; its columns are weighted by octave beside columns of other forces, and the budget says what
each cause may do. The lag of the force is a column with a prior, never a free number; the columns are formed again at
the lag found until it rests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import Budget, Spread
from palpate.identification.estimators.by_octave import Solution, System, estimate, system_of
from palpate.identification.estimators.effects import FRICTION, effect_columns
from palpate.identification.estimators.fit import Fit, fit, relinearised
from palpate.identification.estimators.octaves import Octaves, Segment, longest_of, octaves_of, segments_of
from palpate.identification.models import Model, Motion
from palpate.identification.prior import LAG, mass_std
from palpate.identification.problem import Problem

Array = NDArray[np.float64]

_ROUNDS = 6
_RESTS = 0.02
"""Share of its deviation by which a lag may still move."""
_SEEN = 10.0
"""Power of the position over that of its noise below which an octave is left out: it would be off by a tenth."""
_ROUNDED = 100.0
"""Last digits of a position that its way through the filters may round."""
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
        """Half-width of one parameter by cause, largest first; their squares add up to that of the whole."""
        i = self.names.index(name)
        total = sum(float(part.variance[i]) for part in self.budget.values()) or 1.0
        whole = float(self.half[i])
        found = {
            cause: whole * float(np.sqrt(part.variance[i] / total)) for cause, part in self.budget.items()
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
    theta = None
    if problem.lag.std > 0 and not model.knobs:  # the lag's column needs parameters that are roughly right
        exact = replace(problem, lag=replace(problem.lag, std=0.0))
        first = _Question.of(exact, model, lag, segments, None)
        solution = estimate(first.system)
        theta = dict(zip(first.names, solution.theta, strict=False))
    for _ in range(_ROUNDS):
        question = _Question.of(problem, model, lag, segments, theta)
        solution = estimate(question.system)
        if problem.lag.std == 0:
            break
        theta = dict(zip(question.names, solution.theta, strict=False))
        moved = theta[LAG]
        limit = 3 * problem.lag.std
        moved = float(np.clip(moved, problem.lag.value - limit, problem.lag.value + limit))
        if abs(moved - lag) < _RESTS * problem.lag.std:
            break
        lag = moved
    return question.answered(solution)


def lag_open(problem: Problem) -> bool:
    """Whether neither a calibration nor the sensor's own low-pass tells the lag."""
    return not problem.lag.known and not problem.motion.matched


@dataclass(frozen=True)
class _Question:
    problem: Problem
    fit: Fit
    names: tuple[str, ...]
    own: int
    prior: dict[str, tuple[float, float]]
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

        A model without nonlinear parameters is linearised about what was found for it before, if anything was: least
        squares may be far off in a log with other forces, and with them the column of the lag.
        """
        motion = problem.motion
        fitted = fit(model, motion, problem.force, replace(problem.lag, value=lag, std=0.0))
        if theta is not None and not model.knobs:
            fitted = relinearised(fitted, motion, problem.force, {**theta, LAG: lag})
        free = [n for n in fitted.names if n != "offset" and (n != LAG or problem.lag.std > 0)]
        at = [fitted.names.index(n) for n in free]
        jacobian, values = fitted.jacobian[:, at], fitted.theta[at]
        effects = effect_columns(motion, model, lag, segments)
        target = fitted.residuals + jacobian @ values
        position = motion.moved(0, lag)
        columns = np.column_stack([jacobian, *effects.values(), target, position])
        prior = {LAG: (problem.lag.value, problem.lag.std)} if LAG in free else {}
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        dt = float(np.median(np.diff(problem.time)))
        whole = octaves_of(columns, segments, dt, longest_of(segments))
        octaves = Octaves(whole.products[:, :, :-1, :-1], whole.lines, whole.frequency)
        use = _seen(motion, dt, whole)
        names = (*free, *effects)
        system = system_of(octaves.only(use), names, prior)
        return cls(problem, fitted, names, len(free), prior, segments, octaves, use, system)

    @property
    def dt(self) -> float:
        """From row to row [s]."""
        return float(np.median(np.diff(self.problem.time)))

    def answered(self, solution: Solution) -> Answer:
        """The answer with its budget."""
        sensor = self._sensor(solution)
        budget = causes.of_noise(self.system, solution, self.names, self.own, LAG)
        budget["octaves"] = causes.of_octaves(self.system, solution)
        budget["repetition"] = causes.of_stretches(self.system, solution)
        budget["unexplained"] = causes.of_unexplained(self.system, solution, sensor)
        explained, left = self._explained(solution, sensor)
        if lag_open(self.problem) and {"K", "B", LAG} <= set(self.names):
            budget["lag"] = self._lag_of_damping(solution, budget["lag"])
        kept = [i for i, name in enumerate(self.names) if i < self.own or name == FRICTION]
        names = tuple(self.names[i] for i in kept)
        budget = {cause: Spread(part.variance[kept], part.freedom) for cause, part in budget.items()}
        fitted = self.fit
        if not fitted.model.knobs:
            values = {n: v for n, v in zip(self.names, solution.theta, strict=True) if n in fitted.names}
            fitted = relinearised(
                fitted, self.problem.motion, self.problem.force, {LAG: fitted.lag, **values}
            )
        noise = float(sensor @ self.system.lines) / max(float(self.system.lines.sum()), 1.0)
        cov = solution.cov[np.ix_(kept, kept)]
        return Answer(names, solution.theta[kept], cov, budget, fitted, explained, left, noise)

    def _lag_of_damping(self, solution: Solution, found: Spread) -> Spread:
        """A lag T counts as a damping of -K T: B knows of a lag nobody has calibrated what the prior says, no more.

        Whatever else shifts the force in time moves the lag that a fit finds, and B with it.
        """
        variance = found.variance.copy()
        i = self.names.index("B")
        by_prior = (solution.theta[self.names.index("K")] * self.problem.lag.std) ** 2
        variance[i] = max(variance[i], by_prior)
        return Spread(variance, found.freedom)

    def _sensor(self, solution: Solution) -> Array:
        """Variance of a line by the sensor's own noise in each octave: out of contact, else the quietest octave's."""
        gain = self.problem.motion.chain.force_gain(self.octaves.frequency) ** 2
        lines = self.octaves.all_lines
        enough = lines >= _QUIETEST
        unseen = self.octaves.total[:, -1, -1] / np.maximum(lines, 1.0)
        ratio = np.where(self.use, solution.noise, unseen) / np.maximum(gain, 1e-12)
        floor = float(ratio[enough].min()) if enough.any() else float(ratio.min())
        sensor = floor * gain
        free, longest = self.problem.free, longest_of(self.segments)
        if free:
            edges = np.cumsum([0, *(len(f) for f in free)])
            rest = octaves_of(
                np.concatenate(free)[:, None],
                [Segment(int(a), int(b)) for a, b in pairwise(edges)],
                self.dt,
                longest,
            )
            seen = rest.all_lines >= 2
            sensor[seen] = np.maximum(rest.total[seen, 0, 0] / rest.all_lines[seen], sensor[seen])
        return np.minimum(sensor, solution.noise)

    def _explained(self, solution: Solution, sensor: Array) -> tuple[float, float]:
        """Share of the force's variance in contact that the model's own columns account for, noise left aside."""
        total = self.system.products.sum(axis=0)
        full = np.zeros(total.shape[0])
        full[: self.own], full[-1] = -solution.theta[: self.own], 1.0
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


def _seen(motion: Motion, dt: float, octaves: Octaves) -> NDArray[np.bool_]:
    """Octaves up to the first in which the position is mostly its own noise, which pulls every parameter to zero.

    The position is the last of the columns.
    """
    chain = motion.chain
    line = motion.noise.power(octaves.frequency, chain.dt) * chain.position_gain(octaves.frequency) ** 2
    rounding = (_ROUNDED * np.finfo(float).eps * float(np.abs(motion.position).max())) ** 2
    noise = octaves.all_lines * np.maximum(line * chain.dt / dt, rounding)
    return np.logical_and.accumulate(octaves.total[:, -1, -1] >= _SEEN * noise)
