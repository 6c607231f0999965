"""The values that pass between a bench, its controller and its identifiers.

Fields that are marked `Vec3` are those for the planar arm, and NumPy arrays for any other.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate._jit import part
from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.results import Compared

NORMAL = 1.96
"""Standard deviations of a 95 % half-width."""


@part
class Sense(NamedTuple):
    """Measurements of the controller at a tick."""

    q: Vec3  # joint angles [rad], shape (n,)
    qd: Vec3  # joint rates [rad/s], shape (n,)
    x: Vec3  # pose [m, m, rad], shape (m,)
    xd: Vec3  # its rate [m/s, m/s, rad/s], shape (m,)
    f: Vec3  # wrench that the robot exerts on the environment, measured [N, N, N m], shape (m,)


@part
class Task(NamedTuple):
    """Task of the controller at a tick."""

    x: Vec3  # desired pose, shape (m,)
    xd: Vec3  # its rate
    xdd: Vec3  # its second rate
    f: Vec3  # desired wrench on the environment, shape (m,)
    s: Vec3  # selection: 1 where the force is controlled, 0 where the position is, shape (m,)


@dataclass(frozen=True, eq=False)
class Estimate(Compared):
    """Estimate of an identifier so far.

    Args:
        names: of the parameters, in their order: ("M", "B", "K") for the thesis' regressor.
        theta: the values, shape (n,), SI.
        covariance: of theta, shape (n, n): the noise found in the data included.
        samples: how many samples the data are worth (fewer than were seen when old ones are forgotten).
        rejected: the reason why none of its numbers is valid; empty if the model is not rejected.
        passive: names of the parameters that no passive surface has below zero.
    """

    names: tuple[str, ...]
    theta: Array
    covariance: Array
    samples: float
    rejected: str = ""
    passive: tuple[str, ...] = ()

    @property
    def std(self) -> Array:
        """Standard deviation of each parameter, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def verdicts(self, tolerance: float = 0.25) -> dict[str, str]:
        """By parameter, "identified" or "not identifiable", see `verdict`; "rejected" where the estimate is."""
        if self.rejected:
            return dict.fromkeys(self.names, "rejected")
        rules = {name: passive_verdict if name in self.passive else verdict for name in self.names}
        values = zip(self.names, self.theta.tolist(), self.std.tolist(), strict=True)
        return {name: rules[name](value, std, tolerance) for name, value, std in values}


def verdict(value: float, std: float, tolerance: float = 0.25) -> str:
    """Whether a number may be trusted: "identified" if its 95 % half-width is at most `tolerance` of it."""
    return "identified" if NORMAL * std <= tolerance * abs(value) else "not identifiable"


def passive_verdict(value: float, std: float, tolerance: float = 0.25) -> str:
    """The same for a mass, damping or stiffness, which no passive surface has below zero: then "rejected"."""
    return "rejected" if value + NORMAL * std < 0.0 else verdict(value, std, tolerance)
