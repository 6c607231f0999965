"""Explanation 11: conditions that change: friction with the configuration, a surface with its temperature."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import Vec3, sqrt
from palpate.arrays import Array
from palpate.bench import Experiment, build, with_values
from palpate.friction import LuGre
from palpate.identification.pooling import Mean, random_effects
from palpate.identification.uncertainty import student
from palpate.report import style
from palpate.robots.arm3 import Arm3, directions, onto_joints
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.conditions import by_condition, move_wall
from palpate_thesis.explanations.e6_friction_compensation import PARAMETERS as COMPENSATED
from palpate_thesis.explanations.e6_friction_compensation import PLAIN, held_in
from palpate_thesis.force_control.panels import panels
from palpate_thesis.least_squares.press_runs import PLAIN as IDENTIFIED
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "changing-conditions"
PARAMETERS = with_values(COMPENSATED, {"force.first": 15.0})
WALLS = (0.40, 0.43, 0.465, 0.49)
"""x of the surface [m]; friction is as chosen for the third."""
MORE = 1.25
"""Least ratio of two errors that counts as a difference."""
SOFTENING, MIDDLE = -0.005, 22.5
"""Chosen: change of the foam's stiffness [1/K] about a temperature [C]."""
TEMPERATURES = np.linspace(10.0, 35.0, 10)
"""One for each press [C]."""


def errors(experiment: Experiment, seed: int) -> tuple[float, float]:
    """Force error in the last second [N] with constant friction, and with one that depends on the configuration."""
    bench = build(experiment)
    arm, plant = bench.loop.conditioning.arm, bench.loop.plant
    reference = tilting(arm, build(PARAMETERS).q)
    friction: Any = FrictionByConfiguration(plant.friction, arm, reference, bench.q)
    other = replace(bench, loop=bench.loop._replace(plant=plant._replace(friction=friction)))
    constant, dependent = (
        held_in(one.run(experiment.run.duration, seed, press=experiment.run.press)).error
        for one in (bench, other)
    )
    return constant, dependent


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    levels: Array  # friction of the joints over that of the start, shape (walls, 3)
    plain: dict[str, list[tuple[float, float]]]  # by wall, without compensation
    compensated: dict[str, list[tuple[float, float]]]
    stiffness: Array  # shape (temperatures,) [N/m]
    deviation: Array  # of each [N/m]


def run(runs: Runs) -> Data:
    """Presses at each wall with both frictions, and a press at each temperature."""
    walls = {f"{x:g}": with_values(PARAMETERS, move_wall(PARAMETERS, x)) for x in WALLS}
    arm = build(PARAMETERS).loop.conditioning.arm
    moments = np.array([list(tilting(arm, build(wall).q)) for wall in walls.values()])
    plain, compensated = (
        by_condition(runs, {x: with_values(wall, change) for x, wall in walls.items()}, errors, walls)
        for change in ({"compensation.level": PLAIN.compensation.level}, {})
    )
    cases = [
        (with_values(IDENTIFIED, {"surface.stiffness": stiffness_at(t), "run.press": 4.0}), seed)
        for t, seed in zip(TEMPERATURES, cycle(runs.seeds), strict=False)
    ]
    ends = np.array(runs.over(cases, lambda r: (r["K_matched"][-1], r["K_matched_std"][-1])))
    return Data(moments / moments[2], plain, compensated, ends[:, 0], ends[:, 1])


def stiffness_at(temperature: float) -> float:
    """Of the foam, as chosen [N/m]."""
    return IDENTIFIED.surface.stiffness * (1.0 + SOFTENING * (float(temperature) - MIDDLE))


def pool_presses(data: Data, covariate: bool) -> Mean:
    """Stiffness of all presses, with the temperature as a covariate or without."""
    return random_effects(data.stiffness, data.deviation**2, TEMPERATURES[:, None] if covariate else None)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Friction at the joints, friction at the tip, a compensation of it, and the temperature."""
    near, _, start, far = (np.array(found)[:, 1] for found in data.plain.values())
    known = {name: np.array(found) for name, found in data.compensated.items()}
    worse = {name: found[:, 1] / found[:, 0] for name, found in known.items()}
    own, alone = pool_presses(data, True), pool_presses(data, False)
    slope, std = own.slopes[0]
    return [
        claim(
            "changing-conditions.compensation",
            any(often(worse[name] >= MORE) for name in worse),
            levels="; ".join(
                f"{x:g} m: {100 * v[0]:.0f}, {100 * v[1]:.0f} %"
                for x, v in zip(WALLS, data.levels, strict=True)
            ),
            errors="; ".join(f"{name} m: {np.median(v[:, 1]):.2f} N" for name, v in known.items()),
            ratios="; ".join(f"{name} m: {np.median(v):.2f}" for name, v in worse.items()),
            more=MORE,
        ),
        claim(
            "changing-conditions.tip",
            often(far / start >= MORE),
            near=near,
            middle=start,
            far=far,
            more=MORE,
        ),
        claim(
            "changing-conditions.temperature",
            "not checkable",
            slope=f"{slope:.1f} ± {student(own.freedom) * std:.1f}",
            true=f"{SOFTENING * IDENTIFIED.surface.stiffness:.1f}",
            alone=f"{alone.between:.0f}",
            left=f"{own.between:.0f}",
            share=100 * SOFTENING,
            presses=len(TEMPERATURES),
        ),
    ]


def plot(data: Data) -> Figure:
    """Errors over the configuration, and stiffness over the temperature."""
    drawing, ((force, stiffness),) = panels([3.0], 2, 11.0)
    kinds = {"no compensation": data.plain, "compensated": data.compensated}
    for (label, found), color in zip(kinds.items(), style.SERIES, strict=False):
        constant, dependent = np.median(list(found.values()), axis=1).T
        force.plot(WALLS, dependent, "o-", color=color, linewidth=1.2, markersize=4, label=label)
        force.plot(WALLS, constant, "--", color=color, linewidth=1.0)
    force.set(xlabel="wall at [m]", ylabel="force error [N]", ylim=(0.0, None))
    force.set_title("friction by configuration; dashed: constant")
    force.legend()
    own = pool_presses(data, True)
    offsets = TEMPERATURES - TEMPERATURES.mean()
    bars = 1.96 * data.deviation
    stiffness.errorbar(TEMPERATURES, data.stiffness, bars, fmt="o", color=style.K, markersize=4)
    stiffness.plot(TEMPERATURES, own.value + own.slopes[0][0] * offsets, color=style.K, linewidth=1.2)
    stiffness.plot(TEMPERATURES, [stiffness_at(t) for t in TEMPERATURES], **style.KNOWN)
    stiffness.set(xlabel="temperature [C]", ylabel="K [N/m]", title="pooled presses; dashed: as chosen")
    return drawing


GRAVITY = 9.81
"""[m/s^2]."""


@law
def tilting(arm: Any, q: Any) -> Any:
    """Moment that tilts each joint's vertical axis: of the weight of all links beyond it [N m], shape (3,)."""
    (c, s), m, a = directions(q), arm.mass, arm.length
    first = m * (a + arm.com) + Vec3((m.y + m.z) * a.x, m.z * a.y, 0.0)
    x, y = onto_joints(first * c), onto_joints(first * s)
    return GRAVITY * sqrt(x * x + y * y)


@part
class ConfigurationState(NamedTuple):
    bristles: Vec3  # [rad]
    q: Vec3  # joint angles [rad]


@part
class FrictionByConfiguration(NamedTuple):
    """Friction of bearings that carry the weight of the links beyond them: as strong as that weight tilts them.

    Args:
        friction: where the bearings carry `reference`.
        arm: whose weight it is.
        reference: tilting moments [N m], shape (3,).
        q: joint angles at the start [rad], shape (3,).
    """

    friction: LuGre
    arm: Arm3
    reference: Vec3
    q: Vec3

    def start(self):
        return ConfigurationState(self.friction.start(), self.q)

    def step(self, state, v, dt):
        """As that of `LuGre`; the plant's angles are the integral of its rates."""
        q = state.q + dt * v
        now = self.friction.scaled_by(tilting(self.arm, q) / self.reference)
        torque, bristles = now.step(state.bristles, v, dt)
        return torque, ConfigurationState(bristles, q)
