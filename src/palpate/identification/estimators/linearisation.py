"""A model made linear about some parameters and a lag, and its columns summed by octave."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.estimators import averaging
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import Answer, Budget, Prediction, Spread
from palpate.identification.estimators.fit import Descent, slope_of_lag
from palpate.identification.estimators.octaves import (
    LARGEST,
    Octaves,
    Segment,
    Solution,
    System,
    longest_of,
    octaves_of,
    solve,
    system_of,
)
from palpate.identification.filters import low_passed
from palpate.identification.least_squares import inverse
from palpate.identification.models import Model
from palpate.identification.options import LAG, mass_std
from palpate.identification.problem import Problem
from palpate.signals.low_pass import LowPass
from palpate.signals.types import NORMAL


def lag_open(problem: Problem) -> bool:
    """Whether neither a calibration nor the sensor's own low-pass tells the lag."""
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
        segments: rows without a gap.
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
    segments: list[Segment]
    octaves: Octaves
    use: Mask
    noisy: dict[int, Array]
    system: System

    @classmethod
    def of(
        cls,
        problem: Problem,
        model: Model,
        segments: list[Segment],
        theta: dict[str, float],
        use: Mask | None = None,
    ) -> Linearisation:
        """Linearise a model about some parameters, and sum its columns by octave.

        Among the parameters are the other forces' and the lag's; what is not is looked for (those that the force is not
        linear in), zero (the others), or its prior's value (the lag). Octaves that count are given, shape (octaves,),
        where likelihoods compare over the same; None for those in which the columns are more than noise.
        """
        motion = problem.motion
        dt = float(np.median(np.diff(problem.time)))
        lag = theta.get(LAG, problem.lag.value)
        at, own, target = _linearise(problem, model, lag, theta)
        free = list(own)
        effects = causes.effect_columns(motion, model, lag, segments)
        drift = problem.contacts.drift
        bends = drift.bends(problem.time).T if drift is not None else ()
        bending = {f"drift {i}": column for i, column in enumerate(bends)}
        if LAG in own:
            moved = _moved_by_lag(effects, theta, segments, dt)
            own, target = own | {LAG: own[LAG] + moved}, target + moved * lag
        columns = [*own.values(), *effects.values(), *bending.values(), target, motion.moved(0, lag)]
        prior = dict.fromkeys(bending, (0.0, 1.0))
        if LAG in free:
            prior[LAG] = (problem.lag.value, problem.lag.std)
        if problem.lag.mass is not None and "M" in free:
            prior["M"] = (problem.lag.mass[0], mass_std(problem.lag.mass))
        whole = octaves_of(np.column_stack(columns), segments, dt, longest_of(segments))
        octaves = Octaves(whole.products[:, :, :-1, :-1], whole.lines, whole.frequency)
        orders = model.derivatives if not model.nonlinear else {}
        most = max(orders.values(), default=0) + (LAG in free)
        noisy = averaging.position_lines(motion, dt, longest_of(segments), len(octaves.frequency), most)
        if use is None:
            derivatives = {-1: 0} | {free.index(name): k for name, k in orders.items()}
            use = averaging.seen(motion, noisy, whole, derivatives)
        names = (*free, *effects, *bending)
        rubs = [column for name, column in effects.items() if name.startswith(causes.FRICTION)]
        friction = np.column_stack(rubs)
        system = system_of(octaves.only(use), names, prior)
        return cls(
            problem, model, lag, at, theta, names, friction, len(free), prior, segments, octaves, use, noisy, system,
        )  # fmt: skip

    @property
    def searched(self) -> dict[int, float]:
        """Parameters that the force is not linear in and the lag, by place: where the columns are formed."""
        at = {name: self.at[name] for name in (p.name for p in self.model.nonlinear)} | {LAG: self.lag}
        return {self.names.index(name): value for name, value in at.items() if name in self.names}

    def moved(self, theta: Array, step: Array) -> dict[str, float]:
        """Parameters, shape (p,), with those that are searched a step farther, shape (s,), within their limits."""
        found = dict(zip(self.names, theta.tolist(), strict=True))
        lag = self.problem.lag
        limits = {LAG: (lag.value - 3 * lag.std, lag.value + 3 * lag.std)}
        limits |= {p.name: (p.low, p.high) for p in self.model.nonlinear}
        for place, change in zip(self.searched, step.tolist(), strict=True):
            name = self.names[place]
            low, high = limits[name]
            least = max(low, found[name] / 3) if low > 0 else low
            found[name] = float(np.clip(found[name] + change, least, high))
        return found

    def misfit(self, solution: Solution) -> float:
        """-2 log of the likelihood, but for a constant: of a solution's noise levels, and the prior of the lag.

        The solution is that with what is searched held.
        """
        seen, std = self.system.lines > 0, self.problem.lag.std
        prior = ((self.lag - self.problem.lag.value) / std) ** 2 if std > 0 else 0.0
        return float(self.system.lines[seen] @ np.log(solution.noise[seen])) + prior

    def answer(self, solution: Solution) -> Answer:
        """The answer with its budget."""
        lines = self.octaves, self.use, self.system
        sensor, told = averaging.sensor_lines(self.problem, self.segments, *lines, solution)
        both = self._with_position(solution, sensor)
        explained, left, hidden = self._explained_part(solution, both)  # another force's does not count
        question = self.system, solution.noise, both, self._forces()
        likely = averaging.members(*question)
        solution = averaging.averaged(likely)
        each = [self._budget(own, sensor, told) for own in likely]
        budget = averaging.mean_budget(likely, each, solution.theta)
        budget["octaves"] = averaging.of_octaves(solution, *question)
        if "M" in self.names and "M" not in self.prior:
            place = self.names.index("M")
            supposed = averaging.of_supposition(solution, likely, self.system, place)
            budget["other forces"].variance[place] += supposed
            if self.problem.filtered is None:
                budget["low-pass"] = self._by_low_pass(solution, both, budget)
        kept = [i for i, name in enumerate(self.names) if i < self.own or name == causes.FRICTION]
        names = tuple(self.names[i] for i in kept)
        budget = {cause: part.of(kept) for cause, part in budget.items()}
        values = self.at or dict(zip(self.names, solution.theta.tolist(), strict=True))
        predicted = Prediction.of(self.model, self.problem.motion, self.problem.force, values, self.lag)
        noise = float(both @ self.system.lines) / max(float(self.system.lines.sum()), 1.0)
        cov = solution.cov[np.ix_(kept, kept)]
        return Answer(
            names, solution.theta[kept], cov, budget, predicted, explained, left, hidden, noise,
            self._friction(solution), self.problem,
        )  # fmt: skip

    def _friction(self, solution: Solution) -> Array:
        """Forces whose squares add up to the mean square of the friction's, its uncertainty included, shape (m, f)."""
        places = [i for i, name in enumerate(self.names) if name.startswith(causes.FRICTION)]
        theta = solution.theta[places]
        value, vector = np.linalg.eigh(solution.cov[np.ix_(places, places)] + np.outer(theta, theta))
        found = self.friction @ (vector * np.sqrt(np.maximum(value, 0.0)))
        most = LARGEST * np.std(self.problem.force)  # of a column that no octave shows nothing else is known
        return np.asarray(found * np.minimum(1.0, most / np.maximum(np.abs(found).max(axis=0), 1e-300)))

    def _forces(self) -> list[list[int]]:
        """Places of the columns of each force that may be there or not: a mass, too, of which nobody knows."""
        others = list(enumerate(self.names))[self.own :]
        found = [
            [i for i, name in others if name.startswith(kind)]
            for kind in (causes.FRICTION, "depth", "hysteresis")
        ]
        if "M" in self.names and "M" not in self.prior:
            found.append([self.names.index("M")])
        return [places for places in found if places]

    def _budget(self, member: averaging.Member, sensor: Array, told: Array) -> Budget:
        """By cause, with what a member supposes."""
        system, solution = member.system, member.solution
        budget = causes.of_noise(system, solution, self.names, self.own, LAG)
        budget["position noise"] = causes.of_position_noise(system, solution, self._position_noise())
        budget["repetition"] = causes.of_stretches(system, solution)
        both = self._with_position(solution, sensor)
        budget["unexplained"] = causes.of_unexplained(system, solution, both, told)
        if lag_open(self.problem) and LAG in self.names:
            budget["lag"] = self._by_prior_of_lag(member, budget["lag"])
        return budget

    def _by_low_pass(self, solution: Solution, sensor: Array, budget: Budget) -> Spread:
        """The mass by a low-pass that nobody gave: a lag T may be a delay, a low-pass of first order, or both.

        The log of its response is -T s + C s^2/2 - ... with a second cumulant C from 0 to T^2, and K C s^2/2 is a mass.
        Of real poles with a C of T^2/n or more, n equal ones are the least unlike a delay: the third cumulant is at
        least 2 C^2/T (Cauchy and Schwarz). A larger C is left out if the log is less likely with them than with a
        delay, and with what is as far on its other side, where Butterworth's are. The residual counts as if hidden.
        """
        time = min(float(np.hypot(self.lag, self.problem.lag.std)), self._radian())
        place, count = self.names.index("M"), 1
        most = abs(solution.theta[self.names.index("K")]) / 2 * time**2
        rest = NORMAL**2 * sum(part.variance[place] for part in budget.values())
        hidden = np.maximum(causes.HIDDEN_SHARE**2 * self.system.lines, 1.0) * (solution.noise - sensor)
        least = _misfit(self.system, sensor + hidden) + NORMAL**2
        while (most / count) ** 2 > rest:
            others = self._behind(LowPass.of_first_order(time, 2 * count))
            if any(_misfit(other, sensor + hidden) <= least for other in others):
                break
            count *= 2
        return Spread((most / count / NORMAL * np.equal(self.names, "M")) ** 2)

    def _behind(self, low_pass: LowPass) -> Iterator[System]:
        """Normal equations with the position behind a low-pass that is part of the lag, and on a delay's other side."""
        motion, lag = self.problem.motion, self.problem.lag
        behind = partial(low_passed, low_pass=low_pass, dt=motion.chain.dt)

        def mirror(signal: Array) -> Array:
            rows = np.arange(len(signal))
            return 2 * np.interp(rows - low_pass.lag / motion.chain.dt, rows, signal) - behind(signal)

        about, rest = {LAG: self.lag - low_pass.lag}, replace(lag, value=lag.value - low_pass.lag)
        for change in (behind, mirror):
            problem = replace(self.problem, motion=motion.through(change), lag=rest)
            yield Linearisation.of(problem, self.model, self.segments, self.about | about, self.use).system

    def _radian(self) -> float:
        """Time of a radian of the fastest motion [s]: a longer lag is seen apart from all but a damping."""
        band = self.problem.band
        return 1 / (2 * np.pi * band) if np.isfinite(band) else np.inf

    def _with_position(self, solution: Solution, sensor: Array) -> Array:
        """Variance of a line by the noise of both channels, shape (octaves,)."""
        own = solution.theta * [name in self.model.derivatives for name in self.names]
        by_position = np.einsum("i,oij,j->o", own, self._position_noise(), own)
        both = sensor + by_position / np.maximum(self.system.lines, 1.0)
        return np.asarray(np.minimum(both, solution.noise))

    def _position_noise(self) -> Array:
        """Products of what noise of the position makes of the columns by octave, shape (octaves, p, p).

        The column of the lag is of the next derivatives: its noise is that of the speed's, as the damping's is.
        """
        of = np.zeros((len(self.names), 1 + max(self.noisy) // 2))  # derivatives in each column
        for name, k in ({} if self.model.nonlinear else self.model.derivatives).items():
            i = self.names.index(name)
            of[i, k] = 1.0
            if LAG in self.names:
                of[self.names.index(LAG), k + 1] = -self.about.get(name, 0.0)
        found = np.einsum("ai,oij,bj->oab", of, averaging.derivative_products(self.noisy), of)
        return found * self.system.lines[:, None, None]

    def _by_prior_of_lag(self, member: averaging.Member, found: Spread) -> Spread:
        """Parameters seen in time get the prior's uncertainty of an uncalibrated lag, no less.

        A lag T counts as a damping of -K T, and as a branch that relaxes. Whatever else shifts the force in time moves
        the lag that a fit finds, and them with it: they count as if it were held anywhere in its prior, and as far from
        the prior's mean as the fit has moved it, but for the damping no farther than a radian of the fastest motion.
        """
        lag = self.names.index(LAG)
        rest = [i for i in range(len(self.names)) if i != lag]
        normal = inverse(member.solution.cov)
        slope = np.zeros(len(self.names))
        slope[rest] = inverse(normal[np.ix_(rest, rest)]) @ normal[rest, lag]
        std = self.problem.lag.std
        std = max(std, abs(float(member.solution.theta[lag]) - self.problem.lag.value))
        in_time = self.names[: self.own] if self.model.nonlinear else ("M",)
        reach = dict.fromkeys(in_time, min(std, self._radian()))
        reach |= {"B": std, LAG: 0.0}
        by_prior = (slope * [reach.get(name, 0.0) for name in self.names]) ** 2
        return Spread(np.maximum(found.variance, by_prior), found.freedom)

    def _explained_part(self, solution: Solution, sensor: Array) -> tuple[float, float, float]:
        """Share of the force's variance in contact that the model's own columns account for, without noise.

        With it the rms of what they leave [N], and the share of the amplitude that nothing accounts for, the other
        forces included.
        """
        total = self.system.products.sum(axis=0)
        full = np.zeros(total.shape[0])
        full[: self.own], full[-1] = -solution.theta[: self.own], 1.0
        offset = np.zeros_like(full)
        offset[-1] = 1.0
        if LAG in self.names:  # the target counts the lag from zero
            offset[self.names.index(LAG)] = -self.lag
        noise = float(sensor @ self.system.lines)
        left = max(float(full @ total @ full) - noise, 0.0)
        whole = max(float(offset @ total @ offset) - noise, 1e-300)
        count = max(float(self.system.lines.sum()), 1.0)
        beyond = float(np.maximum(solution.noise - sensor, 0.0) @ self.system.lines)
        return 1 - left / whole, float(np.sqrt(left / count)), float(np.sqrt(beyond / whole))


def _misfit(system: System, noise: Array) -> float:
    """-2 log of the likelihood and the priors for variances of a line, shape (octaves,), but for a constant."""
    found = solve(system, noise)
    full, weight = np.append(-found.theta, 1.0), np.where(system.lines > 0, 1 / noise, 0.0)
    left = float(full @ np.tensordot(weight, system.products, axes=1) @ full)
    return left + float(system.prior_weight @ (found.theta - system.prior_mean) ** 2)


def _linearise(
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
    """Derivative of the other forces by the lag [N/s], shape (m,): they are as late as the force of the contact."""
    force = np.column_stack(list(effects.values())) @ [theta.get(name, 0.0) for name in effects]
    found = np.zeros(len(force))
    for s in segments:
        found[s.first : s.last] = -np.gradient(force[s.first : s.last], dt)
    return found
