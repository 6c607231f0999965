"""The laws that become C, each with its functions: force loop, sliding loop, contact identifier, least squares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.contact_evidence import FREE_MOTION
from palpate.force.force_loop import PHASES, SurfaceEstimate, surface_estimate
from palpate.force.gains import Gains
from palpate.force.guard import QUIET, TROUBLES, GuardedState, safe_step
from palpate.force.sliding import slide_state
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import put_vector, vector_at
from palpate.force.sliding.sliding_loop import slide_estimate, sliding
from palpate.identifiers import ContactIdentifier, RecursiveLeastSquares
from palpate.identifiers.kernels import contact_state, contact_stream
from palpate.identifiers.kernels.contact_stream import take_tick
from palpate.identifiers.kernels.dimension import Four, Three
from palpate.identifiers.kernels.least_squares import error_covariance_in
from palpate.identifiers.recursive_least_squares import absorb
from palpate_native.module import Argument, Entry, Module

FORCE, SLIDING, IDENTIFIER = "force-loop", "sliding-loop", "contact-identifier"
SQUARES = "recursive-least-squares"
LAWS = (FORCE, SLIDING, IDENTIFIER, SQUARES)
CERTAIN, AT_CONTACT, AT_SUMS = contact_state.CERTAIN, contact_stream.AT_CONTACT, contact_stream.AT_SUMS


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


def force_module(gains: Gains, notes: tuple[str, ...] = ()) -> Module:
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
    head = (f"law: {gains.law}", f"gains: {gains.digest}", *notes)
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


def sliding_module(gains: Gains, into: ArrayLike, notes: tuple[str, ...] = ()) -> Module:
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
    head = (f"law of the press: {gains.law}", f"gains: {gains.digest}", *notes)
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
    """Recursive least squares of three or four parameters, from where the estimator stands.

    Raises:
        InputError: of another number of parameters.
    """
    n = len(estimator.names)
    if n not in (3, 4):
        raise InputError(f"C has least squares of 3 or 4 parameters, got {n}: give --parameters 3 or 4")
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


@part
class IdentifierNumbers(NamedTuple):
    """The weights with which the position is read through the force sensor's low-pass.

    Args:
        weights: of acceleration, velocity and position, by the fraction of a tick.
    """

    weights: Array


@law
def identifier_update(gains, state, position, force, samples):
    """Takes a tick in, and counts the samples that came through."""
    return take_tick(state, gains.weights, position, force, samples)


@law
def identifier_estimate(gains, state, theta):
    """M, B, K and the offset, by plain least squares over all samples of contacts."""
    for i in range(4):
        theta[i] = state[AT_CONTACT + CERTAIN + i]


@law
def identifier_contact(gains, state):
    """Whether the tip is in contact."""
    return state[AT_CONTACT + contact_state.TOUCHING] > 0.0


def identifier_module(identifier: ContactIdentifier) -> Module:
    """A contact identifier, from where it stands."""
    rows = (2 * int(identifier._state[contact_stream.ROOM]), 5)
    update = (
        Argument("position", "of the tip, growing into the surface; NAN where it is missing [m]"),
        Argument("force", "on the surface; NAN where it is missing [N]"),
        Argument("samples", f"at most {rows[0]} rows of a, v, x, 1 and force", rows, out=True),
    )
    theta = Argument("theta", "M [kg], B [N s/m], K [N/m] and the offset [N]", (4,), out=True)
    entries = (
        Entry(
            "update", identifier_update, "Takes a tick in; how many samples of contacts came through.", update
        ),
        Entry(
            "estimate", identifier_estimate, "Plain least squares over the samples of all contacts.", (theta,)
        ),
        Entry(
            "in_contact", identifier_contact, "Whether the tip is in contact, some ticks ago at the latest."
        ),
    )
    numbers = IdentifierNumbers(identifier._weights)
    state = identifier._state
    notes = (f"low-pass: {identifier.low_pass}, at {identifier.rate:g} Hz",)
    return Module("palpate_identifier", "identifies a contact on line", numbers, state, entries, {}, notes)
