"""The laws that become C, each with its functions: force loop, sliding loop, least squares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate.force.contact_evidence import FREE_MOTION
from palpate.force.force_loop import PHASES, SurfaceEstimate, surface_estimate
from palpate.force.gains import Gains
from palpate.force.guard import QUIET, TROUBLES, GuardedState, safe_step
from palpate.force.sliding import slide_state
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import put_vector, vector_at
from palpate.force.sliding.sliding_loop import slide_estimate, sliding
from palpate.identifiers import RecursiveLeastSquares
from palpate.identifiers.dimension import Four, Three
from palpate.identifiers.least_squares import error_covariance_in
from palpate.identifiers.recursive_least_squares import absorb
from palpate.native.module import Argument, Entry, Module

FORCE, SLIDING, SQUARES = "force-loop", "sliding-loop", "recursive-least-squares"
LAWS = (FORCE, SLIDING, SQUARES)


@law
def force_init(gains):
    """The tip in free motion, with nothing known of the surface."""
    return GuardedState(gains.start(), QUIET)


@law
def force_update(gains, state, desired, force, position, missed):
    """One tick: the speed [m/s] and both states after it."""
    return safe_step(gains, state.law, state.guard, desired, force, position, missed)


@law
def force_estimate(gains, state):
    """The surface as it is known; zeros, but for the bound, in free motion and until there is an estimate."""
    estimate, bound = state.law.estimate, state.law.bound.used
    if state.law.stage.phase == FREE_MOTION or estimate.std.x == 0.0:
        return SurfaceEstimate(0.0, 0.0, 0.0, 0.0, bound)
    return surface_estimate(gains.cap, gains.theta, estimate.value, estimate.std, bound)


def force_module(gains: Gains) -> Module:
    """The force loop of some gains."""
    arguments = (
        Argument("desired", "F_d, the force to press with [N]"),
        Argument("force", "on the surface, positive where it presses [N]"),
        Argument(
            "position", "of the tip along the normal by the arm's encoders, growing into the surface [m]"
        ),
        Argument("missed", "ticks that were lost since the last call"),
    )
    entries = (
        Entry("update", force_update, "One tick: the speed of the commanded position [m/s].", arguments),
        Entry(
            "estimate", force_estimate, "The surface; zeros, but for the bound, while there is no estimate."
        ),
    )
    words = {"phase": (("law", "stage", "phase"), PHASES), "trouble": (("guard", "trouble"), TROUBLES)}
    head = (f"law: {gains.law}", f"gains: {gains.digest}")
    return Module(
        "palpate_force", "presses with a desired force", gains.cautious(), force_init, entries, words, head
    )


@law
def slide_init(gains, state):
    """In free motion, knowing nothing but a direction into the surface."""
    gains.start(state)


@law
def slide_update(gains, state, desired, force, position, direction, missed, velocity):
    """One tick of a slide: the velocity [m/s]."""
    work = np.empty(10)
    v = slide_step(
        gains,
        state,
        work,
        desired,
        vector_at(force, 0),
        vector_at(position, 0),
        vector_at(direction, 0),
        missed,
    )
    put_vector(velocity, 0, v)


@law
def slide_known(gains, state):
    """The surface as it is known."""
    return slide_estimate(state)


@law
def slide_sliding(gains, state):
    """Whether the force was held and the tip slides."""
    return state[slide_state.PHASE] == slide_state.SLIDE


def sliding_module(gains: Gains, into: ArrayLike) -> Module:
    """The sliding loop of gains that have numbers for a slide."""
    axes = ", x, y, z in the base's axes"
    arguments = (
        Argument("desired", "F_d, the normal force to hold [N]"),
        Argument("force", f"on the surface{axes} [N]", (3,)),
        Argument("position", f"of the tip by the arm's encoders{axes} [m]", (3,)),
        Argument(
            "direction", f"in which to slide{axes}: a unit vector, or a shorter one for a slower slide", (3,)
        ),
        Argument("missed", "ticks that were lost since the last call"),
        Argument("velocity", f"of the commanded position{axes} [m/s]", (3,), out=True),
    )
    entries = (
        Entry("update", slide_update, "One tick: the velocity of the commanded position.", arguments, True),
        Entry("estimate", slide_known, "The surface; zeros, but for the normal, before a slide."),
        Entry("is_sliding", slide_sliding, "Whether the force was held and the tip slides."),
    )
    words = {"trouble": ((f"numbers[{slide_state.TROUBLE}]",), slide_state.SLIDING_TROUBLES)}
    head = (f"law of the press: {gains.law}", f"gains: {gains.digest}")
    title = "holds a force along an unknown curved surface"
    numbers = sliding(gains, into)
    return Module("palpate_slide", title, numbers, slide_init, entries, words, head, slide_state.SIZE)


@part
class SquaresNumbers(NamedTuple):
    """Settings of recursive least squares.

    Args:
        forgetting: the policy.
        size: how many parameters there are.
    """

    forgetting: Any
    size: Any


@law
def squares_update(gains, state, regressor, force):
    """Takes a sample in; false where it is none, and nothing changes."""
    _, variance = absorb(state, regressor, force, gains.forgetting, gains.size)
    return variance > 0.0


@law
def squares_estimate(gains, state, theta, covariance):
    """The estimate, and the covariance that the residuals' size and correlation give it."""
    size = gains.size
    size.put_vector(theta, 0, size.vector(state, 0))
    size.put_matrix(covariance, 0, error_covariance_in(state, size).covariance(float(size.n)))


def squares_module(estimator: RecursiveLeastSquares) -> Module:
    """Recursive least squares of three or four parameters, from where the estimator stands."""
    n = len(estimator.names)
    update = (
        Argument("regressor", f"the {n} regressors", (n,)),
        Argument("force", "that they explain [N]"),
    )
    estimate = (
        Argument("theta", "the estimate", (n,), out=True),
        Argument("covariance", "of it, row by row", (n * n,), out=True),
    )
    entries = (
        Entry(
            "update", squares_update, "Takes a sample in; false if it is none: a number not finite.", update
        ),
        Entry("estimate", squares_estimate, "The estimate and its covariance.", estimate),
    )
    numbers = SquaresNumbers(estimator.forgetting, Three() if n == 3 else Four())
    state, notes = estimator._state.copy(), (f"parameters: {n}",)
    return Module("palpate_squares", "estimates parameters on line", numbers, state, entries, {}, notes)
