"""Which contact model a log speaks for, and whether it speaks for any."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import unknown
from palpate.identification.estimators.fit import Fit, fit
from palpate.identification.estimators.least_squares import solve
from palpate.identification.judging import (
    MUCH_BETTER,
    NEGLIGIBLE,
    Candidate,
    Question,
    below_zero,
    judge,
    judged,
)
from palpate.identification.lagging import freed
from palpate.identification.models import (
    CURVED,
    CURVED_MASS,
    KELVIN_VOIGT,
    KELVIN_VOIGT_MASS,
    NAMES,
    Model,
    at_rest_before,
    direction,
    hunt_crossley,
    relaxing,
    standard_linear_solid,
    with_friction,
    without_noise,
)
from palpate.identification.parts import halves
from palpate.identification.residuals import whiteness
from palpate.identification.unknown_lag import over_all_lags

__all__ = ["Candidate", "Choice", "Question", "choose", "with_mass"]

Array = NDArray[np.float64]
Tried = tuple[Fit, Question]

_BETTER = 0.7
"""A richer model must leave less than this share of the mean square, where it was not fitted, to be preferred."""
_HOPELESS = 4.0
"""A model whose misfit is this many times the best one's is not saved by any lag. One with a mass below zero does not
count as the best: to a damper, a lag of the force looks like that."""
_BOTH_WAYS = 0.1
"""Share of the rows that must go either way for friction to be told from an offset."""
_CLEARLY = 0.5
"""Of `direction`, where a row goes one way."""
_TOO_FREE = "an exponent and a relaxation together are more than a press can tell apart"
_MANY = 20_000
"""Rows beyond which a probe fixed to the surface is not tried for relaxation unasked: it takes long."""


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
        name: a model to hold to, None to choose, among those that nothing speaks against, by what they predict of rows
            they were not fitted to and by Schwarz's criterion.

    Raises:
        InputError: there is no model of this name.
    """
    if name is not None and name not in NAMES:
        raise unknown("model", name, NAMES)
    tried = [_tried(model, question) for model in (KELVIN_VOIGT, KELVIN_VOIGT_MASS)]
    if _unexplained(tried, question, name):
        tried += _richer(question, name)
        tried += _rubbing(tried, question)
    possible = [fitted.rmse for fitted, _ in tried if not below_zero(fitted)]
    near = _HOPELESS * min(possible, default=np.inf)
    tried = [(_freed(fitted, own) if fitted.rmse <= near else fitted, own) for fitted, own in tried]
    every = tuple(judge(tried))
    candidates = [c for c in every if name in (None, c.fit.model.name)]
    fine = [c for c in candidates if not c.against and (name is not None or _needed(c.fit))]
    if fine:
        return Choice(_best(fine), False, every)
    return _no_model(_least_bad(candidates, question), every, question)


def _tried(model: Model, question: Question) -> Tried:
    own = replace(question, motion=without_noise(question.motion)) if model.of_power else question
    return fit(model, own.motion, own.force, own.lag), own


def _freed(fitted: Fit, question: Question) -> Fit:
    motion, lag = question.motion, question.lag
    if motion.matched:
        open_mass = "M" in fitted.names and lag.mass is None and not fitted.model.knobs
        return over_all_lags(fitted, motion, question.force, lag) if open_mass and not lag.known else fitted
    return freed(fitted, motion, question.force, lag)


def _unexplained(tried: list[Tried], question: Question, name: str | None) -> bool:
    """Whether the plain models leave anything to explain, or another one is asked for."""
    if name is not None and name not in (KELVIN_VOIGT.name, KELVIN_VOIGT_MASS.name):
        return True
    if question.motion.matched:
        return not any(whiteness(fitted.residuals).white for fitted, _ in tried)
    return name is not None or min(1 - fitted.r2 for fitted, _ in tried) > NEGLIGIBLE


def _richer(question: Question, name: str | None) -> list[Tried]:
    """The models worth trying beside the plain ones: for a probe that leaves the surface, or one fixed to it."""
    motion = question.motion
    if motion.bonded:
        models = [CURVED, CURVED_MASS]
        if len(motion.rows) < _MANY or name == "standard-linear-solid":
            models.append(standard_linear_solid(motion))
        if name == "hunt-crossley":
            models.append(hunt_crossley(motion))
        return [_tried(model, question) for model in models]
    return [_one_sided(make, question) for make in (standard_linear_solid, hunt_crossley)]


def _one_sided(make: Callable[..., Model], question: Question) -> Tried:
    """A model with the place of the surface in it, fitted to the touches too where the log has them."""
    wider = question.with_touches
    if wider is None:
        return _tried(make(question.motion), question)
    return _tried(at_rest_before(make(wider.motion)), wider)


def _rubbing(tried: list[Tried], question: Question) -> list[Tried]:
    """The same models with friction, where the log moves both ways and friction takes much off the misfit."""
    way = direction(question.motion)
    seen = way[question.motion.rows] if not question.motion.matched else way
    if min(float(np.mean(seen > _CLEARLY)), float(np.mean(seen < -_CLEARLY))) < _BOTH_WAYS:
        return []
    best, own = min(tried, key=lambda one: one[0].rmse)
    rubbed = own.motion.filtered(way, 0, best.lag)
    knobs = {knob.name: best[knob.name] for knob in best.model.knobs}
    columns = np.column_stack([*best.model.columns(own.motion, knobs, best.lag), rubbed])
    left = own.force - columns @ solve(columns, own.force)
    if float(left @ left) > _BETTER * float(best.residuals @ best.residuals):
        return []
    return [_tried(with_friction(fitted.model, way), mine) for fitted, mine in tried]


def _best(candidates: list[Candidate]) -> Candidate:
    """The first, unless a later one predicts better what it has not seen and is worth its parameters."""
    effective = min(candidates, key=lambda c: c.rmse).fit.noise.effective
    best = candidates[0]
    for candidate in candidates[1:]:
        better = candidate.held_out**2 < _BETTER * best.held_out**2 or _same_kind(candidate.fit, best.fit)
        if better and candidate.score(effective) < best.score(effective):
            best = candidate
    return best


def with_mass(choice: Choice, name: str | None) -> Choice:
    """The same with a mass in the model, for damping and lag are not known without one; unless a model was asked for.

    Where the force sensor's own way is known, a mass that the log does not show costs no more than an interval.
    """
    if name is not None or choice.rejected or choice.candidate.fit.model is not KELVIN_VOIGT:
        return choice
    found = [c for c in choice.others if c.fit.model is KELVIN_VOIGT_MASS and not c.against]
    return replace(choice, candidate=found[0]) if found else choice


def _needed(fitted: Fit) -> bool:
    """Whether a mass in the model is a mass at all; whether it is worth its place is for the score to say."""
    return "M" not in fitted.names or fitted["M"] > 0


def _same_kind(one: Fit, other: Fit) -> bool:
    """Whether the one has a mass beside what the other has."""
    plain = other.model.name == KELVIN_VOIGT.name
    return (
        plain and set(one.model.linear) == {*other.model.linear, "M"} and one.model.knobs == other.model.knobs
    )


def _least_bad(candidates: list[Candidate], question: Question) -> Candidate:
    """What stands in where no model describes the log: a plain one, unless another is much nearer to it.

    It must also tell from loading alone what comes after at least as well: a richer model may follow anything, but
    what is no property of the contact does not foretell.
    """
    first = candidates[0]
    if first.fit.model is not KELVIN_VOIGT:
        return first
    if question.motion.bonded:
        mass = next(c for c in candidates if c.fit.model is KELVIN_VOIGT_MASS)
        return mass if mass.rmse**2 < MUCH_BETTER * first.rmse**2 else first
    possible = [c for c in candidates[1:] if not below_zero(c.fit) and _needed(c.fit)]
    possible = [c for c in possible if c.foretold <= first.foretold]
    return _best([first, *possible])


def _no_model(candidate: Candidate, every: tuple[Candidate, ...], question: Question) -> Choice:
    """A model that does not describe the log cannot tell its lag either: the plain fit stands in, and may hold."""
    own = candidate.question
    if not question.lag.known and candidate.fit.lag != question.lag.value:
        candidate = judged(Candidate(*_tried(candidate.fit.model, own)), list(every))
        if not candidate.against:
            return Choice(candidate, False, every)
    if candidate.fit.model.name == "hunt-crossley":
        relaxed = Candidate(*_tried(relaxing(candidate.fit.model, own.motion), own), (_TOO_FREE,))
        every = (*every, relaxed)
    return Choice(candidate, True, every, halves(candidate.fit, own.motion, own.force))
