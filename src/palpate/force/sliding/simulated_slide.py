"""A slide in simulation: from gains, a surface and a path to a table of what happened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.force.flat import flattened
from palpate.force.gains import Gains
from palpate.force.simulated_press import world_of
from palpate.force.sliding.slide_law import JERKS, REFUTED, SIZE, STEPPED
from palpate.force.sliding.slide_world import COLUMNS, LAWS, Ground, compiled_slide
from palpate.force.sliding.sliding_loop import CHI2_95, DOWN, sliding

PATHS = ("line", "back", "circle", "raster")
GAP = 3e-3
"""Between tip and surface at the start [m]."""
LONGEST = 30.0
"""Time in which the surface is to be found and the force held [s]."""
SETTLED = 0.5
"""Time after which a slide is judged [s]."""


def directions(
    path: str, seconds: float, rate: float, speed: float, extent: float, heading: float = 0.0
) -> Array:
    """Unit vectors along the surface for each tick, shape (n, 3).

    Args:
        path: one of `PATHS`.
        seconds: of the slide [s].
        rate: ticks a second [Hz].
        speed: along the surface [m/s].
        extent: length of a line or a pass, radius of a circle [m].
        heading: of the beginning [rad].

    Raises:
        InputError: no such path.
    """
    if path not in PATHS:
        raise unknown("path", path, PATHS)
    way = speed / rate * np.arange(round(seconds * rate))
    if path == "circle":
        angle = heading + way / extent
    elif path == "raster":  # a pass, a tenth of it aside, and the pass back
        turn = way % (2.2 * extent)
        angle = heading + np.pi * ((turn >= 1.1 * extent) & (turn < 2.1 * extent))
        aside = ((turn >= extent) & (turn < 1.1 * extent)) | (turn >= 2.1 * extent)
        angle = np.where(aside, heading + 0.5 * np.pi, angle)
    else:
        angle = heading + np.pi * (np.floor(way / extent) % 2.0) * (path == "back")
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)


def simulate(
    gains: Gains,
    ground: Ground,
    ways: Array,
    *,
    into: ArrayLike = DOWN,
    seed: int = 0,
    rival: str = "sliding",
) -> Array:
    """A slide from free motion on: rows of `COLUMNS`, shape (n, 20).

    Args:
        gains: with a table `slide`.
        ground: the surface; the tip comes down on its origin.
        ways: directions of the slide, tick by tick, shape (m, 3).
        into: direction in which the law looks for the surface, shape (3,).
        seed: of the noise.
        rival: one of `LAWS`.
    """
    if rival not in LAWS:
        raise unknown("law", rival, LAWS)
    law, arm = sliding(gains, into), gains.arm
    state = np.zeros(SIZE)
    law.start(state)
    world = world_of(arm, noise=arm.sensor.noise)
    n = len(ways) + round(LONGEST * arm.rate)
    out = np.zeros((n, len(COLUMNS)))
    noise = np.random.default_rng(seed).standard_normal((n, 3))
    start = -GAP * np.array(law.into) * (-1.0 if law.into.z > 0.0 else 1.0)  # outside, however wrong it is
    line = np.zeros((world.delay + 1, 3))
    rows = compiled_slide(
        world, ground, flattened(law), state, LAWS[rival], start, ways, gains.force, noise, line, out
    )
    return out[:rows]


@dataclass(frozen=True)
class SlideFigures:
    """How a slide went.

    Args:
        touched: whether the force was held and the tip slid.
        rms: of the force error after `SETTLED`, share of F_d.
        most: largest error after that, share of F_d.
        worst: largest normal force of the whole slide in F_d.
        lost: whether the true force was 0 in the slide.
        normal: median error of the normal after `SETTLED` [rad].
        cone: share of the time in which the 95 % cone holds the normal.
        friction: share of the time in which the 95 % interval holds mu.
        stiffness: the same of K.
        steps: whether a step was said.
        jerks: whether stick-slip was said.
        refuted: whether a normal was refuted.
    """

    touched: bool
    rms: float
    most: float
    worst: float
    lost: bool
    normal: float
    cone: float
    friction: float
    stiffness: float
    steps: bool
    jerks: bool
    refuted: bool

    @property
    def obeys(self) -> bool:
        """Within 3 % rms and 10 %, contact kept."""
        return self.touched and self.rms <= 0.03 and self.most <= 0.1 and not self.lost


def figures_of(out: Array, gains: Gains, ground: Ground) -> SlideFigures:
    """How a slide went, from its rows."""
    c = {name: out[:, i] for i, name in enumerate(COLUMNS)}
    on = np.flatnonzero(c["sliding"])
    judged = on[round(SETTLED * gains.arm.rate) :]
    if not len(judged):
        nan = float("nan")
        return SlideFigures(False, nan, nan, nan, True, nan, 0.0, 0.0, 0.0, False, False, False)
    error = c["normal_force"][judged] / gains.force - 1.0
    true = gains.arm.seen(ground.stiffness) if gains.arm.kind == "position" else ground.stiffness
    said = set(c["trouble"][on])
    return SlideFigures(
        True, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()),
        float(c["normal_force"][on].max() / gains.force), bool((c["normal_force"][on] <= 0.0).any()),
        float(np.median(c["normal_error"][judged])),
        float(np.mean(c["normal_error"][judged] < CHI2_95 * c["cone"][judged])),
        float(np.mean(np.abs(c["mu"][judged] - ground.friction) < 1.96 * c["mu_std"][judged])),
        float(np.mean(np.abs(np.log(c["stiffness"][judged] / true)) < 1.96 * c["log_std"][judged])),
        STEPPED in said, JERKS in said, REFUTED in said,
    )  # fmt: skip


def ground_of(shape: str, radius: float, stiffness: float, **others: float) -> Ground:
    """A surface; `others` as `Ground` has them.

    Raises:
        InputError: no such shape, or a number out of range.
    """
    from palpate.force.sliding.slide_world import ELASTIC, SHAPES

    if shape not in SHAPES:
        raise unknown("shape", shape, SHAPES)
    friction = others.get("friction", 0.0)
    numbers = {
        "radius": radius, "period": 2.0 * radius, "height": 0.0, "stiffness": stiffness, "damping": 0.0,
        "friction": friction, "sticking": friction, "creep": 5e-3, "ratio": ELASTIC, **others,
    }  # fmt: skip
    low = [f"{name} of {value:g}" for name, value in numbers.items() if value < 0.0 and name != "height"]
    if low or not radius > 0.0 or not stiffness > 0.0:
        raise InputError(f"a surface needs numbers above 0, got {', '.join(low) or 'no radius or stiffness'}")
    if numbers["sticking"] < numbers["friction"]:
        raise InputError(
            f"friction at rest (mus) must not be below that at speed (mu), got {numbers['sticking']:g} and {friction:g}"
        )
    return Ground(SHAPES[shape], **{name: float(value) for name, value in numbers.items()})
