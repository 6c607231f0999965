"""Which contact model a log speaks for, and whether it speaks for any."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.errors import unknown
from palpate.identification.fitting import Fit, Lag, fit
from palpate.identification.lagging import freed
from palpate.identification.models import (
    CURVED,
    CURVED_MASS,
    KELVIN_VOIGT,
    KELVIN_VOIGT_MASS,
    NAMES,
    Model,
    Motion,
    hunt_crossley,
    standard_linear_solid,
)
from palpate.identification.parts import Disagreement, compare_parts, halves

Array = NDArray[np.float64]

_BETTER = 0.7
"""A richer model must leave less than this share of the mean square to be preferred."""
_MUCH_BETTER = 0.5
_NEGLIGIBLE = 0.0005
"""Share of the force's variance below which a misfit asks for no richer model."""
_HOPELESS = 4.0
"""A model whose misfit is this many times the best one's is not saved by any lag. One with a mass below zero does not
count as the best: to a damper, a lag of the force looks like that."""
_ABOVE_NOISE = 3.0
_UNEXPLAINED = 0.01
_SLOW_UNEXPLAINED = 0.04
_SLOW = 0.35
_SIGNIFICANT = 3.0


_CHAIN_CORRELATION = 2 * 2.3
"""Integral of the autocorrelation of white noise behind the filter chain, in its time constants."""


@dataclass(frozen=True)
class Question:
    """What all candidates are judged on.

    Args:
        motion, force: the filtered log; force of shape (n,).
        spans: number of the contact that each row belongs to, shape (n,).
        lag: what is known about it.
        tolerance: largest half-width of an identified parameter's interval, as a share of its value.
        free_noise: deviation of the filtered force out of contact [N]; None if it is never out of contact.
    """

    motion: Motion
    force: Array
    spans: NDArray[np.intp]
    lag: Lag
    tolerance: float
    free_noise: float | None


@dataclass(frozen=True)
class Candidate:
    """A fitted model and what speaks against it."""

    fit: Fit
    against: tuple[str, ...]
    disagreements: tuple[Disagreement, ...] = ()


@dataclass(frozen=True)
class Choice:
    """The model chosen.

    Args:
        candidate: its fit, and what speaks against it.
        rejected: whether it does not describe the log, and stands here because no other does.
        others: all candidates, the chosen one among them.
        halves: of a rejected model, what loading and unloading alone give: label, parameter, value.
    """

    candidate: Candidate
    rejected: bool
    others: tuple[Candidate, ...] = ()
    halves: dict[str, dict[str, float]] = field(default_factory=dict)


def choose(question: Question, name: str | None = None) -> Choice:
    """Fit the models and choose.

    Args:
        question: the log.
        name: a model to hold to, None to choose by Schwarz's criterion among those that nothing speaks against.

    Raises:
        InputError: there is no model of this name.
    """
    if name is not None and name not in NAMES:
        raise unknown("model", name, NAMES)
    motion, force, lag = question.motion, question.force, question.lag
    fits = [fit(model, motion, force, lag) for model in (KELVIN_VOIGT, KELVIN_VOIGT_MASS)]
    if name is not None or min(1 - fitted.r2 for fitted in fits) > _NEGLIGIBLE:
        fits += [fit(model, motion, force, lag) for model in _richer(question, name)]
    near = _HOPELESS * min((fitted.rmse for fitted in fits if not _impossible(fitted)), default=np.inf)
    fits = [freed(fitted, motion, force, lag) if fitted.rmse <= near else fitted for fitted in fits]
    judged = _judge(fits, question)
    if name is None:
        return _chosen(judged, question)
    asked = [c for c in judged if c.fit.model.name == name]
    fine = [c for c in asked if not c.against]
    best = min(fine, key=lambda c: len(c.fit.names)) if fine else asked[0]
    return Choice(best, False, tuple(judged)) if fine else _no_model(best, judged, question)


def _richer(question: Question, name: str | None) -> list[Model]:
    """The models worth trying beside the plain ones: for a probe that leaves the surface, or one fixed to it."""
    motion = question.motion
    makers: list[Callable[[], Model]] = []
    if motion.bonded:
        makers += [lambda: CURVED, lambda: CURVED_MASS]
    if not motion.bonded or name == "standard-linear-solid" or len(motion.rows) < 20_000:
        makers.append(lambda: standard_linear_solid(motion))
    if not motion.bonded or name == "hunt-crossley":
        makers.append(lambda: hunt_crossley(motion))
    return [make() for make in makers]


def _judge(fits: list[Fit], question: Question) -> list[Candidate]:
    possible = [fitted for fitted in fits if not _impossible(fitted)]
    best = min((fitted.rmse for fitted in possible), default=np.inf)
    return [_candidate(fitted, fits, best, question) for fitted in fits]


def _candidate(fitted: Fit, fits: list[Fit], best: float, question: Question) -> Candidate:
    against = [f"{name} would be below zero" for name in _impossible(fitted)]
    if best**2 < _MUCH_BETTER * fitted.rmse**2 and 1 - fitted.r2 > _NEGLIGIBLE:
        winner = min((f for f in fits if f.rmse == best), key=lambda f: len(f.names))
        label = winner.model.name + (" with a curved spring" if "K3" in winner.names else "")
        against.append(f"{label} fits with {best**2 / fitted.rmse**2:.0%} of the squared misfit")
    against += _not_noise(fitted, question)
    parts = compare_parts(fitted, question.motion, question.force, question.spans, question.tolerance)
    against += [_said(part) for part in parts]
    return Candidate(fitted, tuple(against), tuple(parts))


def _not_noise(fitted: Fit, question: Question) -> list[str]:
    """What a fit leaves is noise only if it is no larger than the noise out of contact, and no slower."""
    noise = question.free_noise
    if noise is None:
        return []
    left = 1 - fitted.r2
    if fitted.rmse > _ABOVE_NOISE * noise and left > _UNEXPLAINED:
        times = f"{fitted.rmse / noise:.2g} times the" if noise > 1e-6 * fitted.rmse else "far above the"
        return [f"its misfit of {fitted.rmse:.2g} N is {times} noise out of contact"]
    chain = question.motion.chain
    white = len(question.force) * chain.dt * chain.rate / _CHAIN_CORRELATION
    if left > _SLOW_UNEXPLAINED and fitted.noise.effective < _SLOW * white:
        return [f"its misfit ({left:.0%} of the force's variance) is too slow for noise"]
    return []


def _said(part: Disagreement) -> str:
    values = ", ".join(f"{value:.3g} in {label}" for label, value in part.parts.items())
    return f"{part.name} is {values}"


def _impossible(fitted: Fit) -> list[str]:
    """Parameters below zero by more than chance, which no passive surface has."""
    known = [name for name in fitted.model.positive if name in fitted.names]
    return [name for name in known if fitted[name] + _SIGNIFICANT * fitted.std(name, lag_known=True) < 0]


def _chosen(judged: list[Candidate], question: Question) -> Choice:
    fine = [c for c in judged if not c.against and _needed(c.fit)]
    if not fine:
        plain = next(c for c in judged if c.fit.model is KELVIN_VOIGT)
        mass = next(c for c in judged if c.fit.model is KELVIN_VOIGT_MASS)
        with_mass = question.motion.bonded and mass.fit.rmse**2 < _MUCH_BETTER * plain.fit.rmse**2
        return _no_model(mass if with_mass else plain, judged, question)
    effective = min(fine, key=lambda c: c.fit.rmse).fit.noise.effective
    best = fine[0]
    for candidate in fine[1:]:
        better = candidate.fit.rmse**2 < _BETTER * best.fit.rmse**2 or _same_kind(candidate.fit, best.fit)
        if better and candidate.fit.score(effective) < best.fit.score(effective):
            best = candidate
    return Choice(best, False, tuple(judged))


def _needed(fitted: Fit) -> bool:
    """Whether a mass in the model is a mass at all; whether it is worth its place is for the score to say."""
    return "M" not in fitted.names or fitted["M"] > 0


def _same_kind(one: Fit, other: Fit) -> bool:
    return one.model is KELVIN_VOIGT_MASS and other.model is KELVIN_VOIGT


def _no_model(candidate: Candidate, judged: list[Candidate], question: Question) -> Choice:
    """A model that does not describe the log cannot tell its lag either: the plain fit stands in, and may hold."""
    fitted = candidate.fit
    if not question.lag.known and fitted.lag != question.lag.value:
        fitted = fit(fitted.model, question.motion, question.force, question.lag)
        candidate = _candidate(fitted, [c.fit for c in judged], min(c.fit.rmse for c in judged), question)
        if not candidate.against:
            return Choice(candidate, False, tuple(judged))
    return Choice(candidate, True, tuple(judged), halves(fitted, question.motion, question.force))
