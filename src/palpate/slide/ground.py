"""Surfaces of simulated slides as distance functions, with their stiffness and friction.

The surface's own axes are x and y along it at its first point and z out of it.
"""

from math import inf
from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, cos, sin, sqrt
from palpate.errors import InputError, unknown
from palpate.force.sliding.slide_state import unit

PLANE, SPHERE, BOWL, CYLINDER, SADDLE, WAVES, EGGS, STEP = (float(i) for i in range(8))
SHAPES = {
    "plane": PLANE, "sphere": SPHERE, "bowl": BOWL, "cylinder": CYLINDER, "saddle": SADDLE, "waves": WAVES,
    "eggs": EGGS, "step": STEP,
}  # fmt: skip
ELASTIC = 0.85
"""Tangential over normal stiffness of the simulated contact if none is given."""


@part
class Ground(NamedTuple):
    """A surface and its friction.

    Args:
        shape: one of `SHAPES`.
        radius: of curvature; of waves at their crest [m].
        period: of waves; place of a step [m].
        height: of a step, downwards if negative [m].
        stiffness: K [N/m].
        damping: B [N s/m].
        grade: relative change of the stiffness along x [1/m].
        friction: mu at speed.
        sticking: mu of a contact at rest, at least `friction`.
        creep: speed over which one becomes the other [m/s].
        ratio: tangential over normal stiffness.
    """

    shape: float
    radius: float
    period: float
    height: float
    stiffness: float
    damping: float
    grade: float
    friction: float
    sticking: float
    creep: float
    ratio: float


@law
def outside(ground, p):
    """Distance of a point from the surface [m], negative inside, and the direction out of it."""
    R, shape = ground.radius, ground.shape
    up = Vec3(0.0, 0.0, 1.0)
    if shape == PLANE:
        return p.z, up
    if shape == SPHERE:
        away = p + R * up
        return sqrt(away @ away) - R, unit(away, up)
    if shape == BOWL:
        away = R * up - p
        return R - sqrt(away @ away), unit(away, up)
    if shape == CYLINDER:
        away = Vec3(p.x, 0.0, p.z + R)
        return sqrt(away @ away) - R, unit(away, up)
    h, hx, hy = height_at(ground, p.x, p.y)
    size = sqrt(1.0 + hx * hx + hy * hy)
    return (p.z - h) / size, Vec3(-hx, -hy, 1.0) / size


@law
def height_at(ground, x, y):
    """Height of a surface that is a function of x and y [m], and its slopes."""
    R, k = ground.radius, 6.283185307179586 / ground.period
    if ground.shape == SADDLE:
        return 0.5 * (x * x - y * y) / R, x / R, -y / R
    if ground.shape == EGGS:
        a = 1.0 / (R * k * k)
        return (
            a * (cos(k * x) * cos(k * y) - 1.0),
            -a * k * sin(k * x) * cos(k * y),
            -a * k * cos(k * x) * sin(k * y),
        )
    if ground.shape == WAVES:
        return (cos(k * x) - 1.0) / (R * k * k), -sin(k * x) / (R * k), 0.0
    u = min(max((x - ground.period) / 2e-3 + 0.5, 0.0), 1.0)  # the tip's radius rounds an edge over 2 mm
    return ground.height * u * u * (3.0 - 2.0 * u), ground.height * 6.0 * u * (1.0 - u) / 2e-3, 0.0


def ground_of(shape: str, radius: float, stiffness: float, **others: float) -> Ground:
    """A surface; `others` as `Ground` has them.

    Raises:
        InputError: no such shape, or a number out of range.
    """
    if shape not in SHAPES:
        raise unknown("shape", shape, SHAPES)
    friction = others.get("friction", 0.0)
    numbers = {
        "radius": radius, "period": 2.0 * radius, "height": 0.0, "stiffness": stiffness, "damping": 0.0,
        "grade": 0.0, "friction": friction, "sticking": friction, "creep": 5e-3, "ratio": ELASTIC,
        **others,
    }  # fmt: skip
    minima = {"height": -1e3, "grade": -1e3, "radius": 1e-9, "stiffness": 1e-9}
    low = [
        f"{name} of {value:g}" for name, value in numbers.items() if not minima.get(name, 0.0) <= value < inf
    ]
    if low:
        raise InputError(f"a surface needs K and a radius above 0, and nothing below 0; got {low[0]}")
    if numbers["sticking"] < numbers["friction"]:
        raise InputError(
            f"friction at rest (mus) must not be below that at speed (mu), got {numbers['sticking']:g} and {friction:g}"
        )
    return Ground(SHAPES[shape], **{name: float(value) for name, value in numbers.items()})
