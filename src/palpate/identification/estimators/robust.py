"""A model's parameters and how far each may be off, whatever else is in the log.

The model is linearised; its columns are weighted by octave beside columns of other forces, and the budget says what
each cause may do. The lag of the force is a column with a prior, never a free number; the columns are formed again
about what is found until it rests.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.arrays import Mask
from palpate.errors import InputError
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.answer import Answer
from palpate.identification.estimators.by_octave import Solution, estimate, held, solve
from palpate.identification.estimators.effects import TOUCH
from palpate.identification.estimators.linearisation import Linearisation
from palpate.identification.estimators.octaves import segments_of
from palpate.identification.models import Model, from_surface
from palpate.identification.prior import LAG
from palpate.identification.problem import Problem

_ROUNDS = 12
_STARTS = 9
"""Lags at most that a search may begin from."""
_FOUND = 0.25
"""Share of its deviation by which a surface, a lag or a nonlinear parameter may still move: it adds a sixteenth to the
variance."""


def answer(problem: Problem, model: Model) -> Answer:
    """Fit a model and find how far to trust each parameter.

    Raises:
        InputError: the stretches in contact are too short.
    """
    local, solution = _in_contact(problem, model)
    plain = local.answered(solution)
    wider = None if model.nonlinear else problem.with_approach
    found = None if wider is None else _over_approach(wider, problem.in_contact, local, solution)
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


def _in_contact(problem: Problem, model: Model) -> tuple[Linearisation, Solution]:
    """Over the rows in contact; the lag looked for within its prior, the columns formed again at each."""
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        raise InputError("every stretch in contact is too short; log longer or faster")
    about: dict[str, float] = {}
    if problem.lag.std > 0 and not model.nonlinear:  # its column needs parameters that are roughly right
        exact = Linearisation.of(replace(problem, lag=replace(problem.lag, std=0.0)), model, segments, {})
        about = dict(zip(exact.names, estimate(exact.system).theta.tolist(), strict=True))
    best = local = _start(Linearisation.of(problem, model, segments, about))
    places, least = list(local.searched), np.inf
    for _ in range(_ROUNDS if places else 0):
        here = held(local.system, local.searched)
        misfit = local.misfit(here)
        if misfit < least:
            best, least, theta = local, misfit, here.theta
            asked = solve(local.system, here.noise)
            step = asked.theta[places] - theta[places]
            rests = _FOUND * np.sqrt(np.diag(asked.cov)[places])
        else:  # beyond the linearisation's reach
            step = step / 2
        if np.all(np.abs(step) <= rests):
            break
        local = Linearisation.of(problem, model, segments, best.moved(theta, step))
    return best, estimate(best.system)


def _start(local: Linearisation) -> Linearisation:
    """The likeliest of some lags within two deviations of the prior, a radian of the fastest motion apart at most.

    Nearer to each other no two lags fit, one by taking a mass or a damping for the other.
    """
    problem, lag = local.problem, local.problem.lag
    if lag.std == 0:
        return local
    if not np.isfinite(problem.band):
        return local
    reach = 2 * lag.std
    count = 1 + int(np.ceil(2 * reach * 2 * np.pi * problem.band))
    if count < 3:  # all of them are about where it starts
        return local
    fixed = {name: local.at[name] for name in local.at if name != LAG}
    likeliest = local
    least = local.misfit(held(local.system, local.searched))
    for at in np.linspace(lag.value - reach, lag.value + reach, min(count, _STARTS)):
        other = Linearisation.of(problem, local.model, local.segments, fixed | {LAG: float(at)})
        here = held(other.system, other.searched)
        misfit = other.misfit(here)
        if misfit < least:
            likeliest, least = other, misfit
            about = dict(zip(other.names, here.theta.tolist(), strict=True))
    if likeliest is local:
        return local
    return Linearisation.of(problem, local.model, local.segments, about)


def _over_approach(problem: Problem, inside: Mask, known: Linearisation, found: Solution) -> Answer | None:
    """Over the approach too: how the force rises from nothing tells most of a press that then rests.

    The surface is looked for: what a wrong place of it does is a force that is there at once with the touch.

    Args:
        problem: with the rows of the approach.
        inside: samples of the position that are in contact.
        known: what it is over the rows in contact.
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
        local = Linearisation.of(
            replace(problem, motion=motion), known.model, segments, theta | {LAG: known.lag}
        )
        solution = estimate(local.system)
        theta = dict(zip(local.names, solution.theta, strict=True))
        i = local.names.index(TOUCH)
        if theta["K"] <= 0:
            return None
        if theta[TOUCH] ** 2 < _FOUND**2 * solution.cov[i, i]:
            return local.answered(solution)
        step = -theta[TOUCH] / theta["K"]
        surface += float(np.clip(step, (way.min() - surface) / 2, (way.max() - surface) / 2))
    return None
