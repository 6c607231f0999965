"""A low-pass with the denominator of one's choice, and the derivatives of what comes out of it."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.signals.low_pass import LowPass


class FilterBank:
    """D(0)/D(s) and its derivatives up to D's order, exact for straight lines between the readings.

    Args:
        D: ascending, shape (order + 1,).
        dt: sampling period [s].
    """

    def __init__(self, D: Array, dt: float):
        from scipy.signal import cont2discrete, ss2tf

        order = len(D) - 1
        self.dt = dt
        per_sample = D / dt ** np.arange(order + 1)
        drift = np.eye(order, k=1)
        drift[-1] = -per_sample[:-1] / per_sample[-1]
        gain = np.zeros((order, 1))
        gain[-1] = per_sample[0] / per_sample[-1]
        through = np.zeros((order + 1, 1))
        through[-1] = gain[-1]
        states = np.vstack([np.eye(order), drift[-1]])
        *discrete, _ = cont2discrete((drift, gain, states, through), 1.0, method="foh")
        self.numerators, self.denominator = ss2tf(*discrete)

    def memory(self, count: int) -> Array:
        """Response of the outputs to the time before the first sample: columns of shape (count, order).

        They span it from the sample `order` on.
        """
        from scipy.signal import lfilter

        order = len(self.denominator) - 1
        kick = np.zeros(count + order)
        kick[order - 1] = 1.0
        ringing = lfilter([1.0], self.denominator, kick)
        return np.column_stack([ringing[order - 1 - k : count + order - 1 - k] for k in range(order)])

    def __call__(self, signal: Array, derivative: int) -> Array:
        """The filtered signal or a derivative of it, shape (n,); it rests at its first value before."""
        from scipy.signal import lfilter

        out: Array = lfilter(self.numerators[derivative], self.denominator, signal - signal[0])
        return out / self.dt**derivative + (signal[0] if derivative == 0 else 0.0)


def low_passed(signal: Array, low_pass: LowPass, dt: float) -> Array:
    """A signal, shape (n,), behind Butterworth low-passes, exact for straight lines between the samples."""
    from scipy.signal import butter

    for order, cutoff in low_pass.sections:
        _, denominator = butter(order, 2 * np.pi * cutoff, analog=True)
        signal = FilterBank(np.asarray(denominator[::-1]), dt)(signal, 0)
    return signal
