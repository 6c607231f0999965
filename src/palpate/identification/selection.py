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
from palpate.identification.budget import TOUCH, FittedParameters, contradiction_spread
from palpate.identification.filters import Chain
from palpate.identification.linearisation import Linearisation, lag_open
from palpate.identification.octaves import Solution, estimate, estimate_with_fixed, solve
from palpate.identification.options import LAG, Options
from palpate.identification.problem import Problem
from palpate.identification.result import Comparison

_MAX_STEPS = 12
_MAX_STARTS = 9
"""Lags at most that a search may begin from."""
_CONVERGED_STDS = 0.25
"""Share of its deviation by which a surface, a lag or a nonlinear parameter may still move: it adds a sixteenth to the
variance."""


def answer(problem: Problem, model: models.Model) -> FittedParameters:
    """Fit a model and find how far to trust each parameter.

    Raises:
        InputError: the stretches in contact are too short.
    """
    local, solution = _in_contact(problem, model)
    plain = local.answer(solution)
    approach = None if model.nonlinear else problem.with_approach
    over_approach = (
        None if approach is None else _over_approach(approach, problem.in_contact, local, solution)
    )
    if over_approach is None:
        return plain
    contradiction = contradiction_spread(
        over_approach.theta, over_approach.budget, plain.theta, plain.budget
    )  # it alone rests on the approach
    over_approach = replace(over_approach, budget={**over_approach.budget, "touch": contradiction})
    return over_approach if over_approach.half_of("K") < plain.half_of("K") else plain


def _in_contact(problem: Problem, model: models.Model) -> tuple[Linearisation, Solution]:
    """Fit over the rows in contact; the lag is searched within its prior, the columns formed again at each step."""
    if not problem.segments:
        raise InputError("every stretch in contact is too short; log longer or faster")
    about: dict[str, float] = {}
    if problem.lag.std > 0 and not model.nonlinear:  # its column needs parameters that are roughly right
        exact = Linearisation.of(replace(problem, lag=replace(problem.lag, std=0.0)), model, {})
        about = dict(zip(exact.names, estimate(exact.system).theta.tolist(), strict=True))
    starts = _starts(Linearisation.of(problem, model, about))
    best, _ = min((_descent(start) for start in starts), key=lambda candidate: candidate[1])
    return best, estimate(best.system)


def _descent(start: Linearisation) -> tuple[Linearisation, float]:
    """The likeliest linearisation, its columns formed again about what is found until it rests, and its misfit."""
    best = local = start
    places = list(local.searched)
    lowest = np.inf
    for _ in range(_MAX_STEPS if places else 0):
        constrained = estimate_with_fixed(local.system, local.searched)
        misfit = local.misfit(constrained)
        if misfit < lowest:
            best = local
            lowest = misfit
            theta = constrained.theta
            solution = solve(local.system, constrained.noise)
            step = solution.theta[places] - theta[places]
            rests = _CONVERGED_STDS * np.sqrt(np.diag(solution.cov)[places])
        else:  # beyond the linearisation's reach
            step = step / 2
        if np.all(np.abs(step) <= rests):
            break
        about = best.moved(theta, step)
        local = Linearisation.of(start.problem, start.model, about, best.use)
    return best, lowest


def _starts(local: Linearisation) -> list[Linearisation]:
    """Lags within two deviations of the prior that are likelier than their neighbours, a radian of the motion away.

    Nearer to each other no two lags fit, one by taking a mass or a damping for the other.
    """
    problem = local.problem
    lag = local.problem.lag
    reach = 2 * lag.std
    count = 1 + int(np.ceil(4 * np.pi * reach * problem.band)) if np.isfinite(problem.band) else 0
    if lag.std == 0 or count < 3:  # all of them are about where it starts
        return [local]
    fixed = {name: value for name, value in local.at.items() if name != LAG}
    candidates = []
    misfits = [np.inf]
    for trial_lag in np.linspace(lag.value - reach, lag.value + reach, min(count, _MAX_STARTS)):
        linearisation = Linearisation.of(problem, local.model, fixed | {LAG: float(trial_lag)}, local.use)
        solution = estimate_with_fixed(linearisation.system, linearisation.searched)
        misfits.append(linearisation.misfit(solution))
        candidates.append(dict(zip(linearisation.names, solution.theta.tolist(), strict=True)))
    neighbourhoods = zip(candidates, misfits, misfits[1:], [*misfits[2:], np.inf], strict=False)
    minima = [
        about
        for about, before, here_misfit, after in neighbourhoods
        if here_misfit < before and here_misfit <= after
    ]
    return [Linearisation.of(problem, local.model, about, local.use) for about in minima]


def _over_approach(
    problem: Problem, inside: Mask, known: Linearisation, contact_solution: Solution
) -> FittedParameters | None:
    """Fit over the approach too: the rise of the force shows most of a press that then rests.

    The surface is looked for: what a wrong place of it does is a force that is there at once with the touch. None if it
    is not found. The problem has the rows of the approach; samples of its position that are in contact are `inside`,
    and the linearisation over the rows in contact and its answer are known.
    """
    fitted_rows = problem.motion.instants.astype(np.intp)
    approach_position = problem.motion.position[
        fitted_rows[~inside[fitted_rows]]
    ]  # in which the surface lies
    theta = dict(zip(known.names, contact_solution.theta, strict=True))
    surface, octaves_used = 0.0, None
    for _ in range(_MAX_STEPS if len(approach_position) else 0):
        motion = models.from_surface(problem.motion, inside, surface)
        local = Linearisation.of(
            replace(problem, motion=motion), known.model, theta | {LAG: known.lag}, octaves_used
        )
        octaves_used = local.use  # else an octave that comes and goes keeps the surface from resting
        solution = estimate(local.system)
        theta = dict(zip(local.names, solution.theta, strict=True))
        touch_index = local.names.index(TOUCH)
        if theta["K"] <= 0:
            return None
        if theta[TOUCH] ** 2 < _CONVERGED_STDS**2 * solution.cov[touch_index, touch_index]:
            return local.answer(solution)
        step = -theta[TOUCH] / theta["K"]
        surface += float(
            np.clip(step, (approach_position.min() - surface) / 2, (approach_position.max() - surface) / 2)
        )
    return None


_ADDED_PARAMETERS = {
    "standard-linear-solid": ("K1", "tau"),
    "hunt-crossley": ("n",),
    "quasi-linear-viscoelastic": ("n", "K1", "tau"),
}
_MAKERS = dict(
    zip(
        _ADDED_PARAMETERS,
        (models.standard_linear_solid, models.hunt_crossley, models.quasi_linear),
        strict=True,
    )
)


@dataclass(frozen=True)
class Choice:
    """The model chosen.

    Args:
        answer: its parameters.
        problem: the rows that it was fitted to.
        tried: every model, and the comment on it.
    """

    answer: FittedParameters
    problem: Problem
    tried: tuple[Comparison, ...]


def choose(problem: Problem, options: Options) -> Choice:
    """FittedParameters the plain model, and a richer one if it is asked for or earns its place.

    A richer model earns it by explaining at least half of what any plainer one leaves, with everything that it has more
    of identified: what a log cannot tell of it never hides what the plain model shows. Of a press at constant speed the
    force by a plain one is that of least squares in time.
    """
    name = options.model
    series = options.series_stiffness
    if name in _MAKERS:
        if series is not None:
            raise InputError(
                f"{name} is not available with a series stiffness: use --model kelvin-voigt-mass"
            )
        rich, rich_problem = _one_sided(_MAKERS[name], problem)
        return Choice(rich, rich_problem, (_compare(rich, "asked for"),))
    plain = models.KELVIN_VOIGT if name == models.KELVIN_VOIGT.name else models.KELVIN_VOIGT_MASS
    best = answer(problem, plain)
    chosen_problem = problem
    best_explained = best.explained
    unexplained = best.unexplained
    if problem.contacts.press is not None:
        best = replace(best, fit=best.fit.in_time(best.problem.motion, best.problem.force))
    tried = [_compare(best, "")]
    noise = float(np.sqrt(max(best.noise, 0.0))) + _between_readings(problem)
    if name is None and series is None and unexplained > noise:
        # A power of the depth needs the place of the surface, and looks like a lag that nobody has told.
        one_sided = problem.with_touches is not None and not lag_open(problem)
        for make in (
            models.standard_linear_solid,
            *([models.hunt_crossley, models.quasi_linear] if one_sided else []),
        ):
            rich, rich_problem = _one_sided(make, problem)
            objection = _against(rich, best_explained, options.tolerance)
            best_explained = max(best_explained, rich.explained)
            tried.append(_compare(rich, objection))
            if not objection:
                best, chosen_problem = rich, rich_problem
    return Choice(best, chosen_problem, tuple(tried))


def _one_sided(make: Callable[..., models.Model], problem: Problem) -> tuple[FittedParameters, Problem]:
    """A model with the place of the surface in it, fitted to the touches too where the log has them."""
    with_touches = problem.with_touches
    if with_touches is None:
        model = make(problem.motion)
        return answer(problem, models.begun_before(model) if "K1" in model.linear else model), problem
    return answer(with_touches, models.at_rest_before(make(with_touches.motion))), with_touches


def _against(rich: FittedParameters, best_explained: float, tolerance: float) -> str:
    """Why a richer model is not taken; empty if it is. `told` is the share that those before it explain at most."""
    if (1 - rich.explained) > 0.5 * (1 - best_explained):
        return "explains less than half of a simpler model's residual"
    for parameter in rich.fit.model.nonlinear:
        if not parameter.low < rich.fit[parameter.name] < parameter.high:
            return f"its {parameter.name} is outside the range that the log can show"
    for name in ("K", *_ADDED_PARAMETERS[rich.fit.model.name]):
        value = rich[name]
        half_width = rich.half_of(name)
        known = half_width <= tolerance * abs(value) and (name != "n" or abs(value - 1) > half_width)
        if value <= 0 or not known:
            return f"the log does not show its {name} ({value:.3g} +- {half_width:.2g})"
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


def _compare(fitted: FittedParameters, note: str) -> Comparison:
    return Comparison(fitted.fit.model.name, fitted.fit.r2, fitted.fit.rmse, note)
