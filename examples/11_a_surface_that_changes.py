"""On line, at 1 kHz: a tip on a given path presses a surface whose stiffness grows ninefold during the press.

The inputs are position and force, tick by tick. `ContactIdentifier` filters the position by the force sensor's own
low-pass. `RestartingLeastSquares` detects the change of the surface and dates it.
"""

import numpy as np

from palpate.bench import given_motion
from palpate.environments import KelvinVoigt
from palpate.identifiers import ContactIdentifier, RestartingLeastSquares
from palpate.signals import LowPass

SOFT, HARD, CHANGE = KelvinVoigt(7e3, 60, 0.1), KelvinVoigt(62e3, 150, 0.1), 2.0


def path(t):
    """About 10 mm into the soft surface, with tones of 2 and 7 Hz [m]."""
    return 10e-3 + 2e-4 * np.sin(2 * np.pi * 2 * t) + 5e-5 * np.sin(2 * np.pi * 7 * t)


record = given_motion([(0.0, SOFT), (CHANGE, HARD)]).run(path, 4.0, seed=1)
sensor = record.meta["instruments"]["force"]

vague = np.diag([1e2, 1e8, 1e12, 1e6])  # of M, B, K and the offset
surface = RestartingLeastSquares(np.zeros(4), vague, names=("M", "B", "K", "offset"))
lag = LowPass.parse(sensor["filter"]).lag + sensor["delay_s"]
identifier = ContactIdentifier(
    sensor["filter"], 1000.0, lag, sampling=sensor["sampling_Hz"], estimator=surface
)

changes = 0
for t, position, force in zip(record["t"], record["x_measured"], record["force_sampled"], strict=True):
    identifier.update(position, force)
    if surface.changes > changes:
        changes = surface.changes
        print(f"{t:.3f} s: another surface, {surface.since} samples of it seen; it came at {CHANGE:.3f} s")
    if round(1000 * t) % 500 == 499:
        estimate = identifier.estimate()
        K, half = estimate.theta[2], 1.96 * estimate.std[2]
        print(f"{t:.3f} s: K {K:6.0f} +- {half:4.0f} N/m, {estimate.verdicts()['K']}")
