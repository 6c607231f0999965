"""Which contact model's parameters are given: the plain one, unless a richer one earns its place.

The model is linearised; its columns are weighted by octave beside columns of other forces, and the budget says what
each cause may do. The lag of the force is a column with a prior, never a free number; the columns are formed again
about what is found until it rests.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Mask
from palpate.errors import InputError
from palpate.identification import models
from palpate.identification.estimators.budget import TOUCH, Answer, of_another
from palpate.identification.estimators.linearisation import Linearisation, lag_open
from palpate.identification.estimators.octaves import Solution, estimate, held, segments_of, solve
from palpate.identification.filters import Chain
from palpate.identification.options import LAG, Options
from palpate.identification.problem import Problem
from palpate.identification.result import Comparison

_ROUNDS = 12
_STARTS = 9
"""Lags at most that a search may begin from."""
_FOUND = 0.25
"""Share of its deviation by which a surface, a lag or a nonlinear parameter may still move: it adds a sixteenth to the
variance."""


def answer(problem: Problem, model: models.Model) -> Answer:
    """Fit a model and find how far to trust each parameter.

    Raises:
        InputError: the stretches in contact are too short.
    """
    local, solution = _in_contact(problem, model)
    plain = local.answer(solution)
    wider = None if model.nonlinear else problem.with_approach
    found = None if wider is None else _over_approach(wider, problem.in_contact, local, solution)
    if found is None:
        return plain
    apart = of_another(found.theta, found.budget, plain.theta, plain.budget)  # it alone rests on the approach
    found = replace(found, budget={**found.budget, "touch": apart})
    return found if found.half_of("K") < plain.half_of("K") else plain


def _in_contact(problem: Problem, model: models.Model) -> tuple[Linearisation, Solution]:
    """Over the rows in contact; the lag looked for within its prior, the columns formed again at each."""
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        raise InputError("every stretch in contact is too short; log longer or faster")
    about: dict[str, float] = {}
    if problem.lag.std > 0 and not model.nonlinear:  # its column needs parameters that are roughly right
        exact = Linearisation.of(replace(problem, lag=replace(problem.lag, std=0.0)), model, segments, {})
        about = dict(zip(exact.names, estimate(exact.system).theta.tolist(), strict=True))
    starts = _starts(Linearisation.of(problem, model, segments, about))
    best, _ = min((_descent(start) for start in starts), key=lambda found: found[1])
    return best, estimate(best.system)


def _descent(start: Linearisation) -> tuple[Linearisation, float]:
    """The likeliest linearisation, its columns formed again about what is found until it rests, and its misfit."""
    best = local = start
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
        about = best.moved(theta, step)
        local = Linearisation.of(start.problem, start.model, start.segments, about, best.use)
    return best, least


def _starts(local: Linearisation) -> list[Linearisation]:
    """Lags within two deviations of the prior that are likelier than their neighbours, a radian of the motion away.

    Nearer to each other no two lags fit, one by taking a mass or a damping for the other.
    """
    problem, lag = local.problem, local.problem.lag
    reach = 2 * lag.std
    count = 1 + int(np.ceil(4 * np.pi * reach * problem.band)) if np.isfinite(problem.band) else 0
    if lag.std == 0 or count < 3:  # all of them are about where it starts
        return [local]
    fixed = {name: value for name, value in local.at.items() if name != LAG}
    tried, misfits = [], [np.inf]
    for at in np.linspace(lag.value - reach, lag.value + reach, min(count, _STARTS)):
        about = fixed | {LAG: float(at)}
        other = Linearisation.of(problem, local.model, local.segments, about, local.use)
        here = held(other.system, other.searched)
        misfits.append(other.misfit(here))
        tried.append(dict(zip(other.names, here.theta.tolist(), strict=True)))
    beside = zip(tried, misfits, misfits[1:], [*misfits[2:], np.inf], strict=False)
    least = [about for about, before, own, after in beside if own < before and own <= after]
    return [Linearisation.of(problem, local.model, local.segments, about, local.use) for about in least]


def _over_approach(problem: Problem, inside: Mask, known: Linearisation, found: Solution) -> Answer | None:
    """Over the approach too: how the force rises from nothing tells most of a press that then rests.

    The surface is looked for: what a wrong place of it does is a force that is there at once with the touch. None if it
    is not found. The problem has the rows of the approach; samples of its position that are in contact are `inside`,
    and the linearisation over the rows in contact and its answer are known.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    at = problem.motion.instants.astype(np.intp)
    way = problem.motion.position[at[~inside[at]]]  # in which the surface lies
    theta = dict(zip(known.names, found.theta, strict=True))
    surface, use = 0.0, None
    for _ in range(_ROUNDS if len(way) else 0):
        motion = models.from_surface(problem.motion, inside, surface)
        local = Linearisation.of(
            replace(problem, motion=motion), known.model, segments, theta | {LAG: known.lag}, use
        )
        use = local.use  # else an octave that comes and goes keeps the surface from resting
        solution = estimate(local.system)
        theta = dict(zip(local.names, solution.theta, strict=True))
        i = local.names.index(TOUCH)
        if theta["K"] <= 0:
            return None
        if theta[TOUCH] ** 2 < _FOUND**2 * solution.cov[i, i]:
            return local.answer(solution)
        step = -theta[TOUCH] / theta["K"]
        surface += float(np.clip(step, (way.min() - surface) / 2, (way.max() - surface) / 2))
    return None


_ADDED = {
    "standard-linear-solid": ("K1", "tau"),
    "hunt-crossley": ("n",),
    "quasi-linear-viscoelastic": ("n", "K1", "tau"),
}
_MAKERS = dict(
    zip(_ADDED, (models.standard_linear_solid, models.hunt_crossley, models.quasi_linear), strict=True)
)


@dataclass(frozen=True)
class Choice:
    """The model chosen.

    Args:
        answer: its parameters.
        problem: the rows that it was fitted to.
        tried: every model, and the comment on it.
    """

    answer: Answer
    problem: Problem
    tried: tuple[Comparison, ...]


def choose(problem: Problem, options: Options) -> Choice:
    """Answer the plain model, and a richer one if it is asked for or earns its place.

    A richer model earns it by explaining at least half of what any plainer one leaves, with everything that it has more
    of identified: what a log cannot tell of it never hides what the plain model shows. Of a press at constant speed the
    force by a plain one is that of least squares in time.
    """
    name, series = options.model, options.series_stiffness
    if name in _MAKERS:
        if series is not None:
            raise InputError(
                f"{name} is not available with a series stiffness: use --model kelvin-voigt-mass"
            )
        rich, own = _one_sided(_MAKERS[name], problem)
        return Choice(rich, own, (_comparison_of(rich, "asked for"),))
    plain = models.KELVIN_VOIGT if name == models.KELVIN_VOIGT.name else models.KELVIN_VOIGT_MASS
    best, at = answer(problem, plain), problem
    told, left = best.explained, best.unexplained
    if problem.contacts.press is not None:
        best = replace(best, fit=best.fit.in_time(best.problem.motion, best.problem.force))
    tried = [_comparison_of(best, "")]
    noise = float(np.sqrt(max(best.noise, 0.0))) + _between_readings(problem)
    if name is None and series is None and left > noise:
        # A power of the depth needs the place of the surface, and looks like a lag that nobody has told.
        one_sided = problem.with_touches is not None and not lag_open(problem)
        for make in (
            models.standard_linear_solid,
            *([models.hunt_crossley, models.quasi_linear] if one_sided else []),
        ):
            rich, own = _one_sided(make, problem)
            why = _against(rich, told, options.tolerance)
            told = max(told, rich.explained)
            tried.append(_comparison_of(rich, why))
            if not why:
                best, at = rich, own
    return Choice(best, at, tuple(tried))


def _one_sided(make: Callable[..., models.Model], problem: Problem) -> tuple[Answer, Problem]:
    """A model with the place of the surface in it, fitted to the touches too where the log has them."""
    wider = problem.with_touches
    if wider is None:
        model = make(problem.motion)
        return answer(problem, models.begun_before(model) if "K1" in model.linear else model), problem
    return answer(wider, models.at_rest_before(make(wider.motion))), wider


def _against(rich: Answer, told: float, tolerance: float) -> str:
    """Why a richer model is not taken; empty if it is. `told` is the share that those before it explain at most."""
    if (1 - rich.explained) > 0.5 * (1 - told):
        return "explains less than half of a simpler model's residual"
    for parameter in rich.fit.model.nonlinear:
        if not parameter.low < rich.fit[parameter.name] < parameter.high:
            return f"its {parameter.name} is outside the range that the log can show"
    for name in ("K", *_ADDED[rich.fit.model.name]):
        value, half = rich[name], rich.half_of(name)
        known = half <= tolerance * abs(value) and (name != "n" or abs(value - 1) > half)
        if value <= 0 or not known:
            return f"the log does not show its {name} ({value:.3g} +- {half:.2g})"
    return ""


def _between_readings(problem: Problem) -> float:
    """Force that straight lines between readings may be off by where a lag that nobody knows moves them [N].

    Of a sine, (omega dt)^2/8 of its amplitude; omega is that of the fastest motion that the filter passes.
    """
    chain = problem.motion.chain
    if not lag_open(problem) or not isinstance(chain, Chain):
        return 0.0
    fastest = min(problem.band, chain.cutoff)
    return float((2 * np.pi * fastest * chain.dt) ** 2 / 8 * np.std(problem.force))


def _comparison_of(found: Answer, note: str) -> Comparison:
    return Comparison(found.fit.model.name, found.fit.r2, found.fit.rmse, note)
