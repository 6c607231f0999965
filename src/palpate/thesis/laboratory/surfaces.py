"""Foam by three laws that press alike from 5 to 20 N."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from palpate.environments import KelvinVoigtSurface
from palpate.thesis.laboratory.unknowns import RELAXING, STIFFENING

BENCH_FOAM = (5200.0, 200.0, 0.1)
SWITCH, DESIRED = 5.0, 20.0
"""Forces between which a stiffness is a secant, and at which a damping is told [N]."""
BETWEEN = 15000.0
"""A linear surface of the bench below it is foam, above it rubber [N/m]."""


def is_foam(stiffness: float) -> bool:
    """Whether a linear surface of the bench stands for the foam."""
    return stiffness < BETWEEN


@dataclass(frozen=True)
class Foam:
    """A foam: its law, secant stiffness [N/m], damping at 20 N [N s/m], mass [kg], and what the law adds."""

    law: float
    stiffness: float
    damping: float
    mass: float
    branch: float  # of the relaxing branch, over K
    branch_time: float  # [s]
    exponent: float

    def instead_of(self, surface: KelvinVoigtSurface) -> dict[str, Any]:
        """This foam as a table, varied as the bench's foam is in `surface`."""
        stiffness, damping, mass = (
            own * there / bench
            for own, there, bench in zip(
                (self.stiffness, self.damping, self.mass),
                (surface.stiffness, surface.damping, surface.mass),
                BENCH_FOAM,
                strict=True,
            )
        )
        if self.law == STIFFENING:
            return stiffening(stiffness, damping, mass, self.exponent)
        linear = {"kind": "kelvin-voigt", "stiffness": stiffness, "damping": damping, "mass": mass}
        if self.law != RELAXING:
            return linear
        branch = {"branch_stiffness": self.branch * stiffness, "branch_time": self.branch_time}
        return {**linear, "kind": "standard-linear-solid", **branch}


def stiffening(secant: float, damping: float, mass: float, exponent: float) -> dict[str, Any]:
    """The Hunt-Crossley surface with this secant from 5 to 20 N [N/m] and this damping at 20 N [N s/m]."""
    spread = DESIRED ** (1.0 / exponent) - SWITCH ** (1.0 / exponent)
    stiffness = (spread * secant / (DESIRED - SWITCH)) ** exponent
    return {
        "kind": "hunt-crossley",
        "stiffness": stiffness,
        "damping": damping * stiffness / DESIRED,
        "exponent": exponent,
        "mass": mass,
    }


def own_damping(surface: Mapping[str, Any]) -> float:
    """A surface's own B [N s/m]: at 20 N where it grows with the depth; of one that relaxes, its dashpot's."""
    damping = float(surface["damping"])
    return damping * DESIRED / float(surface["stiffness"]) if surface["kind"] == "hunt-crossley" else damping
