"""The design of an excitation: no longer than it must be.

A sweep goes between the two most informative frequencies, a multisine is that of `multisine`. If neither reaches the
requested precision, remedies are changed limits that do.
"""

from dataclasses import dataclass, replace
from itertools import product
from math import ceil

import numpy as np

from palpate.arrays import Array
from palpate.references import Chirp, Multisine
from palpate_excitation import multisine
from palpate_excitation.force_loops import Made, SurfaceResponse, Wave
from palpate_excitation.multisine import error_of_sweep
from palpate_excitation.problem import LONGEST, DesignProblem, used_up

_ENDS = 6  # places for each end of the sweep
_FINE = 64  # frequencies of a sweep that are looked at


def best_chirp(problem: DesignProblem, seconds: float) -> Made:
    """The best sweep of so many seconds: from where to where, and whether evenly or logarithmically."""
    budget = problem.budget
    grid = np.geomspace(budget.lowest, budget.highest, _ENDS)
    sweeps = [
        Chirp(float(low), float(high), seconds, 1.0, logarithmic)
        for low, high, logarithmic in product(grid, grid, (False, True))
        if low < high and low * seconds >= 1
    ] or [Chirp(budget.lowest, budget.highest, seconds, 1.0, False)]
    made = (_predict_chirp(problem, _within_budget(problem, sweep)) for sweep in sweeps)
    return min(made, key=lambda found: found.excess(seconds, problem.precision))


def _frequencies(sweep: Chirp) -> Array:
    """Frequencies of the sweep at even times [rad/s], shape (_FINE,)."""
    share = (np.arange(_FINE) + 0.5) / _FINE
    if sweep.logarithmic:
        return 2 * np.pi * sweep.low * (sweep.high / sweep.low) ** share
    return 2 * np.pi * (sweep.low + share * (sweep.high - sweep.low))


def _within_budget(problem: DesignProblem, sweep: Chirp) -> Chirp:
    omega = _frequencies(sweep)

    def share(amplitude: float) -> float:
        felt = float(np.abs(problem.forces(omega, np.full(_FINE, amplitude))).max())
        return min(_share(problem, sweep._replace(amplitude=amplitude)), problem.budget.swing / felt)

    return sweep._replace(amplitude=used_up(share, problem.budget.desired_swing))


def _share(problem: DesignProblem, sweep: Chirp) -> float:
    return problem.budget.share(sweep.amplitude, 2 * np.pi * sweep.high * sweep.amplitude)


def _predict_chirp(problem: DesignProblem, sweep: Chirp) -> Made:
    omega = _frequencies(sweep)
    forces = problem.forces(omega, np.full(_FINE, sweep.amplitude))
    sensors, predictions = problem.sensors, []
    for surface, force in zip(problem.surfaces.surfaces(), forces, strict=True):
        motion = force / surface.impedance(omega)
        error = error_of_sweep(motion, omega, sweep.seconds, sensors.rate, sensors.position_step)
        known = problem.information_with_errors(surface, omega, force, error, sweep.seconds, together=False)
        felt = float(np.abs(force).max())
        travel = 2 * float(np.abs(force / surface.impedance(omega)).max())
        between = (problem.budget.mean - felt, problem.budget.mean + felt)
        predictions.append(
            SurfaceResponse(
                surface, problem.surfaces.names, known[0], problem.prior, *known[1:], between, travel
            )
        )
    return Made(sweep, tuple(predictions), gap=0.0)


MAKERS = {"multisine": multisine.best_multisine, "chirp": best_chirp}
"""By the kind of excitation: from a problem and a duration to the best one."""

_FIRST = 10.0  # s; where the search for the shortest duration starts
_ROUNDS = 4
"""Of a duration that is aimed at: each misses by less, as precision goes with its root."""
_LONGER = 1.05  # where the duration that was aimed at misses by a hair
_STEP = 0.5  # s; a chirp is as long as a whole number of these
FOREVER = 1e7  # s


@dataclass(frozen=True)
class Design:
    """An excitation for a problem.

    Args:
        problem: as requested.
        made: the wave and its predictions.
        seconds: of the part that counts.
    """

    problem: DesignProblem
    made: Made
    seconds: float

    @property
    def wave(self) -> Wave:
        """The wave that is added to the mean force."""
        return self.made.wave

    @property
    def predictions(self) -> tuple[SurfaceResponse, ...]:
        """One a surface, the middle first."""
        return self.made.predictions

    @property
    def settle(self) -> float:
        """Seconds before the part that counts; a sweep has none."""
        return self.problem.settle if isinstance(self.wave, Multisine) else 0.0

    @property
    def excess(self) -> float:
        """Largest half-width per that asked for."""
        return self.made.excess(self.seconds, self.problem.precision)

    @property
    def feasible(self) -> bool:
        """Whether it reaches the requested precision on every surface."""
        return self.excess <= 1.0

    @property
    def needed(self) -> float:
        """Seconds after which the same wave, repeated, would reach it; infinite if it never does."""
        return seconds_needed(self.made, self.problem)

    def force(self, rate: float = 1000.0) -> tuple[Array, Array]:
        """Times [s] and desired force [N], both of shape (n,); while the touch settles, the wave is eased in."""
        time = np.arange(round((self.settle + self.seconds) * rate) + 1) / rate
        eased = np.sin(0.5 * np.pi * np.clip(time / self.settle, 0, 1)) ** 2 if self.settle else 1.0
        return time, self.problem.budget.mean + eased * self.wave.at(time)


def design(problem: DesignProblem) -> Design:
    """The excitation that reaches the precision in the shortest time, or the best one in the time given.

    Raises:
        InputError: the budget leaves no excitation at all.
    """
    make = MAKERS[problem.kind]
    if problem.duration is not None:
        return Design(problem, make(problem, problem.duration), problem.duration)
    seconds = min(_FIRST, problem.longest)
    for _ in range(_ROUNDS):
        made = make(problem, seconds)
        before, seconds = seconds, _whole(problem, seconds_needed(made, problem))
        if before == seconds:
            break
    found = Design(problem, make(problem, seconds), seconds)
    while not found.feasible and found.seconds < problem.longest:
        seconds = _whole(problem, _LONGER * found.seconds + _STEP)
        found = Design(problem, make(problem, seconds), seconds)
    return found


def seconds_needed(made: Made, problem: DesignProblem) -> float:
    """Seconds of a wave that reach the precision: more of them never give less information."""
    low, high = 1e-3, FOREVER
    if made.excess(high, problem.precision) > 1:
        return np.inf
    while high / low > 1 + 1e-6:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if made.excess(middle, problem.precision) > 1 else (low, middle)
    return high


def _whole(problem: DesignProblem, seconds: float) -> float:
    """At least so many seconds, as a whole number of periods or steps, and no more than the longest."""
    step = max(multisine.PERIOD, 1 / problem.budget.lowest) if problem.kind == "multisine" else _STEP
    return min(ceil(seconds / step - 1e-6) * step if seconds < FOREVER else np.inf, problem.longest)


_MUCH = 10.0  # times the force
_HELPS, _SOONER = 0.95, 0.5  # of the excess, or of the time needed; what helps less is no remedy


@dataclass(frozen=True)
class Remedy:
    """A change of the limits, and its effect.

    Args:
        change: in words.
        reached: largest half-width of each parameter on any surface with it.
        enough: whether that reaches the requested precision.
        needed: how long it must last with it [s], the change of the duration aside; may be infinite.
        limit: largest half-width per that asked for, however long it lasts.
    """

    change: str
    reached: dict[str, float]
    enough: bool
    needed: float
    limit: float


def remedies(found: Design) -> list[Remedy]:
    """Of more time, more force, faster changes, a wider band, a better known lag and a finer position those that help.

    If none is enough by itself, all of them at once.
    """
    helpful = []
    if found.needed <= LONGEST:
        told = f"{ceil(found.needed)} s instead of {found.seconds:g} s"
        helpful.append(Remedy(told, found.made.worst(found.needed), True, found.needed, 1.0))
    together, limit = found.problem, found.made.excess(FOREVER, found.problem.precision)
    for change in (_stronger, _steeper, _wider, _synchronous, _finer):
        words, other = change(found.problem, found.excess)
        if other == found.problem:
            continue
        tried = _try_remedy(words, other, found.seconds)
        sooner = tried.needed < _SOONER * found.needed
        if sooner or _excess(tried, found) < _HELPS * found.excess or tried.limit < _HELPS * limit:
            helpful.append(tried)
            together = change(together, found.excess)[1]
    if len(helpful) > 1 and not any(remedy.enough for remedy in helpful):
        helpful.append(_try_remedy("all of these", together, found.seconds))
    return helpful


def _try_remedy(words: str, problem: DesignProblem, seconds: float) -> Remedy:
    made = MAKERS[problem.kind](problem, seconds)
    enough = made.excess(seconds, problem.precision) <= 1
    limit = made.excess(FOREVER, problem.precision)
    return Remedy(words, made.worst(seconds), enough, seconds_needed(made, problem), limit)


def _excess(tried: Remedy, found: Design) -> float:
    return max(tried.reached[name] / asked for name, asked in found.problem.precision.items())


def _stronger(problem: DesignProblem, excess: float) -> tuple[str, DesignProblem]:
    budget, more = problem.budget, min(1.1 * excess, _MUCH)
    swing = more * budget.swing
    mean = max(budget.mean, budget.least + swing)
    drive = None if budget.drive is None else more * budget.drive
    words = (
        f"a force of {mean:.3g} N with {swing:.3g} N to each side instead of {budget.mean:g} N "
        f"with {budget.swing:g} N"
    )
    return words, replace(problem, budget=replace(budget, mean=mean, peak=mean + swing, drive=drive))


def _steeper(problem: DesignProblem, excess: float) -> tuple[str, DesignProblem]:
    rate = problem.budget.rate
    faster = min(1.1 * excess, _MUCH) * rate
    words = f"a force that changes by {faster:.3g} N/s instead of {rate:g} N/s"
    return words, replace(problem, budget=replace(problem.budget, rate=faster))


def _wider(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    budget = problem.budget
    highest = max(budget.highest, min(2 * budget.highest, 0.45 * problem.sensors.force.sampling))
    words = f"frequencies up to {highest:g} Hz instead of {budget.highest:g} Hz"
    return words, replace(problem, budget=replace(budget, highest=highest))


def _synchronous(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    sensors = problem.sensors
    exact = replace(sensors, lag_std=0.0, force=replace(sensors.force, phase_std=0.0))
    words = f"a lag between force and position known exactly, not to {1e6 * sensors.lag_error:.0f} us"
    return words, replace(problem, sensors=exact)


def _finer(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    sensors = problem.sensors
    step = sensors.position_step / _MUCH
    words = f"a position in steps of {1e6 * step:.3g} um instead of {1e6 * sensors.position_step:.3g} um"
    return words, replace(problem, sensors=replace(sensors, position_step=step))
