"""What speaks against a model that has been fitted to a log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.fit import Fit
from palpate.identification.held_out import foretold, held_out
from palpate.identification.models import Motion, on_rows
from palpate.identification.parts import Disagreement, compare_parts
from palpate.identification.prior import Lag
from palpate.identification.residuals import Whiteness, whiteness
from palpate.identification.touch import Touch

Array = NDArray[np.float64]

MUCH_BETTER = 0.5
"""A model with more than this share of the best one's squared misfit does not describe the log, if it misses at all."""
NEGLIGIBLE = 0.0005
"""Share of the force's variance below which a misfit asks for no richer model."""
_ABOVE_NOISE = 3.0
_UNEXPLAINED = 0.01
_SLOW_UNEXPLAINED = 0.04
_SLOW = 0.35
_LARGER = 1.5
"""Times the noise out of contact that a slow misfit must be: noise may be slow itself."""
_SIGNIFICANT = 3.0
_CHAIN_CORRELATION = 2 * 2.3
"""Integral of the autocorrelation of white noise behind the filter chain, in its time constants."""
_CHAIN_MEMORY = 8.0
"""Time constants of the filter chain after which white noise behind it has forgotten itself."""


@dataclass(frozen=True)
class Question:
    """What all candidates are judged on.

    Args:
        motion, force: the filtered log; force of shape (n,).
        spans: number of the contact that each row belongs to, shape (n,).
        lag: what is known about it.
        tolerance: largest half-width of an identified parameter's interval, as a share of its value.
        free_noise: deviation of the filtered force out of contact [N]; None if it is never out of contact.
        touch: the same log with its touches in it; None if there is none in it.
        origin, position_sign: the motion is `position_sign * position - origin` [m].
        resting: force that has been taken off the readings [N].
        inside: of a question with touches, which rows are in contact proper, shape (n,); None for all.
    """

    motion: Motion
    force: Array
    spans: NDArray[np.intp]
    lag: Lag
    tolerance: float
    free_noise: float | None
    touch: Touch | None = None
    origin: float = 0.0
    position_sign: float = 1.0
    resting: float = 0.0
    inside: NDArray[np.bool_] | None = None

    @property
    def with_touches(self) -> Question | None:
        """The same question on the rows that hold the touches."""
        if self.touch is None:
            return None
        touch = self.touch
        wider = on_rows(self.motion, touch.rows)
        return replace(
            self,
            motion=wider,
            force=touch.force,
            spans=touch.spans,
            touch=None,
            resting=touch.resting,
            inside=touch.inside,
        )


@dataclass(frozen=True)
class Candidate:
    """A fitted model and what speaks against it.

    Args:
        fit: of the model.
        question: whose rows it was fitted to.
        against: what speaks against it, in words.
        disagreements: of the log's parts.
    """

    fit: Fit
    question: Question
    against: tuple[str, ...] = ()
    disagreements: tuple[Disagreement, ...] = ()

    @property
    def label(self) -> str:
        """The model's name and what it has beyond it."""
        names = self.fit.names
        extra = (("K3", "a curved spring"), ("Fc", "friction"))
        more = [words for name, words in extra if name in names]
        if "n" in names and "K1" in names:
            more.append("relaxation")
        return f"{self.fit.model.name} with {' and '.join(more)}" if more else self.fit.model.name

    @property
    def rmse(self) -> float:
        """Rms misfit in contact [N]."""
        return self._rms(self.fit.residuals)

    @cached_property
    def held_out(self) -> float:
        """Rms of what is missed in contact where the parameters are those of other rows [N]."""
        return self._rms(held_out(self.fit, self.question.motion))

    @cached_property
    def foretold(self) -> float:
        """Rms of what is missed of holding and unloading in contact by what loading alone gives [N]."""
        return self._rms(foretold(self.fit, self.question.motion, self.question.force))

    @cached_property
    def whiteness(self) -> Whiteness:
        """Of the residuals in contact, so far apart that the filters' own memory is gone."""
        motion = self.question.motion
        if motion.matched:
            return whiteness(self._inside(self.fit.residuals))
        step = _CHAIN_MEMORY / (motion.chain.rate * motion.chain.dt * _spacing(motion))
        return whiteness(self._inside(self.fit.residuals)[:: max(round(step), 1)])

    def score(self, effective: float) -> float:
        """Schwarz's criterion for a common number of effective samples: smaller is better."""
        mean_square = max(self.rmse**2, 1e-300)
        return effective * float(np.log(mean_square)) + len(self.fit.names) * float(np.log(effective))

    def _inside(self, values: Array) -> Array:
        return values if self.question.inside is None else values[self.question.inside]

    def _rms(self, values: Array) -> float:
        return float(np.sqrt(np.mean(self._inside(values) ** 2)))


def _spacing(motion: Motion) -> int:
    """Samples from row to row."""
    return int(np.median(np.diff(motion.rows)))


def judge(fits: list[tuple[Fit, Question]]) -> list[Candidate]:
    """Say of each fitted model, fitted to its question's rows, what speaks against it."""
    plain = [Candidate(fitted, question) for fitted, question in fits]
    return [judged(one, plain) for one in plain]


def judged(one: Candidate, rivals: list[Candidate]) -> Candidate:
    """The candidate with what speaks against it, its rivals included."""
    fitted, question = one.fit, one.question
    against = [f"{name} would be below zero" for name in below_zero(fitted)]
    winner = _winner(one, rivals)
    if winner:
        share = winner.rmse**2 / one.rmse**2
        against.append(f"{winner.label} fits with {share:.0%} of the squared misfit")
    against += _not_noise(fitted, question)
    parts = compare_parts(fitted, question.motion, question.force, question.spans, question.tolerance)
    if winner and _bistable(winner.fit):
        middle, whole = winner.fit["K"], fitted["K"]
        parts.append(Disagreement("K", {"the middle": middle, "the whole": whole}, abs(whole - middle)))
    against += [_said(part) for part in parts]
    return replace(one, against=tuple(against), disagreements=tuple(parts))


def below_zero(fitted: Fit) -> list[str]:
    """Parameters below zero by more than chance, which no passive surface has."""
    known = [name for name in fitted.model.positive if name in fitted.names]
    return [n for n in known if fitted[n] + _SIGNIFICANT * fitted.std(n, lag_known=not fitted.matched) < 0]


def _bistable(fitted: Fit) -> bool:
    """Whether only its stiffness is below zero, about the middle of a curve that rises further out.

    A structure that snaps through does that; it is passive as a whole, and no other model describes it.
    """
    return below_zero(fitted) == ["K"] and "K3" in fitted.names and fitted["K3"] > 0


def _winner(one: Candidate, rivals: list[Candidate]) -> Candidate | None:
    """The best rival, if it is so much better that the one does not describe the log; the simplest of equals."""
    possible = [rival for rival in rivals if not below_zero(rival.fit) or _bistable(rival.fit)]
    best = min((rival.rmse for rival in possible), default=np.inf)
    if not (best**2 < MUCH_BETTER * one.rmse**2 and 1 - one.fit.r2 > NEGLIGIBLE):
        return None
    return min((rival for rival in possible if rival.rmse == best), key=lambda rival: len(rival.fit.names))


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
    white = question.motion.duration * chain.rate / _CHAIN_CORRELATION
    slow = fitted.noise.effective < _SLOW * white and fitted.rmse > _LARGER * noise
    if left > _SLOW_UNEXPLAINED and slow:
        return [f"its misfit ({left:.0%} of the force's variance) is too slow for noise"]
    return []


def _said(part: Disagreement) -> str:
    values = ", ".join(f"{value:.3g} in {label}" for label, value in part.parts.items())
    return f"{part.name} is {values}"
