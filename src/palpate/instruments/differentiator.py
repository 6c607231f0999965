"""Rates from positions."""

from typing import Any, NamedTuple

from palpate._jit import part
from palpate.signals.parameters import coerced, require


class DifferentiatorState(NamedTuple):
    """The sample before."""

    before: Any


@part
@coerced(lambda self: require(self.rate > 0, "rate", "above 0 Hz", self.rate))
class Differentiator(NamedTuple):
    """First difference. It is the rate half a sample ago, and it multiplies noise by the rate.

    Args:
        rate: samples a second [Hz].
    """

    rate: float

    def start(self):
        return DifferentiatorState(0.0)

    def start_at(self, u):
        """The state after u for ever."""
        return DifferentiatorState(u)

    def step(self, state, u):
        return (u - state.before) * self.rate, DifferentiatorState(u)

    @property
    def lag(self):
        """Half a sample [s]."""
        return 0.5 / self.rate
