"""Is a table of numbers the inertia of a body, and of which that can exist?"""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

_ROUNDING = 1e-12
"""Of an inertia tensor's eigenvalues, as a share of the largest: some thousand last places of a float."""


def check_inertia(name: str, mass: float, moment: Array) -> str:
    """Defect of a link's inertia, in a sentence; "" if there is none.

    A body of positive density has principal moments of which none exceeds the sum of the others. Makers publish links
    that break this (Franka's link 4): an arm with such a link still moves by the same laws, so it is taken as it is.

    Args:
        name: of the link.
        mass: [kg].
        moment: about its centre of mass [kg m^2], shape (3, 3).

    Raises:
        InputError: a negative mass, or a moment of inertia that is negative about some axis.
    """
    if not (np.isfinite(mass) and mass >= 0.0):
        raise InputError(f"link {name}: a mass must be 0 kg or more, got {mass:g}")
    if not np.isfinite(moment).all() or not np.allclose(moment, moment.T, rtol=1e-9, atol=1e-15):
        raise InputError(f"link {name}: an inertia is six finite numbers of a symmetric matrix")
    least, middle, most = np.linalg.eigvalsh(moment)
    if least < -_ROUNDING * max(abs(most), abs(least)):
        raise InputError(
            f"link {name}: its inertia is none, the moment about one axis is {least:.4g} kg m^2; it must be 0 or more "
            "about every axis: check signs and order (xx yy zz xy xz yz, about the centre of mass)"
        )
    excess = most - (least + middle)
    if excess <= _ROUNDING * most:
        return ""
    return (
        f"link {name}: its principal moments break the triangle inequality, {most:.4g} > {least:.4g} + {middle:.4g} "
        "kg m^2, so no body has them; taken as published"
    )
