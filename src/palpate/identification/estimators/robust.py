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
from palpate.identification.estimators.by_octave import Solution, System, estimate, system_of, worth
from palpate.identification.estimators.effects import FRICTION, TOUCH, effect_columns
from palpate.identification.estimators.fit import Prediction, fit, slope_of_lag
from palpate.identification.estimators.octaves import (
    Octaves,
    Segment,
    longest_of,
    octaves_of,
    segments_of,
    white_lines,
)
from palpate.identification.models import Model, Motion, from_surface
from palpate.identification.prior import LAG, mass_std
from palpate.identification.problem import Problem

Array = NDArray[np.float64]

_ROUNDS = 6
_RESTS = 0.02
"""Share of its prior's deviation by which a lag may still move."""
_FOUND = 0.25
"""Share of its deviation by which a surface may still move: it adds a sixteenth to the variance."""
_SEEN = 10.0
"""Power of the position over that of its noise below which an octave is left out: it would be off by a tenth."""
_ROUNDED = 100.0
"""Last digits of a position that its way through the filters may round."""


@dataclass(frozen=True)
class Answer:
    """The parameters of a model.

    Args:
        names: of the parameters, the lag last if it is not known exactly.
        theta: shape (p,).
        cov: of the mixed model, shape (p, p).
        budget: by cause.
        fit: what the model predicts with them.
        explained: share of the force's variance in contact that the model alone accounts for.
        unexplained: rms of what is left beyond the sensor's noise [N].
        sensor: mean square of the sensor's own noise [N^2].
        problem: the rows that it was fitted to.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    budget: Budget
    fit: Prediction
    explained: float
    unexplained: float
    sensor: float
    problem: Problem

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
    question, solution = _in_contact(problem, model)
    plain = question.answered(solution)
    wider = None if model.nonlinear else problem.with_approach
    found = None if wider is None else _over_approach(wider, problem.in_contact, question, solution)
    if found is None:
        return plain
    found = replace(
        found,
        budget={
            **found.budget,
            "touch": causes.of_another(found.theta, found.budget, plain.theta, plain.budget),
        },
    )
    return found if found.half_of("K") < plain.half_of("K") else plain


def _in_contact(problem: Problem, model: Model) -> tuple[_Question, Solution]:
    """Over the rows in contact; the lag looked for within its prior, the columns formed again at each."""
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        raise InputError("every stretch in contact is too short; log longer or faster")
    lag, theta = problem.lag.value, None
    if problem.lag.std > 0 and not model.nonlinear:  # its column needs parameters that are roughly right
        exact = replace(problem, lag=replace(problem.lag, std=0.0))
        first = _Question.of(exact, model, lag, segments, None)
        theta = dict(zip(first.names, estimate(first.system).theta, strict=True))
    for _ in range(_ROUNDS):
        question = _Question.of(problem, model, lag, segments, theta)
        solution = estimate(question.system)
        if problem.lag.std == 0:
            break
        theta = dict(zip(question.names, solution.theta, strict=True))
        reach = 3 * problem.lag.std
        moved = float(np.clip(theta[LAG], problem.lag.value - reach, problem.lag.value + reach))
        if abs(moved - lag) < _RESTS * problem.lag.std:
            break
        lag = moved
    return question, solution


def _over_approach(
    problem: Problem, inside: NDArray[np.bool_], known: _Question, found: Solution
) -> Answer | None:
    """Over the approach too: how the force rises from nothing tells most of a press that then rests.

    The surface is looked for: what a wrong place of it does is a force that is there at once with the touch.

    Args:
        problem: with the rows of the approach.
        inside: samples of the position that are in contact.
        known: the question of the rows in contact.
        found: its answer.

    Returns:
        None if the surface is not found.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    at = problem.motion.instants.astype(np.intp)
    way = problem.motion.position[at[~inside[at]]]  # in which the surface lies
    theta = dict(zip(known.names, found.theta, strict=True))
    surface = 0.0
    for _ in range(_ROUNDS if len(way) else 0):
        motion = from_surface(problem.motion, inside, surface)
        question = _Question.of(replace(problem, motion=motion), known.model, known.lag, segments, theta)
        solution = estimate(question.system)
        theta = dict(zip(question.names, solution.theta, strict=True))
        i = question.names.index(TOUCH)
        if theta["K"] <= 0:
            return None
        if theta[TOUCH] ** 2 < _FOUND**2 * solution.cov[i, i]:
            return question.answered(solution)
        step = -theta[TOUCH] / theta["K"]
        surface += float(np.clip(step, (way.min() - surface) / 2, (way.max() - surface) / 2))
    return None


def lag_open(problem: Problem) -> bool:
    """Whether neither a calibration nor the sensor's own low-pass tells the lag."""
    return not problem.lag.known and not problem.motion.matched


@dataclass(frozen=True)
class _Question:
    problem: Problem
    model: Model
    lag: float
    at: dict[str, float]
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

        Args:
            problem: of the log.
            model: which.
            lag: of the force [s].
            segments: rows without a gap.
            theta: parameters about which a model that is linear in them is linearised in the lag.
        """
        motion = problem.motion
        at, own, target = _linearised(problem, model, lag, theta or {})
        free = list(own)
        effects = effect_columns(motion, model, lag, segments)
        columns = [*own.values(), *effects.values(), target, motion.moved(0, lag)]
        prior = {LAG: (problem.lag.value, problem.lag.std)} if LAG in free else {}
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        dt = float(np.median(np.diff(problem.time)))
        whole = octaves_of(np.column_stack(columns), segments, dt, longest_of(segments))
        octaves = Octaves(whole.products[:, :, :-1, :-1], whole.lines, whole.frequency)
        use = _seen(motion, dt, whole)
        names = (*free, *effects)
        system = system_of(octaves.only(use), names, prior)
        return cls(problem, model, lag, at, names, len(free), prior, segments, octaves, use, system)

    @property
    def dt(self) -> float:
        """From row to row [s]."""
        return float(np.median(np.diff(self.problem.time)))

    def answered(self, solution: Solution) -> Answer:
        """The answer with its budget."""
        sensor, told = self._sensor(solution)
        budget = causes.of_noise(self.system, solution, self.names, self.own, LAG)
        budget["position noise"] = causes.of_position_noise(self.system, solution, self._position_noise())
        budget["octaves"] = causes.of_octaves(self.system, solution)
        budget["repetition"] = causes.of_stretches(self.system, solution)
        sensors = np.minimum(sensor + self._by_position(solution), solution.noise)
        budget["unexplained"] = causes.of_unexplained(self.system, solution, sensors, told)
        explained, left = self._explained(solution, sensor)
        if lag_open(self.problem) and {"K", "B", LAG} <= set(self.names):
            budget["lag"] = self._lag_of_damping(solution, budget["lag"])
        kept = [i for i, name in enumerate(self.names) if i < self.own or name == FRICTION]
        names = tuple(self.names[i] for i in kept)
        budget = {cause: Spread(part.variance[kept], part.freedom) for cause, part in budget.items()}
        values = self.at or dict(zip(self.names, solution.theta.tolist(), strict=True))
        predicted = Prediction.of(self.model, self.problem.motion, self.problem.force, values, self.lag)
        noise = float(sensor @ self.system.lines) / max(float(self.system.lines.sum()), 1.0)
        cov = solution.cov[np.ix_(kept, kept)]
        return Answer(
            names, solution.theta[kept], cov, budget, predicted, explained, left, noise, self.problem
        )

    def _line(self) -> Array:
        """Power of the position's noise in a line of each octave, shape (octaves,)."""
        motion = self.problem.motion
        return _line_of_noise(motion, self.octaves.frequency) * motion.chain.dt / self.dt

    def _by_position(self, solution: Solution) -> Array:
        """Variance of a line by what the model makes of the position's noise in each octave, shape (octaves,)."""
        if self.model.nonlinear:
            return np.zeros(len(self.octaves.frequency))
        omega = 2j * np.pi * self.octaves.frequency
        own = dict(zip(self.names, solution.theta.tolist(), strict=True))
        stiffness = sum(own[name] * omega**i for name, i in self.model.derivatives.items())
        found: Array = np.abs(stiffness) ** 2 * self._line()
        return found

    def _position_noise(self) -> Array:
        """Products of what noise of the position makes of the columns by octave, shape (octaves, p, p)."""
        frequency = self.octaves.frequency
        power = self._line() * self.system.lines
        found = np.zeros((len(frequency), len(self.names), len(self.names)))
        own = self.model.derivatives if not self.model.nonlinear else {}
        for a, i in own.items():
            for b, j in own.items():
                if (i + j) % 2 == 0:  # the others are in quadrature
                    at = self.names.index(a), self.names.index(b)
                    found[:, *at] = power * (2 * np.pi * frequency) ** (i + j) * (-1) ** ((i - j) // 2)
        return found

    def _lag_of_damping(self, solution: Solution, found: Spread) -> Spread:
        """A lag T counts as a damping of -K T: B knows of a lag nobody has calibrated what the prior says, no more.

        Whatever else shifts the force in time moves the lag that a fit finds, and B with it.
        """
        variance = found.variance.copy()
        i = self.names.index("B")
        by_prior = (solution.theta[self.names.index("K")] * self.problem.lag.std) ** 2
        variance[i] = max(variance[i], by_prior)
        return Spread(variance, found.freedom)

    def _sensor(self, solution: Solution) -> tuple[Array, Array]:
        """Variance of a line by the sensor's own noise in each octave, and the lines that tell it, shape (octaves,).

        Out of contact it is seen; where the log has no such stretch, it is what the quietest octaves have in common.
        """
        longest = longest_of(self.segments)
        gain = white_lines(self.problem.motion.chain.force_gain, self.dt, longest, self.octaves)
        rest = self._rest(longest)
        if rest is None:
            own = self.octaves.total[:, -1, -1] / np.maximum(self.octaves.all_lines, 1.0)
            level = np.where(self.use, solution.noise, own)
            lines = np.where(self.use, worth(self.system), self.octaves.all_lines)
        else:
            lines = rest.all_lines
            level = rest.total[:, 0, 0] / np.maximum(lines, 1.0)
        sensor = causes.white_level(level / gain, lines) * gain
        told = np.full(len(sensor), float(lines.sum()))
        if rest is not None:
            louder = (lines > 0) & (level > sensor)
            sensor, told = np.where(louder, level, sensor), np.where(louder, lines, told)
        return np.minimum(sensor, solution.noise), told

    def _rest(self, longest: int) -> Octaves | None:
        """The force out of contact by the octaves of the contacts; None if there is too little of it."""
        if not self.problem.free:
            return None
        edges = np.cumsum([0, *(len(f) for f in self.problem.free)])
        stretches = [Segment(int(a), int(b)) for a, b in pairwise(edges)]
        found = octaves_of(np.concatenate(self.problem.free)[:, None], stretches, self.dt, longest)
        return found if found.lines.any() else None

    def _explained(self, solution: Solution, sensor: Array) -> tuple[float, float]:
        """Share of the force's variance in contact that the model's own columns account for, noise left aside."""
        total = self.system.products.sum(axis=0)
        full = np.zeros(total.shape[0])
        full[: self.own], full[-1] = -solution.theta[: self.own], 1.0
        offset = np.zeros_like(full)
        offset[-1] = 1.0
        if LAG in self.names:  # the target counts the lag from zero
            at = self.names.index(LAG)
            offset[at] = -self.lag
        noise = float(sensor @ self.system.lines)
        left = max(float(full @ total @ full) - noise, 0.0)
        whole = max(float(offset @ total @ offset) - noise, 1e-300)
        count = max(float(self.system.lines.sum()), 1.0)
        return 1 - left / whole, float(np.sqrt(left / count))


def _linearised(
    problem: Problem, model: Model, lag: float, theta: dict[str, float]
) -> tuple[dict[str, float], dict[str, Array], Array]:
    """Where a nonlinear model is linearised, the columns of the parameters, and the force that they add up to.

    The lag is among the parameters unless it is exact.
    """
    motion, asks = problem.motion, problem.lag.std > 0
    if not model.nonlinear:
        named = zip(model.linear, model.columns(motion, {}, lag), strict=True)
        own = {name: column for name, column in named if name != "offset"}
        if not asks:
            return {}, own, problem.force
        slope = slope_of_lag(model, motion, theta, lag)
        return {}, {**own, LAG: slope}, problem.force + slope * lag
    fitted = fit(model, motion, problem.force, replace(problem.lag, value=lag, std=0.0))
    free = [n for n in fitted.names if n != "offset" and (n != LAG or asks)]
    jacobian = fitted.jacobian[:, [fitted.names.index(n) for n in free]]
    target = fitted.residuals + jacobian @ np.array([fitted[n] for n in free])
    at = dict(zip(fitted.names, fitted.theta.tolist(), strict=True))
    return at, dict(zip(free, jacobian.T, strict=True)), target


def _line_of_noise(motion: Motion, frequency: Array) -> Array:
    """Power of the filtered position's noise in a line at frequencies [Hz]."""
    line: Array = motion.noise.power(frequency, motion.chain.dt) * motion.chain.position_gain(frequency) ** 2
    return line


def _seen(motion: Motion, dt: float, octaves: Octaves) -> NDArray[np.bool_]:
    """Octaves up to the first in which the position is mostly its own noise, which pulls every parameter to zero.

    The position is the last of the columns.
    """
    line, chain = _line_of_noise(motion, octaves.frequency), motion.chain
    rounding = (_ROUNDED * np.finfo(float).eps * float(np.abs(motion.position).max())) ** 2
    noise = octaves.all_lines * np.maximum(line * chain.dt / dt, rounding)
    return np.logical_and.accumulate(octaves.total[:, -1, -1] >= _SEEN * noise)
