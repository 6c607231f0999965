"""A model made linear about some parameters and a lag, and its columns summed by octave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification import averaging
from palpate.identification import budget as causes
from palpate.identification.budget import Budget, FittedParameters, Prediction, Spread
from palpate.identification.descent import Descent, slope_of_lag
from palpate.identification.least_squares import inverse
from palpate.identification.models import Model
from palpate.identification.octaves import (
    MAX_TERM_RATIO,
    Octaves,
    Segment,
    Solution,
    System,
    build_system,
    longest_length,
    sum_octaves,
)
from palpate.identification.options import LAG, mass_std
from palpate.identification.problem import Problem
from palpate.signals.types import NORMAL


def lag_open(problem: Problem) -> bool:
    """True if neither a calibration nor the sensor's low-pass gives the lag."""
    return not problem.lag.known and not problem.motion.matched


@dataclass(frozen=True)
class Linearisation:
    """A model of a log, linear about some parameters and a lag.

    Args:
        problem: of the log.
        model: which.
        lag: of the force that its columns are formed at [s].
        at: its parameters that they are formed about; none for a model that is linear in all of them.
        about: parameters that the column of the lag is formed with, by name.
        names: of the parameters: the model's own, then those of other forces.
        friction: columns of those that are friction, shape (m, f).
        own: how many are the model's.
        prior: mean and deviation of what is known of some of them.
        octaves: sums of the columns with each other; the force that they add up to is the last.
        use: octaves that count, shape (octaves,).
        noisy: of the position's noise, power of derivative k / 2 in a line of each octave, shape (octaves,), by k.
        system: the normal equations of those.
    """

    problem: Problem
    model: Model
    lag: float
    at: dict[str, float]
    about: dict[str, float]
    names: tuple[str, ...]
    friction: Array
    own: int
    prior: dict[str, tuple[float, float]]
    octaves: Octaves
    use: Mask
    noisy: dict[int, Array]
    system: System

    @classmethod
    def of(
        cls,
        problem: Problem,
        model: Model,
        theta: dict[str, float],
        use: Mask | None = None,
    ) -> Linearisation:
        """Linearise a model about some parameters, and sum its columns by octave.

        Parameters may include those of other forces, and the lag. Missing ones are searched (where the force is not
        linear in them), zero (the others), or the prior's value (the lag). `use` gives the octaves that count, shape
        (octaves,), if likelihoods are compared; None for the octaves in which the columns are more than noise.
        """
        motion = problem.motion
        segments = problem.segments
        dt = problem.period
        lag = theta.get(LAG, problem.lag.value)
        at, model_columns, target = _linearise(problem, model, lag, theta)
        free = list(model_columns)
        effects = causes.effect_columns(motion, model, lag, segments)
        removed = _removed_columns(problem, lag)
        if LAG in model_columns:
            effect_slopes = _moved_by_lag(effects, theta, segments, dt)
            model_columns = model_columns | {LAG: model_columns[LAG] + effect_slopes}
            target = target + effect_slopes * lag
        named = model_columns | effects | removed
        columns = np.column_stack([*named.values(), target, motion.moved(0, lag)])
        prior = dict.fromkeys(removed, (0.0, 1.0))
        if LAG in free:
            prior[LAG] = (problem.lag.value, problem.lag.std)
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        longest = longest_length(segments)
        all_sums = sum_octaves(columns, segments, dt, longest)
        octaves = Octaves(all_sums.products[:, :, :-1, :-1], all_sums.lines, all_sums.frequency)
        orders = model.derivatives if not model.nonlinear else {}
        highest_order = max(orders.values(), default=0) + (LAG in free)
        count = len(octaves.frequency)
        noisy = averaging.position_noise_lines(motion, dt, longest, count, highest_order)
        if use is None:
            derivatives = {-1: 0} | {free.index(name): k for name, k in orders.items()}
            use = averaging.motion_octaves(motion, noisy, all_sums, derivatives)
        names = tuple(named)
        friction_columns = [column for name, column in effects.items() if name.startswith(causes.FRICTION)]
        friction = np.column_stack(friction_columns)
        system = build_system(octaves.only(use), names, prior)
        return cls(
            problem,
            model,
            lag,
            at,
            theta,
            names,
            friction,
            len(free),
            prior,
            octaves,
            use,
            noisy,
            system,
        )

    @property
    def searched(self) -> dict[int, float]:
        """Values of the nonlinear parameters and the lag at which the columns are formed, by place."""
        values = {parameter.name: self.at[parameter.name] for parameter in self.model.nonlinear}
        values[LAG] = self.lag
        return {self.names.index(name): value for name, value in values.items() if name in self.names}

    def moved(self, theta: Array, step: Array) -> dict[str, float]:
        """Parameters, shape (p,), after a step of the searched ones, shape (s,), within their limits."""
        values = dict(zip(self.names, theta.tolist(), strict=True))
        lag = self.problem.lag
        limits = {LAG: (lag.value - 3 * lag.std, lag.value + 3 * lag.std)}
        limits |= {p.name: (p.low, p.high) for p in self.model.nonlinear}
        for place, change in zip(self.searched, step.tolist(), strict=True):
            name = self.names[place]
            low, high = limits[name]
            lower = max(low, values[name] / 3) if low > 0 else low
            values[name] = float(np.clip(values[name] + change, lower, high))
        return values

    def misfit(self, solution: Solution) -> float:
        """-2 log of the likelihood, but for a constant, by a solution's noise levels and the prior of the lag.

        The solution has the searched parameters fixed.
        """
        present = self.system.lines > 0
        noise = solution.noise[present]
        lag = self.problem.lag
        prior = ((self.lag - lag.value) / lag.std) ** 2 if lag.std > 0 else 0.0
        return float(self.system.lines[present] @ np.log(noise)) + prior

    def answer(self, solution: Solution) -> FittedParameters:
        """The answer with its budget."""
        lines = self.octaves, self.use, self.system
        sensor, sensor_line_count = averaging.sensor_lines(self.problem, *lines, solution)
        noise_lines = self._with_position(solution, sensor)
        explained, unexplained, hidden = self._explained_part(solution, noise_lines)
        noise_model = self.system, solution.noise, noise_lines, self._forces()
        hypotheses = averaging.members(*noise_model)
        solution = averaging.average_members(hypotheses)
        budgets = [self._budget(hypothesis, sensor, sensor_line_count) for hypothesis in hypotheses]
        budget = averaging.average_budgets(hypotheses, budgets, solution.theta)
        budget["octaves"] = averaging.octave_spread(solution, *noise_model)
        if "M" in self.names and "M" not in self.prior:
            place = self.names.index("M")
            prior_variance = averaging.supposition_variance(solution, hypotheses, self.system, place)
            budget["other forces"].variance[place] += prior_variance
            if self.problem.filtered is None:
                budget["low-pass"] = self._by_low_pass(solution)
        reported = [i for i, name in enumerate(self.names) if i < self.own or name == causes.FRICTION]
        names = tuple(self.names[i] for i in reported)
        budget = {cause: spread.of(reported) for cause, spread in budget.items()}
        values = self.at or dict(zip(self.names, solution.theta.tolist(), strict=True))
        predicted = Prediction.of(self.model, self.problem.motion, self.problem.force, values, self.lag)
        count = max(float(self.system.lines.sum()), 1.0)
        noise = float(noise_lines @ self.system.lines) / count
        cov = solution.cov[np.ix_(reported, reported)]
        return FittedParameters(
            names,
            solution.theta[reported],
            cov,
            budget,
            predicted,
            explained,
            unexplained,
            hidden,
            noise,
            self._friction(solution),
            self.problem,
        )

    def _friction(self, solution: Solution) -> Array:
        """Forces whose squares add up to the mean square of the friction, its uncertainty included, shape (m, f)."""
        places = [i for i, name in enumerate(self.names) if name.startswith(causes.FRICTION)]
        theta = solution.theta[places]
        square = solution.cov[np.ix_(places, places)] + np.outer(theta, theta)
        value, vector = np.linalg.eigh(square)
        friction = self.friction @ (vector * np.sqrt(np.maximum(value, 0.0)))
        # The only bound of a column that no octave shows.
        largest = MAX_TERM_RATIO * np.std(self.problem.force)
        size = np.maximum(np.abs(friction).max(axis=0), 1e-300)
        return np.asarray(friction * np.minimum(1.0, largest / size))

    def _forces(self) -> list[list[int]]:
        """Places of the columns of each force that may be absent, and of a mass without a prior."""
        others = list(enumerate(self.names))[self.own :]
        kinds = causes.FRICTION, "depth", "hysteresis"
        groups = [[place for place, name in others if name.startswith(kind)] for kind in kinds]
        if "M" in self.names and "M" not in self.prior:
            groups.append([self.names.index("M")])
        return [places for places in groups if places]

    def _budget(self, member: averaging.Member, sensor: Array, sensor_line_count: Array) -> Budget:
        """Budget by cause, under one hypothesis."""
        system = member.system
        solution = member.solution
        budget = causes.noise_budget(system, solution, self.names, self.own, LAG)
        budget["position noise"] = causes.position_noise_spread(system, solution, self._position_noise())
        budget["repetition"] = causes.stretch_spread(system, solution)
        noise_lines = self._with_position(solution, sensor)
        budget["unexplained"] = causes.unexplained_spread(system, solution, noise_lines, sensor_line_count)
        if lag_open(self.problem) and LAG in self.names:
            budget["lag"] = self._by_prior_of_lag(member, budget["lag"])
        return budget

    def _by_low_pass(self, solution: Solution) -> Spread:
        """Bound of the mass that an unknown low-pass adds: K T^2/2, where T is the lag, or a radian of the motion.

        The logarithm of a low-pass' response is -T s + C s^2/2 - ... with a second cumulant C from 0 to T^2, and
        K C s^2/2 looks like a mass.
        """
        time = min(float(np.hypot(self.lag, self.problem.lag.std)), self._radian())
        largest = abs(solution.theta[self.names.index("K")]) / 2 * time**2
        return Spread((largest / NORMAL * np.equal(self.names, "M")) ** 2)

    def _radian(self) -> float:
        """Time of a radian of the fastest motion [s]: a longer lag is confused with a damping alone."""
        band = self.problem.band
        return 1 / (2 * np.pi * band) if np.isfinite(band) else np.inf

    def _with_position(self, solution: Solution, sensor: Array) -> Array:
        """Variance of a line by the noise of both channels, shape (octaves,)."""
        position_theta = solution.theta * [name in self.model.derivatives for name in self.names]
        by_position = np.einsum("i,oij,j->o", position_theta, self._position_noise(), position_theta)
        noise_lines = sensor + by_position / np.maximum(self.system.lines, 1.0)
        return np.asarray(np.minimum(noise_lines, solution.noise))

    def _position_noise(self) -> Array:
        """Products of the columns' noise by the position's, by octave, shape (octaves, p, p).

        The column of the lag has the next derivatives, so its noise is that of the damping's column.
        """
        derivative_weights = np.zeros((len(self.names), 1 + max(self.noisy) // 2))  # in each column
        orders = {} if self.model.nonlinear else self.model.derivatives
        for name, order in orders.items():
            place = self.names.index(name)
            derivative_weights[place, order] = 1.0
            if LAG in self.names:
                derivative_weights[self.names.index(LAG), order + 1] = -self.about.get(name, 0.0)
        products = averaging.derivative_products(self.noisy)
        noise_products = np.einsum("ai,oij,bj->oab", derivative_weights, products, derivative_weights)
        return noise_products * self.system.lines[:, None, None]

    def _by_prior_of_lag(self, member: averaging.Member, lag_spread: Spread) -> Spread:
        """Uncertainty by an uncalibrated lag, at least that of its prior, for parameters that a time shift changes.

        A lag T looks like a damping of -K T, and like relaxation. Any other time shift of the force changes the fitted
        lag and these parameters. So the lag may be anywhere in its prior, and as far from the prior's mean as the fit
        has it; except for the damping, no farther than a radian of the fastest motion.
        """
        lag = self.names.index(LAG)
        others = [place for place in range(len(self.names)) if place != lag]
        normal = inverse(member.solution.cov)
        slope = np.zeros(len(self.names))
        slope[others] = inverse(normal[np.ix_(others, others)]) @ normal[others, lag]
        change = abs(float(member.solution.theta[lag]) - self.problem.lag.value)
        std = max(self.problem.lag.std, change)
        in_time = self.names[: self.own] if self.model.nonlinear else ("M",)
        reach = dict.fromkeys(in_time, min(std, self._radian()))
        reach |= {"B": std, LAG: 0.0}
        by_prior = (slope * [reach.get(name, 0.0) for name in self.names]) ** 2
        return Spread(np.maximum(lag_spread.variance, by_prior), lag_spread.freedom)

    def _explained_part(self, solution: Solution, sensor: Array) -> tuple[float, float, float]:
        """Fraction of the force's variance in contact that the model's own columns explain, without noise.

        Returns:
            That fraction; the rms residual [N]; the fraction of the amplitude that the other forces do not explain
            either.
        """
        total = self.system.products.sum(axis=0)
        model_residual = np.zeros(total.shape[0])
        model_residual[: self.own] = -solution.theta[: self.own]
        model_residual[-1] = 1.0
        offset = np.zeros_like(model_residual)
        offset[-1] = 1.0
        if LAG in self.names:  # the target counts the lag from zero
            offset[self.names.index(LAG)] = -self.lag
        noise = float(sensor @ self.system.lines)
        remaining = max(float(model_residual @ total @ model_residual) - noise, 0.0)
        total_power = max(float(offset @ total @ offset) - noise, 1e-300)
        count = max(float(self.system.lines.sum()), 1.0)
        excess = float(np.maximum(solution.noise - sensor, 0.0) @ self.system.lines)
        return (
            1 - remaining / total_power,
            float(np.sqrt(remaining / count)),
            float(np.sqrt(excess / total_power)),
        )


def _linearise(
    problem: Problem, model: Model, lag: float, theta: dict[str, float]
) -> tuple[dict[str, float], dict[str, Array], Array]:
    """Return the point of linearisation, the columns of the parameters, and the force that they add up to.

    The lag is among the parameters unless it is exact.
    """
    motion = problem.motion
    asks = problem.lag.std > 0
    if not model.nonlinear:
        named = zip(model.linear, model.columns(motion, {}, lag), strict=True)
        own = {name: column for name, column in named if name != "offset"}
        if not asks:
            return {}, own, problem.force
        slope = slope_of_lag(model, motion, theta, lag)
        return {}, {**own, LAG: slope}, problem.force + slope * lag
    given = {p.name: theta[p.name] for p in model.nonlinear if p.name in theta}
    descent = Descent(model, motion, problem.force, lag)
    known = len(given) == len(model.nonlinear)
    point = descent.at(given) if known else descent.from_point(descent.best_start())
    at, jacobian = descent.about(point)
    free = {name: i for i, name in enumerate(at) if name != "offset" and (name != LAG or asks)}
    own = {name: jacobian[:, i] for name, i in free.items()}
    return at, own, point.residuals + jacobian[:, list(free.values())] @ [at[name] for name in free]


def _moved_by_lag(
    effects: dict[str, Array], theta: dict[str, float], segments: list[Segment], dt: float
) -> Array:
    """Derivative of the other forces by the lag [N/s], shape (m,); they have the lag of the contact force."""
    force = np.column_stack(list(effects.values())) @ [theta.get(name, 0.0) for name in effects]
    derivative = np.zeros(len(force))
    for segment in segments:
        derivative[segment.rows] = -np.gradient(force[segment.rows], dt)
    return derivative


def _removed_columns(problem: Problem, lag: float) -> dict[str, Array]:
    """Remains that a removed drift, leak or ripple may leave, each of standard deviation 1, by name."""
    drift, ripple, leak = problem.contacts.drift, problem.contacts.ripple, problem.contacts.leak
    modes = drift.bends(problem.time).T if drift is not None else ()
    columns = {f"drift {i}": column for i, column in enumerate(modes)}
    if leak is not None:
        columns["leak"] = leak.column(problem.time)
    if ripple is not None:
        waves = ripple.std * ripple.columns(problem.time, problem.motion.moved(0, lag))
        columns |= {f"ripple {i}": column for i, column in enumerate(waves)}
    return columns
