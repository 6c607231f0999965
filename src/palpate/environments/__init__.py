"""Environments: one-sided surfaces along their normal, and friction along them."""

from palpate.environments.models import (
    HuntCrossley,
    HuntCrossleySurface,
    KelvinVoigt,
    KelvinVoigtSurface,
    StandardLinearSolid,
    StandardLinearSolidSurface,
)
from palpate.environments.stick_slip import StickSlip, StickSlipState
from palpate.environments.surface import (
    UNTOUCHED,
    Surface,
    SurfaceState,
    SurfaceTable,
    contact_force,
    impact,
    join,
    part_from,
    surface_of,
    touch,
)

__all__ = [
    "UNTOUCHED",
    "HuntCrossley",
    "HuntCrossleySurface",
    "KelvinVoigt",
    "KelvinVoigtSurface",
    "StandardLinearSolid",
    "StandardLinearSolidSurface",
    "StickSlip",
    "StickSlipState",
    "Surface",
    "SurfaceState",
    "SurfaceTable",
    "contact_force",
    "impact",
    "join",
    "part_from",
    "surface_of",
    "touch",
]
