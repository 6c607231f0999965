"""From measured signals to a regressor: the input of recursive least squares decides its estimates.

The thesis filters only the acceleration and the force, so its three channels lag differently. A matched front-end
sends the position through a model of the force sensor's chain, and all channels through one filter.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3
from palpate.signals.filters import Biquad, BiquadState, Delay, History, StateVariable, StateVariableState


@law
def centred(mean, value, weight):
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
        dphi, mean = centred(state.mean, phi, weight)
        dy, force = centred(state.force, y, weight)
        return (scale * dphi, scale * dy), CentringState(mean, force, weight + 1.0)
