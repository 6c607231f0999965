"""What is touched: one-sided surfaces along their normal, and friction along them."""

from palpate.environments.hunt_crossley import HuntCrossley
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.environments.standard_linear_solid import StandardLinearSolid
from palpate.environments.stick_slip import StickSlip, StickSlipState
from palpate.environments.surface import Surface, join
from palpate.environments.surface_state import SurfaceState, contact_force, impact, part_from, touch

__all__ = [
    "HuntCrossley",
    "KelvinVoigt",
    "StandardLinearSolid",
    "StickSlip",
    "StickSlipState",
    "Surface",
    "SurfaceState",
    "contact_force",
    "impact",
    "join",
    "part_from",
    "touch",
]
