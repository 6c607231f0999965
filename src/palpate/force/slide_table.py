"""The numbers of a slide in a gains file."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from palpate.force.arm import Positive, Table


class Slide(Table):
    """Table `slide` of a gains file."""

    speed: Positive
    """Along the surface [m/s]."""
    mu_max: Annotated[float, Meta(gt=0, le=2)]
    """Largest friction that there may be; a larger one is refuted as a wrong normal."""
    slope: Annotated[float, Meta(gt=0, le=0.5)] = 0.12
    """Standard deviation of the given direction against the surface's normal, each way [rad]."""
    radius: Positive = 0.1
    """Smallest radius R of curvature of the surface [m]: the curvature's standard deviation before any was seen is 1/R,
    and its noise along the path 1/R^3 [1/m^3]."""
    ratio: Annotated[float, Meta(gt=0, le=2)] = 0.85
    """Tangential over normal stiffness of the contact; 2 (1 - nu)/(2 - nu) of two spheres (Mindlin, 1949)."""
    acceleration: Positive = 0.4
    """Largest acceleration of the tip along the surface [m/s^2]."""
    step: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    """Highest step that is expected in the surface [m]: the slide is slow enough to stop on it."""
    touches: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    """Spacing of three light touches that measure the normal before the slide; 0 for none [m]."""
