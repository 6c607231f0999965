"""The best multisine of a given duration, and its predicted uncertainty.

The phases keep the peak low, so that a force budget buys much power. The rounding of a position is no white noise: a
slow motion through few counts has its error where the motion itself is, a repeated motion repeats it, and no time
averages it out. So the motion is rounded from several offsets of the encoder, and the errors of the parameters follow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.errors import InputError
from palpate.excitation.force_loops import LinearSurface
from palpate.excitation.power_spectrum import covariance, optimal_powers
from palpate.excitation.problem import DesignProblem
from palpate.references import Multisine
from palpate.signals.types import NORMAL

Harmonics = NDArray[np.intp]

ROUNDING_ERROR = 0.3
"""Relative error of the rounding's power within the band of a fit, which is estimated from above that band."""


@dataclass(frozen=True)
class PredictedWidths:
    """Predicted uncertainty of one surface.

    Args:
        surface: the surface.
        names: of the identified parameters.
        information: of a second about their logarithms and the lag, shape (n, n).
        prior: information of the same parameters, shape (n, n).
        rounding: covariance by the rounding of the position, which repeats with the motion, shape (n, n).
        pull: fraction by which the rounding pulls each parameter towards zero, shape (n,).
        force: lowest and highest force on the surface [N].
        travel: of the tip, from end to end [m].
    """

    surface: LinearSurface
    names: tuple[str, ...]
    information: Array
    prior: Array
    rounding: Array
    pull: Array
    force: tuple[float, float]
    travel: float

    def half_widths(self, seconds: float) -> dict[str, float]:
        """95 % half-width of each parameter after so many seconds, as a fraction of its value.

        The pull towards zero is corrected as well as the power of the rounding is known; neither becomes better with
        time.
        """
        C = covariance(seconds * self.information, self.prior)
        C = C + self.rounding + np.diag((ROUNDING_ERROR * self.pull) ** 2)
        return {name: NORMAL * float(np.sqrt(C[i, i])) for i, name in enumerate(self.names)}


@dataclass(frozen=True)
class Excitation:
    """A multisine about the mean force, with its predictions.

    Args:
        wave: added to the mean force [N].
        predictions: one for each surface, the middle first.
        gap: upper bound of the spectrum's relative distance from the optimum.
    """

    wave: Multisine
    predictions: tuple[PredictedWidths, ...]
    gap: float

    def worst(self, seconds: float) -> dict[str, float]:
        """Largest half-width of each parameter on any surface, as a fraction of its value."""
        widths = [prediction.half_widths(seconds) for prediction in self.predictions]
        return {name: max(width[name] for width in widths) for name in self.predictions[0].names}

    def excess(self, seconds: float, precision: Mapping[str, float]) -> float:
        """Largest ratio of half-width and wanted precision; at most 1 is sufficient."""
        widths = self.worst(seconds)
        return max(widths[name] / target for name, target in precision.items())


_POINTS_PER_CYCLE = 8
"""Points per cycle of the highest harmonic while phases are improved."""
_FINE_POINTS_PER_CYCLE = 32
"""Points per cycle of the highest harmonic where the budget is checked."""
_RANDOM_STARTS = 5
"""Number of random starts beside Schroeder's phases."""


def schroeder(powers: Array) -> Array:
    """Phases of a sum of sines with a low peak (Schroeder, IEEE Trans. IT 16, 1970), shape (F,).

    Each frequency follows the one before after a time in proportion to its power: a chirp of the given spectrum.
    """
    fractions = powers / powers.sum()
    below = np.concatenate([[0.0], np.cumsum(fractions)[:-1]])
    return -2 * np.pi * np.cumsum(below)


def low_peak(amplitudes: Array, harmonics: Harmonics, rounds: int = 500) -> Array:
    """Phases with which the sum of a sin(2 pi h t/T + phase) has a low peak, shape (F,).

    Schroeder's phases and a few random ones are improved by clipping the signal and keeping the phases of what is left
    (van der Ouderaa, Schoukens and Renneboog, IEEE Trans. IM 37, 1988); the lowest peak wins. The same amplitudes
    give the same phases.

    Args:
        amplitudes: shape (F,).
        harmonics: cycles in the period, whole numbers, rising, shape (F,).
        rounds: of clipping.
    """
    rng = np.random.default_rng(0)
    random = rng.uniform(0, 2 * np.pi, (_RANDOM_STARTS, len(amplitudes)))
    phases = np.vstack([schroeder(amplitudes**2), random])
    lowest, best = np.full(len(phases), np.inf), phases.copy()
    for k in range(rounds):
        signal = sum_of_sines(amplitudes * np.exp(1j * phases), harmonics)
        top = np.abs(signal).max(axis=1)
        better = top < lowest
        lowest[better], best[better] = top[better], phases[better]
        level = (top * (0.75 + 0.2 * k / rounds))[:, None]  # clips less at the end
        phases = np.angle(1j * np.fft.rfft(np.clip(signal, -level, level))[:, harmonics])
    return best[np.argmin(lowest)]


def sum_of_sines(phasors: Complex, harmonics: Harmonics, points: int = _POINTS_PER_CYCLE) -> Array:
    """Sum over a period of sines of given phasors, Im sum p exp(2 pi j h t/T), at even instants, shape (..., n).

    Args:
        phasors: shape (..., F).
        harmonics: rising, shape (F,).
        points: least number per cycle of the highest harmonic.
    """
    count = 1 << int(points * int(harmonics[-1])).bit_length()
    spectra = np.zeros((*phasors.shape[:-1], count // 2 + 1), complex)
    spectra[..., harmonics] = -0.5j * count * phasors
    return np.fft.irfft(spectra, count)


ENCODER_OFFSETS = 24
"""Number of offsets of the encoder's counts from the motion, evenly spread over a count."""


def rounding_phasors(motion: Complex, harmonics: Harmonics, readings: int, step: float) -> Complex:
    """Phasors of the rounding error at the harmonics of a periodic motion [m], shape (offsets, F).

    Args:
        motion: phasors x = Im(X e^jwt) [m], shape (F,).
        harmonics: of the period, shape (F,).
        readings: in a period.
        step: of the encoder [m].
    """
    if not step > 0:
        return np.zeros((ENCODER_OFFSETS, len(harmonics)), complex)
    spectrum = np.zeros(readings // 2 + 1, complex)
    spectrum[harmonics] = -0.5j * readings * motion
    path = np.fft.irfft(spectrum, readings)
    offset = step * (np.arange(ENCODER_OFFSETS)[:, None] + 0.5) / ENCODER_OFFSETS
    error = step * np.round((path + offset) / step) - offset - path
    return np.asarray(2j / readings * np.fft.rfft(error, axis=-1))[:, harmonics]


PERIOD = 2.0
"""Period of a multisine that may last longer [s]; its frequencies lie 1/PERIOD apart."""
_SPECTRUM_LINES = 32
"""Number of frequencies on which the spectrum is optimised."""
_MAX_LINES = 128
"""Maximum number of frequencies of the wave."""
_SPECTRUM_ROUNDS = 6
"""Rounds of spectrum and power: with friction each depends on the other."""
_QUICK, _THOROUGH = 60, 500
"""Rounds of clipping, to choose a width and for the result."""
_USUAL_CREST = 1.5
"""Crest factor of a multisine with good phases, for the first guess of its power."""
_MIN_POWER = 0.003
"""Smallest power of a line, relative to the strongest."""
_RATE_COSTS = (0.0, 0.5, 0.8, 0.95)
"""Tried fractions of a line's cost that grow with its frequency squared, where the rate of the force is limited."""
_WIDTHS = (0.01, 0.05, 0.1, 0.2, 0.4, 0.8)
"""Tried widths of a line, in the logarithm of the frequency."""


def best_multisine(problem: DesignProblem, seconds: float) -> Excitation:
    """The best multisine of so many seconds, a whole number of its periods.

    Where the budget limits the rate of change, power at high frequencies is made dearer until it pays no more.

    Raises:
        InputError: the band has room for fewer than two frequencies.
    """
    costs = _RATE_COSTS if np.isfinite(problem.budget.rate) else _RATE_COSTS[:1]
    return min(
        (_multisine(problem, seconds, cost) for cost in costs),
        key=lambda excitation: excitation.excess(seconds, problem.precision),
    )


def _multisine(problem: DesignProblem, seconds: float, rate_cost: float) -> Excitation:
    harmonics, base = _harmonics(problem, seconds), 2 * np.pi / _period(problem, seconds)
    omega, powers, gap = _optimal_spectrum(problem, base * harmonics.astype(np.float64), seconds, rate_cost)

    def spread(width: float, rounds: int) -> Excitation:
        amplitudes = _spread(omega, powers, base * harmonics.astype(np.float64), width)
        used = amplitudes > 0
        phases = low_peak(amplitudes[used], harmonics[used], rounds)
        return _within_budget(problem, harmonics[used], seconds, amplitudes[used], phases, gap)

    excess = {width: spread(width, _QUICK).excess(seconds, problem.precision) for width in _WIDTHS}
    return spread(min(excess, key=excess.__getitem__), _THOROUGH)


def _optimal_spectrum(
    problem: DesignProblem, frequencies: Array, seconds: float, rate_cost: float
) -> tuple[Array, Array, float]:
    """Some of the frequencies [rad/s], their optimal powers, and the gap to the optimum."""
    lines = np.unique(np.round(np.geomspace(1, len(frequencies), _SPECTRUM_LINES)).astype(np.intp)) - 1
    omega = frequencies[lines]
    costs = (1 - rate_cost) + rate_cost * omega**2 / np.mean(omega**2)
    powers, gap = np.full(len(omega), 1 / costs.sum()), np.inf
    strength = problem.budget.desired_swing / _USUAL_CREST
    for _ in range(_SPECTRUM_ROUNDS):
        forces = problem.forces(omega, strength * np.sqrt(2 * powers))
        unit = seconds * problem.information(omega, forces) / powers[:, None, None]
        spectrum = optimal_powers(unit, problem.prior, problem.targets, costs, powers)
        powers, gap = spectrum.powers, spectrum.gap
    return omega, powers, gap


def _spread(omega: Array, powers: Array, dense: Array, width: float) -> Array:
    """Amplitudes on a dense grid of frequencies, each line of a spectrum spread over a width of the logarithm.

    A few adjacent lines beat: their peak is high, and the budget of force leaves them little power. Spread over many
    lines with the right phases they give almost the same information per power, and the budget allows more power.
    """
    distance = np.log(dense[:, None] / omega) / width
    weights = np.exp(-0.5 * distance**2) * np.gradient(np.log(dense))[:, None]
    spread = (weights / weights.sum(axis=0)) @ powers
    return np.sqrt(np.where(spread > _MIN_POWER * spread.max(), spread, 0.0))


def _within_budget(
    problem: DesignProblem, harmonics: Harmonics, seconds: float, amplitudes: Array, phases: Array, gap: float
) -> Excitation:
    """The excitation, as strong as the budget allows for the desired force and the force on every surface."""
    budget, turn = problem.budget, np.exp(1j * phases)
    omega = 2 * np.pi / _period(problem, seconds) * harmonics.astype(np.float64)

    def allowed_factor(strength: float) -> float:
        """Factor by which a strength may still grow."""
        desired = strength * amplitudes * turn
        both = sum_of_sines(np.stack([desired, 1j * omega * desired]), harmonics, _FINE_POINTS_PER_CYCLE)
        peak, slope = np.abs(both).max(axis=1)
        forces = problem.forces(omega, strength * amplitudes) * turn
        felt = np.abs(sum_of_sines(forces, harmonics, _FINE_POINTS_PER_CYCLE)).max()
        return float(min(budget.desired_swing / peak, budget.rate / slope, budget.swing / felt))

    amplitudes = amplitudes * _largest_strength(allowed_factor, budget.desired_swing)
    forces = problem.forces(omega, amplitudes) * turn
    predictions = tuple(
        _predict(problem, surface, harmonics, omega, force, seconds)
        for surface, force in zip(problem.surfaces.surfaces(), forces, strict=True)
    )
    frequencies = omega / (2 * np.pi)
    wave = Multisine(tuple(frequencies.tolist()), tuple(amplitudes.tolist()), tuple(phases.tolist()))
    return Excitation(wave, predictions, gap)


_STRENGTH_ROUNDS = 40
_STRENGTH_EXPONENT = 0.7
"""Exponent of each correction of the strength; 1 would overshoot where friction gives way."""
_STRENGTH_TOLERANCE = 1e-3
"""Relative distance to the budget at which the corrections stop."""


def _largest_strength(allowed_factor: Callable[[float], float], strength: float) -> float:
    """The strength that uses up the budget, starting from another.

    Args:
        allowed_factor: by which a strength may still grow; with friction the force grows faster than the strength.
        strength: to start from.
    """
    for _ in range(_STRENGTH_ROUNDS):
        factor = allowed_factor(strength)
        strength *= factor**_STRENGTH_EXPONENT
        if abs(factor - 1) < _STRENGTH_TOLERANCE:
            break
    return strength


def _predict(
    problem: DesignProblem,
    surface: LinearSurface,
    harmonics: Harmonics,
    omega: Array,
    force: Complex,
    seconds: float,
) -> PredictedWidths:
    """PredictedWidths for a surface under a force of given phasors [N], shape (F,)."""
    sensors, mean = problem.sensors, problem.budget.mean
    motion = force / surface.impedance(omega)
    force_over_time = mean + sum_of_sines(force, harmonics, _FINE_POINTS_PER_CYCLE)
    position = sum_of_sines(motion, harmonics, _FINE_POINTS_PER_CYCLE)
    readings = max(round(_period(problem, seconds) * sensors.rate), 2 * int(harmonics[-1]) + 2)
    rounding = rounding_phasors(motion, harmonics, readings, sensors.position_step)
    information, by_rounding, pull = problem.information_with_rounding(
        surface, omega, force, rounding, seconds
    )
    return PredictedWidths(
        surface=surface,
        names=problem.surfaces.names,
        information=information,
        prior=problem.prior,
        rounding=by_rounding,
        pull=pull,
        force=(float(force_over_time.min()), float(force_over_time.max())),
        travel=float(np.ptp(position)),
    )


def period_for(problem: DesignProblem) -> float:
    """Usual period of a multisine: at least one cycle of the lowest frequency [s]."""
    return max(PERIOD, 1 / problem.budget.lowest)


def _period(problem: DesignProblem, seconds: float) -> float:
    """The usual period, or the nearest longer one of which `seconds` are a whole number [s]."""
    return seconds / max(1, floor(seconds / period_for(problem) + 1e-9))


def _harmonics(problem: DesignProblem, seconds: float) -> Harmonics:
    """Harmonics of the period within the band; of many, every second, third and so on."""
    budget, period = problem.budget, _period(problem, seconds)
    first, last = max(ceil(budget.lowest * period - 1e-9), 1), floor(budget.highest * period + 1e-9)
    if last <= first:
        raise InputError(
            f"a multisine of {seconds:g} s has fewer than two frequencies between {budget.lowest:g} and "
            f"{budget.highest:g} Hz; make it longer or the band wider"
        )
    return np.arange(first, last + 1, ceil((last - first + 1) / _MAX_LINES))
