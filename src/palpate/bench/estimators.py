"""Three least-squares estimators on one contact, which show the effect of the front end."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3
from palpate.bench.matched_channels import Centring, CentringState, Matched, MatchedState
from palpate.identifiers.kernels.least_squares import LeastSquares, LeastSquaresState


@law
def listened(listening, pressing, smooth_force, touch):
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
        before, listening = listening, listened(listening, pressing, smooth_force, self.touch)
        if listening == 1.0:
            if before == 0.0:  # anew at each touch: what noise alone once took for a touch is no data
                matched, centring = self.matched.start(), self.centring.start()
            (phi, force), centring = self.centring.step(centring, phi, force)
            _, matched = self.matched.step(matched, phi, force)
        return EstimatorsState(thesis, raw, matched, front, centring, listening)
