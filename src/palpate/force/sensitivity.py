"""How close the loop comes to growing: the peak of its sensitivity, and what gain that allows on stiff surfaces."""

from math import inf

import numpy as np

from palpate.force.arm import Arm
from palpate.force.boundary import rank_one
from palpate.force.sampled_loop import SampledLoop, law_for

PEAK = 1.66
"""Of the sensitivity 1/(1 + L): what alpha 0.48 comes to where all of the lag is delay."""
MOST = 0.3
"""With it g theta K_eff/alpha is at most 1.43 where K_u is K, of the 2 that the proof of the adapting law is of."""
_FREQUENCIES = 120
_STIFFNESSES = 12


def sensitivity(loop: SampledLoop, gain: float, stiffness: float, damping: float = 0.0) -> float:
    """Largest |1/(1 + L)| on a surface; infinite where the loop grows.

    Args:
        loop: of the arm.
        gain: g [m/(s N)].
        stiffness: K, for a position arm as felt [N/m].
        damping: B [N s/m].
    """
    start, closed = (loop.phi(stiffness, damping, law_for(loop.arm, g, stiffness)) for g in (0.0, gain))
    if np.abs(np.linalg.eigvals(closed)).max() >= 1.0:
        return inf
    b, c = rank_one(closed - start)
    z = np.exp(1j * np.geomspace(1e-3, 0.9 * np.pi, _FREQUENCIES))
    inner = np.linalg.solve(z[:, None, None] * np.eye(loop.size) - start, b.astype(complex)[None, :, None])[
        ..., 0
    ]
    return float(np.abs(1.0 / (1.0 - inner @ c)).max())


def relief_of(arm: Arm, theta: float, alpha: float) -> float:
    """rho: on a surface of stiffness K the lag is shorter by this share times (K + K_s/2)/(K + K_s).

    Most of the lag of an arm that yields is its spring and damper, K_s and D, not delay, and the stiffer the surface
    beside the spring, the shorter it is. The largest share that keeps the sensitivity below `PEAK` on every stiffness;
    0 for a position arm, whose tip does not feel the surface.

    Args:
        arm: what moves.
        theta: [s].
        alpha: gain in units of 1/theta.
    """
    if arm.kind == "position":
        return 0.0
    loop, found = SampledLoop(arm), MOST
    for K in np.geomspace(0.01 * arm.series, arm.limits.stiffness, _STIFFNESSES).tolist():
        part = (K + 0.5 * arm.series) / (K + arm.series)
        unit = alpha / theta * (1.0 / arm.series + 1.0 / K)
        while found > 0.0 and sensitivity(loop, unit / (1.0 - found * part), K) > PEAK:
            found = max(found - 0.02, 0.0)
    return found
