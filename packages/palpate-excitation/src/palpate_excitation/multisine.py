"""A multisine with optimal power and low peaks, and the error of a position that an encoder rounds along it.

Its phases keep the peak low, so that a force budget buys as much power as it can. The rounding of a motion is no white
noise: a slow motion through few counts has its error where the motion itself is, a repeated motion repeats it, and no
time averages it out. So it is simulated: the motion is rounded from some places of the encoder, and the errors of the
parameters follow.
"""

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.errors import InputError
from palpate.references import Multisine
from palpate_excitation.force_loops import Made, SurfaceResponse
from palpate_excitation.problem import DesignProblem, used_up
from palpate_excitation.spectra import optimal

_POINTS_A_CYCLE = 8  # of the period a cycle of the highest harmonic
_STARTS = 5
"""Random phases beside Schroeder's; the best peak of all is taken."""


def schroeder(powers: Array) -> Array:
    """Phases of a sum of sines by the share of power below each (Schroeder, IEEE Trans. IT 16, 1970), shape (F,).

    Each frequency follows the one before by as long as its power asks for: a chirp of the given spectrum.
    """
    share = powers / powers.sum()
    below = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    return -2 * np.pi * np.cumsum(below)


def low_peak(amplitudes: Array, harmonics: NDArray[np.intp], rounds: int = 500) -> Array:
    """Phases under which sum a sin(2 pi h t/T + phase) peaks low, shape (F,).

    Schroeder's, and a few random ones, each improved by clipping the signal and keeping the phases of what is left
    (van der Ouderaa, Schoukens and Renneboog, IEEE Trans. IM 37, 1988); the lowest peak wins. The same amplitudes
    give the same phases.

    Args:
        amplitudes: shape (F,).
        harmonics: cycles in the period, whole numbers, rising, shape (F,).
        rounds: of clipping.
    """
    rng = np.random.default_rng(0)
    phases = np.vstack([schroeder(amplitudes**2), rng.uniform(0, 2 * np.pi, (_STARTS, len(amplitudes)))])
    lowest, best = np.full(len(phases), np.inf), phases.copy()
    for k in range(rounds):
        signal = sum_of_sines(amplitudes * np.exp(1j * phases), harmonics)
        top = np.abs(signal).max(axis=1)
        better = top < lowest
        lowest[better], best[better] = top[better], phases[better]
        level = (top * (0.75 + 0.2 * k / rounds))[:, None]  # gently at the end
        phases = np.angle(1j * np.fft.rfft(np.clip(signal, -level, level))[:, harmonics])
    return best[np.argmin(lowest)]


def sum_of_sines(phasors: Complex, harmonics: NDArray[np.intp], points: int = _POINTS_A_CYCLE) -> Array:
    """Sums over a period of sines of given phasors, Im sum p exp(2 pi j h t/T).

    Args:
        phasors: shape (..., F).
        harmonics: rising, shape (F,).
        points: instants a cycle of the highest harmonic, or a few more.

    Returns:
        At even instants, shape (..., n).
    """
    count = 1 << int(points * int(harmonics[-1])).bit_length()
    spectra = np.zeros((*phasors.shape[:-1], count // 2 + 1), complex)
    spectra[..., harmonics] = -0.5j * count * phasors
    return np.fft.irfft(spectra, count)


PLACES = 24
"""Places of the encoder's counts under the motion that are tried, evenly spread."""


def error_of_period(motion: Complex, harmonics: NDArray[np.intp], readings: int, step: float) -> Complex:
    """Phasors of the error at all harmonics of a periodic motion [m], shape (places, readings // 2 + 1).

    Args:
        motion: phasors x = Im(X e^jwt) [m], shape (F,).
        harmonics: of the period, shape (F,).
        readings: in a period.
        step: of the encoder [m].
    """
    spectrum = np.zeros(readings // 2 + 1, complex)
    spectrum[harmonics] = -0.5j * readings * motion
    error = _rounding_errors(np.fft.irfft(spectrum, readings), step)
    return np.asarray(2j / readings * np.fft.rfft(error, axis=-1))


def error_of_sweep(motion: Complex, omega: Array, seconds: float, rate: float, step: float) -> Complex:
    """Phasors of the error along a sweep [m], each of the stretch about its frequency, shape (places, F).

    Args:
        motion: phasors x = Im(X e^jwt) [m], shape (F,), one after the other for equal times.
        omega: their angular frequencies [rad/s], shape (F,).
        seconds: that the sweep lasts.
        rate: readings a second [Hz].
        step: of the encoder [m].
    """
    each = max(round(seconds * rate / len(omega)), 2)
    place = np.arange(len(omega) * each) / each - 0.5
    phase = np.exp(1j * np.cumsum(np.interp(place, np.arange(len(omega)), omega)) / rate)
    size = np.interp(place, np.arange(len(omega)), motion.real) + 1j * np.interp(
        place, np.arange(len(omega)), motion.imag
    )
    error = _rounding_errors(np.imag(size * phase), step) * np.conj(phase)
    return np.asarray(2j / each * error.reshape(PLACES, len(omega), each).sum(axis=-1))


def _rounding_errors(path: Array, step: float) -> Array:
    """Error that rounding adds to a path from each place of the encoder, shape (places, *path.shape)."""
    if not step > 0:
        return np.zeros((PLACES, *path.shape))
    place = step * (np.arange(PLACES) + 0.5).reshape(-1, *(1,) * path.ndim) / PLACES
    return np.asarray(step * np.round((path + place) / step) - place - path)


Harmonics = NDArray[np.intp]

PERIOD = 2.0
"""Of a multisine that may last longer [s]; its frequencies lie 1/PERIOD apart."""
_LINES, _MOST = 32, 128  # frequencies that the spectrum is looked for on, and that the wave is made of
_ROUNDS = 6
_QUICK, _THOROUGH = 60, 500  # rounds of clipping, to choose a width and for good
_USUAL_CREST = 1.5
"""Of a multisine with good phases: the first guess of its power, which the rounds then correct."""
_FAINT = 0.003  # of the strongest power; a line below it is left out
_MIXES = (0.0, 0.5, 0.8, 0.95)
"""Shares of a line's price that go with its frequency squared where the rate of the force is limited; all are tried."""
_POINTS = 32  # a cycle of the highest line
_WIDTHS = (0.01, 0.05, 0.1, 0.2, 0.4, 0.8)  # of a line, in the frequency's logarithm


def best_multisine(problem: DesignProblem, seconds: float) -> Made:
    """The best multisine of so many seconds, a whole number of its periods.

    Where the budget limits the rate of change, power at high frequencies is made dearer until it pays no more.

    Raises:
        InputError: the band has room for fewer than two frequencies.
    """
    mixes = _MIXES if np.isfinite(problem.budget.rate) else _MIXES[:1]
    return min(
        (_multisine(problem, seconds, mix) for mix in mixes),
        key=lambda made: made.excess(seconds, problem.precision),
    )


def _multisine(problem: DesignProblem, seconds: float, mix: float) -> Made:
    harmonics, base = _harmonics(problem, seconds), 2 * np.pi / _period(problem, seconds)
    places = np.unique(np.round(np.geomspace(1, len(harmonics), _LINES)).astype(np.intp)) - 1
    omega = base * harmonics[places].astype(np.float64)
    costs = (1 - mix) + mix * omega**2 / np.mean(omega**2)
    powers, gap = np.full(len(omega), 1 / costs.sum()), np.inf
    strength = problem.budget.desired_swing / _USUAL_CREST
    for _ in range(_ROUNDS):  # friction makes the answer depend on the power, so the two are found in turns
        forces = problem.forces(omega, strength * np.sqrt(2 * powers))
        unit = seconds * problem.information(omega, forces) / powers[:, None, None]
        found = optimal(unit, problem.prior, problem.target_halves, problem.criterion, costs, powers)
        powers, gap = found.powers, found.gap

    def spread(width: float, rounds: int) -> Made:
        amplitudes = _spread(omega, powers, base * harmonics.astype(np.float64), width)
        used = amplitudes > 0
        phases = low_peak(amplitudes[used], harmonics[used], rounds)
        return _within_budget(problem, harmonics[used], seconds, amplitudes[used], phases, gap)

    tried = {width: spread(width, _QUICK).excess(seconds, problem.precision) for width in _WIDTHS}
    return spread(min(tried, key=tried.__getitem__), _THOROUGH)


def _spread(omega: Array, powers: Array, dense: Array, width: float) -> Array:
    """Amplitudes on a dense grid of frequencies, each line of a spectrum spread over a width of the logarithm.

    A few lines side by side beat: their peak is high, and the budget of force leaves them little power. Spread over
    many lines with the right phases they tell almost as much a unit of power, and the budget leaves them more of it.
    """
    distance = np.log(dense[:, None] / omega) / width
    shares = np.exp(-0.5 * distance**2) * np.gradient(np.log(dense))[:, None]
    spread = (shares / shares.sum(axis=0)) @ powers
    return np.sqrt(np.where(spread > _FAINT * spread.max(), spread, 0.0))


def _within_budget(
    problem: DesignProblem, harmonics: Harmonics, seconds: float, amplitudes: Array, phases: Array, gap: float
) -> Made:
    """As strong as the budget allows, for the desired force and for the force on every surface."""
    period, sensors = _period(problem, seconds), problem.sensors
    omega, start = 2 * np.pi / period * harmonics.astype(np.float64), np.exp(1j * phases)

    def share(strength: float) -> float:
        asked = strength * amplitudes * start
        peak, slope = np.abs(sum_of_sines(np.stack([asked, 1j * omega * asked]), harmonics, _POINTS)).max(
            axis=1
        )
        phasors = problem.forces(omega, strength * amplitudes) * start
        felt = np.abs(sum_of_sines(phasors, harmonics, _POINTS)).max()
        return min(problem.budget.share(float(peak), float(slope)), problem.budget.swing / float(felt))

    amplitudes = amplitudes * used_up(share, problem.budget.desired_swing)
    forces = problem.forces(omega, amplitudes)
    predictions = []
    for surface, force in zip(problem.surfaces.surfaces(), forces, strict=True):
        felt_there = problem.budget.mean + sum_of_sines(force * start, harmonics, _POINTS)
        moved = sum_of_sines(force / surface.impedance(omega) * start, harmonics, _POINTS)
        between = float(felt_there.min()), float(felt_there.max())
        motion = force / surface.impedance(omega) * start
        readings = max(round(period * sensors.rate), 2 * int(harmonics[-1]) + 2)
        error = error_of_period(motion, harmonics, readings, sensors.position_step)
        known = problem.information_with_errors(
            surface, omega, force * start, error[:, harmonics], seconds, together=True
        )
        names, prior = problem.surfaces.names, problem.prior
        predictions.append(
            SurfaceResponse(
                surface, names, known[0], prior, known[1], known[2], between, float(np.ptp(moved))
            )
        )
    frequencies = omega / (2 * np.pi)
    wave = Multisine(tuple(frequencies.tolist()), tuple(amplitudes.tolist()), tuple(phases.tolist()))
    return Made(wave, tuple(predictions), gap)


def _period(problem: DesignProblem, seconds: float) -> float:
    """The usual period, or the one next to it of which `seconds` are a whole number [s]."""
    usual = max(PERIOD, 1 / problem.budget.lowest)
    return seconds / max(1, floor(seconds / usual + 1e-9))


def _harmonics(problem: DesignProblem, seconds: float) -> Harmonics:
    """Those of the period that lie in the band; of many, every second, third or so."""
    budget, period = problem.budget, _period(problem, seconds)
    first, last = max(ceil(budget.lowest * period - 1e-9), 1), floor(budget.highest * period + 1e-9)
    if last <= first:
        raise InputError(
            f"a multisine of {seconds:g} s has fewer than two frequencies between {budget.lowest:g} and "
            f"{budget.highest:g} Hz; make it longer or the band wider"
        )
    return np.arange(first, last + 1, ceil((last - first + 1) / _MOST))
