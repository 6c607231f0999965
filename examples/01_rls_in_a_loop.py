"""Identify a surface on line: one `update` a millisecond, as a 1 kHz control loop would call it.

A probe presses foam of 5200 N/m, 200 N s/m and 0.1 kg sinusoidally; the force carries noise of 0.6 N.
"""

import numpy as np

from palpate.identifiers import RecursiveLeastSquares

TRUTH = np.array([0.1, 200.0, 5200.0])  # M [kg], B [N s/m], K [N/m]

random = np.random.default_rng(1)
time = np.arange(5000) * 1e-3
omega = 2 * np.pi * np.array([1.0, 7.0, 23.0])[:, None]
amplitude = np.array([2e-3, 3e-4, 5e-5])[:, None]
penetration = 3e-3 + (amplitude * np.sin(omega * time)).sum(axis=0)
velocity = (amplitude * omega * np.cos(omega * time)).sum(axis=0)
acceleration = -(amplitude * omega**2 * np.sin(omega * time)).sum(axis=0)
regressors = np.column_stack([acceleration, velocity, penetration])
forces = regressors @ TRUTH + random.normal(0.0, 0.6, len(time))

rls = RecursiveLeastSquares(theta=np.zeros(3), covariance=np.diag([1e2, 1e6, 1e10]), names=("M", "B", "K"))
for regressor, force in zip(regressors, forces, strict=True):
    rls.update(regressor, force)

estimate = rls.estimate()
print("     estimate      +- (95 %)    truth")
for name, value, variance, truth in zip(
    rls.names, rls.theta, np.diag(estimate.covariance), TRUTH, strict=True
):
    print(f"{name}  {value:11.4f}  {1.96 * variance**0.5:11.4f}  {truth:8.1f}")
