"""Three least-squares estimators on one contact, and a user's identifier beside a run.

The input of recursive least squares decides its estimates. The thesis filters only the acceleration and the force, so
its three channels lag differently. A matched front-end sends the position through a model of the force sensor's chain,
and all channels through one filter. The user's identifier only watches, so it is fed with the run's own rows, tick by
tick in their order.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law, part
from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.bench.summary import CONTACT
from palpate.errors import PartError
from palpate.identifiers.least_squares import LeastSquares, LeastSquaresState
from palpate.plugins import reason
from palpate.records import Record
from palpate.signals.filters import Biquad, BiquadState, Delay, History, StateVariable, StateVariableState
from palpate.signals.types import Estimate


@law
def centre(mean, value, weight):
    """Deviation from the weighted mean so far, and the mean with the new value in it."""
    deviation = value - mean
    return deviation, mean + deviation / (weight + 1.0)


@part
class MatchedState(NamedTuple):
    second: BiquadState  # the sensor's analog filter, on the position
    first: BiquadState
    delay: History
    position: StateVariableState
    force: StateVariableState


@part
class Matched(NamedTuple):
    """Regressor (acceleration, velocity, position) and force that share every lag.

    Args:
        second, first: model of the force sensor's analog low-pass at the tick's rate, in two sections.
        delay: model of its processing time and hold.
        filter: the state-variable filter that all channels go through.
    """

    second: Biquad
    first: Biquad
    delay: Delay
    filter: StateVariable

    def start_at(self, x):
        return MatchedState(
            self.second.start_at(x),
            self.first.start_at(x),
            self.delay.start_at(x),
            self.filter.start_at(x),
            self.filter.start_at(0.0),
        )

    def step(self, state, x, force):
        """(regressor, force) at this tick from the measured x [m] and the sampled force [N]."""
        late, second = self.second.step(state.second, x)
        late, first = self.first.step(state.first, late)
        late, delay = self.delay.step(state.delay, late)
        (position, rate, second_rate), channel = self.filter.step(state.position, late)
        (y, _, _), force_channel = self.filter.step(state.force, force)
        return (Vec3(second_rate, rate, position), y), MatchedState(
            second, first, delay, channel, force_channel
        )


@part
class CentringState(NamedTuple):
    mean: Vec3  # of the regressor
    force: float  # mean force [N]
    weight: float


@part
class Centring(NamedTuple):
    """Removes the offset from a linear fit: the result is exactly that of a fit with an intercept.

    Welford's update; the scale sqrt(w/(w+1)) makes the two sums of squares equal.

    Args:
        forgetting: the same as the estimator's.
    """

    forgetting: float

    def start(self):
        return CentringState(Vec3(0.0, 0.0, 0.0), 0.0, 0.0)

    def step(self, state, phi, y):
        weight = self.forgetting * state.weight
        scale = (weight / (weight + 1.0)) ** 0.5
        dphi, mean = centre(state.mean, phi, weight)
        dy, force = centre(state.force, y, weight)
        return (scale * dphi, scale * dy), CentringState(mean, force, weight + 1.0)


@law
def update_listening(listening, pressing, smooth_force, touch):
    """1 while the matched channels are data, from touch to loss; `listening` is what it was a tick ago.

    Latched: samples picked by their own noisy force would be picked for their noise, and bias the fit.
    """
    if listening == 0.0 and (pressing or smooth_force > touch):
        return 1.0
    if not pressing and smooth_force < 0.0:
        return 0.0
    return listening


@part
class EstimatorsState(NamedTuple):
    thesis: LeastSquaresState
    raw: LeastSquaresState
    matched: LeastSquaresState
    front: MatchedState
    centring: CentringState
    listening: float  # 1 once the touch was felt, until the force is gone again


@part
class Estimators(NamedTuple):
    """Recursive least squares for (M, B, K), fed in three ways.

    thesis: force through 120 Hz, acceleration through 35 Hz, velocity and displacement as they are (sec. 6);
    raw: nothing filtered (fig. 6.3); matched: every channel through the same lags, and the offset taken out.
    The first two run while the contact controller does, as in the thesis. The matched one restarts when a
    touch is felt: it would lose the first moments, which tell most, if it waited for the switch.

    Args:
        touch: filtered force from which the matched one takes the surface to be touched [N].
    """

    thesis: LeastSquares
    raw: LeastSquares
    matched: LeastSquares
    front: Matched
    centring: Centring
    touch: float

    def start_at(self, x):
        return EstimatorsState(
            self.thesis.start(),
            self.raw.start(),
            self.matched.start(),
            self.front.start_at(x),
            self.centring.start(),
            0.0,
        )

    def step(self, state, signals, pressing, x0):
        """The state after a tick; `pressing` while the contact controller runs, x0 where it took over [m]."""
        x, smooth_force = signals.sense.x.x, signals.sense.f.x
        thesis, raw, matched = state.thesis, state.raw, state.matched
        centring, listening = state.centring, state.listening
        if pressing:
            phi = Vec3(signals.smooth_acceleration, signals.velocity, x - x0)
            _, thesis = self.thesis.step(thesis, phi, smooth_force)
            phi = Vec3(signals.acceleration, signals.velocity, x - x0)
            _, raw = self.raw.step(raw, phi, signals.force)
        (phi, force), front = self.front.step(state.front, x, signals.force)
        before, listening = listening, update_listening(listening, pressing, smooth_force, self.touch)
        if listening == 1.0:
            if before == 0.0:  # anew at each touch: what noise alone once took for a touch is no data
                matched, centring = self.matched.start(), self.centring.start()
            (phi, force), centring = self.centring.step(centring, phi, force)
            _, matched = self.matched.step(matched, phi, force)
        return EstimatorsState(thesis, raw, matched, front, centring, listening)


COLUMNS = {
    "M_identifier": "kg",
    "B_identifier": "N s/m",
    "K_identifier": "N/m",
    "M_identifier_std": "kg",
    "B_identifier_std": "N s/m",
    "K_identifier_std": "N/m",
}
"""Columns of an identifier in a record: its estimate after each tick, NaN before its first sample."""


class Identifier(Protocol):
    """Any estimator of `palpate.identifiers` of the three parameters (M, B, K), or one of the user's."""

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Take one sample in: (acceleration, velocity, position), shape (3,), and the force [N]."""

    def estimate(self) -> Estimate:
        """Estimate so far of M [kg], B [N s/m], K [N/m]."""


@law
def feed(estimators, x, force, smooth_force, phase, out):
    """Rows of `out`: whether there is a sample, then its regressor and its force; all of shape (n, ...)."""
    front, centring, listening = estimators.front.start_at(x[0]), estimators.centring.start(), 0.0
    for k in range(len(x)):
        (phi, y), front = estimators.front.step(front, x[k], force[k])
        before, listening = (
            listening,
            update_listening(listening, phase[k] == CONTACT, smooth_force[k], estimators.touch),
        )
        if listening == 1.0 and before == 0.0:
            centring = estimators.centring.start()
        if listening == 1.0:
            (phi, y), centring = estimators.centring.step(centring, phi, y)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4] = listening, phi.x, phi.y, phi.z, y


compiled_feed = kernel(feed)


def watch_run(
    record: Record, identifier: Identifier, estimators: Estimators, *, compiled: bool = True
) -> Record:
    """The record with the columns of an identifier, which continues from its state.

    Args:
        record: of a run.
        identifier: fed with the matched channels, the offset taken out as for the matched estimator.
        estimators: of the bench; their front-end makes the channels.
        compiled: False makes them in plain Python.

    Raises:
        PartError: it raises, or its estimate is not three finite numbers with a covariance.
    """
    fed = np.zeros((len(record), 5))
    if len(record):
        march: Any = compiled_feed if compiled else feed
        names = ("x_measured", "force_sampled", "force_measured", "phase")
        march(estimators, *(np.ascontiguousarray(record[name]) for name in names), fed)
    rows = np.full((len(record), len(COLUMNS)), np.nan)
    now: Any = np.full(len(COLUMNS), np.nan)
    for k in range(len(record)):
        if fed[k, 0] == 1.0:
            now = after(identifier, fed[k, 1:4], float(fed[k, 4]), float(record["t"][k]))
        rows[k] = now
    columns = {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}
    return Record({**record.columns, **columns}, {**record.units, **COLUMNS}, record.meta)


def after(identifier: Identifier, regressor: Array, force: float, t: float) -> Array:
    """The identifier's numbers after one sample."""
    name = type(identifier).__name__
    try:
        identifier.update(regressor, force)
        estimate = identifier.estimate()
        theta, P = np.asarray(estimate.theta, float), np.asarray(estimate.covariance, float)
    except Exception as error:
        raise PartError(f"the identifier {name} fails at {t:.3f} s: {reason(error)}") from error
    if theta.shape != (3,) or P.shape != (3, 3):
        raise PartError(
            f"the identifier {name} must estimate (M, B, K): theta of shape (3,) and its covariance (3, 3), got "
            f"{theta.shape} and {P.shape}"
        )
    if not np.isfinite(theta).all():
        raise PartError(f"the identifier {name} estimates {theta.tolist()} at {t:.3f} s: not finite numbers")
    with np.errstate(invalid="ignore"):
        return np.concatenate([theta, np.sqrt(np.diag(P))])
