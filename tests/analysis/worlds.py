"""Experiments near the boundary of stability, and what they do there when they are simulated."""

import numpy as np

from palpate._vector import Vec3, solve
from palpate.bench import load
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import compiled_march
from palpate.bench.tables import with_values

NONE = (0.0, 0.0, 0.0)


def surface(stiffness, damping, kf, ki, **others):
    """Hybrid control of a surface of 0.05 kg."""
    numbers = {"stiffness": stiffness, "damping": damping, "mass": 0.05}
    gains = {"controller.kf": kf, "controller.ki": ki}
    return with_values(load("foam-hybrid"), {f"surface.{k}": v for k, v in numbers.items()} | gains | others)


def ringing(loop, ticks, kick):
    """Force errors [N] of a simulation that starts at rest and is asked for so much more [N] from then on."""
    motion = loop.motion
    schedule = motion.loop.schedule
    kicked = motion.loop._replace(
        schedule=schedule._replace(first=loop.force + kick, second=loop.force + kick)
    )
    out = np.empty((ticks, len(COLUMNS)))
    compiled_march(kicked, motion.state(loop.x), 0, np.zeros(ticks), out)
    return out[:, list(COLUMNS).index("force")] - loop.force - kick


def decoupled(experiment):
    """The same with y and phi free of the force: a model without error, nothing to stick to."""
    return with_values(experiment, {"robot.rotor_inertia": NONE, "wall.side_friction": 0.0})


def tip_mass(loop):
    """Effective mass of the tip along x [kg]."""
    arm, q = loop.motion.loop.plant.arm, Vec3(*loop.x[:3])
    normal = arm.jac(q).r1
    return 1.0 / (normal @ solve(arm.inertia(q), normal))
