"""The unknowns of the thesis' laboratory: for each its physical range, its prior, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Prior = Literal["even", "log-even", "one of", "any seed"]


@dataclass(frozen=True)
class Unknown:
    """One of them.

    Args:
        name: field of `Laboratory`.
        unit: of its values; "" for a number without.
        prior: how likely values are beforehand: even, even in the logarithm, or one of a few, each as likely.
        low, high: range; the first and the last where it is one of a few.
        reason: of the range.
        choices: where it is one of a few.
    """

    name: str
    unit: str
    prior: Prior
    low: float
    high: float
    reason: str
    choices: tuple[float, ...] = ()

    def at(self, share: float) -> float:
        """The value below which this share of the prior lies, 0 to 1."""
        if self.prior == "log-even":
            return math.exp((1.0 - share) * math.log(self.low) + share * math.log(self.high))
        if self.prior == "even":
            return (1.0 - share) * self.low + share * self.high
        values = self.choices or tuple(range(int(self.low), int(self.high) + 1))
        return float(values[min(int(share * len(values)), len(values) - 1)])

    def holds(self, value: float) -> bool:
        """Whether a value lies in the range."""
        if self.choices:
            return value in self.choices
        return self.low <= value <= self.high

    @property
    def redrawn(self) -> bool:
        """Whether neighbours mean nothing, so that a search draws it anew."""
        return self.prior in {"one of", "any seed"}


def _log(name: str, unit: str, low: float, high: float, reason: str) -> Unknown:
    return Unknown(name, unit, "log-even", low, high, reason)


def _even(name: str, unit: str, low: float, high: float, reason: str) -> Unknown:
    return Unknown(name, unit, "even", low, high, reason)


def _one_of(name: str, unit: str, choices: tuple[float, ...], reason: str) -> Unknown:
    return Unknown(name, unit, "one of", choices[0], choices[-1], reason, choices)


LINEAR, RELAXING, STIFFENING = 0.0, 1.0, 2.0
"""Laws of the foam."""
LAWS = {LINEAR: "spring and damper", RELAXING: "relaxes", STIFFENING: "stiffens with depth"}
LISTING = -1.0
"""The controller's initial weights are those of the listing."""

UNKNOWNS: tuple[Unknown, ...] = (
    _log(
        "friction",
        "times the bench's",
        0.05,
        1.47,
        "Coulomb level; above, motor 1 would pass the 4.41 N m that appendix B gives as its maximum",
    ),
    _even("stiction", "", 1.0, 1.6, "static over Coulomb level; bearings lie between 1 and 1.6"),
    _log(
        "presliding",
        "times the bench's",
        0.2,
        5.0,
        "stiffness of the bristles; 0.04 to 1 mrad to the Coulomb level",
    ),
    _even(
        "asymmetry", "", -0.4, 0.4, "friction forward against backward; cables and bearings under side load"
    ),
    _one_of(
        "foam_law",
        "",
        (LINEAR, RELAXING, STIFFENING),
        "the laws of the environments that foam is said to obey",
    ),
    _log(
        "foam_stiffness",
        "N/m",
        3600.0,
        8000.0,
        "secant from 5 to 20 N; the reported f/x is 6.8 kN/m and counts the force in full",
    ),
    _log(
        "foam_damping",
        "N s/m",
        5.0,
        600.0,
        "at 20 N; from hardly any to a time constant B/K of a tenth of a second",
    ),
    _log(
        "foam_mass",
        "kg",
        0.005,
        0.5,
        "mass that moves with the tip; a cube of foam with 0.2 m edges is 0.2 kg",
    ),
    _log("foam_branch", "", 0.1, 3.0, "stiffness of the relaxing branch over K; only of a foam that relaxes"),
    _log(
        "foam_branch_time", "s", 0.01, 3.0, "of its relaxation; faster is damping, slower is not seen in 8 s"
    ),
    _even(
        "foam_exponent", "", 1.0, 2.5, "of the depth; only of a foam that stiffens; 1.5 is a ball on a plane"
    ),
    _log("rubber_stiffness", "N/m", 24000.0, 50000.0, "the reported f/x is 44 kN/m, and counts in full"),
    _log("rubber_damping", "N s/m", 30.0, 2000.0, "time constants B/K from 1 to 60 ms"),
    _log("rubber_mass", "kg", 0.005, 0.5, "mass that moves with the tip; 0.5 kg is 0.4 litres of rubber"),
    _even(
        "sticking",
        "",
        0.1,
        1.2,
        "friction along the surface over the normal force, from smooth to rough foam",
    ),
    _log("noise", "N", 0.1, 1.2, "of a sample of the force; the reported +-2 N is about 0.6 N"),
    _even(
        "beyond", "kg", 0.0, 0.44, "mass between sensor and tip, read as force; at most the whole of link 3"
    ),
    _even("roughness", "s/m", 0.0, 100.0, "growth of the noise with the tip's rate, which is some 0.02 m/s"),
    _log("covariance", "", 1e2, 1e12, "P(0); the thesis says large, textbooks 1e2 to 1e6, and K^2 is 1e9"),
    _one_of("initial_stiffness", "N/m", (2e4, 2e5), "K(0) of the listing and of the text"),
    _log(
        "amplitude",
        "N",
        21.0,
        200.0,
        "of the identifier's output; it has to reach 20 N, and 200 N is full scale",
    ),
    _log("weights", "", 0.01, 2.0, "the identifier's initial weights are drawn evenly up to it"),
    Unknown("start", "", "any seed", 0, 999, "seed of these weights; the thesis had one draw, any of them"),
    _one_of(
        "controller_weights",
        "",
        (LISTING, *map(float, range(4))),
        "the listing's, or drawn from a seed up to 0.01",
    ),
    _even("wall", "m", 0.40, 0.49, "x of the surface; the listing starts at 0.454 m, the arm ends at 0.53 m"),
    _log(
        "motor2",
        "N m",
        2.0,
        9.8,
        "limit of motor 2, about the listing's 2.5 N m and at most appendix B's 9.8 N m",
    ),
    _log(
        "arm_stiffness",
        "N/m",
        5e4,
        1e7,
        "of the arm's elastic mode at the tip; above, it gives way by microns",
    ),
    _log("arm_frequency", "Hz", 15.0, 200.0, "of that mode; slower would be seen by eye, faster is filtered"),
    _log("arm_damping", "", 0.005, 0.2, "ratio of that mode; metal structures with joints"),
    _one_of(
        "restart", "s", (0.0, 5.0), "the sine's clock runs on, or starts anew each 5 s as in the listing"
    ),
)
BY_NAME = {unknown.name: unknown for unknown in UNKNOWNS}
