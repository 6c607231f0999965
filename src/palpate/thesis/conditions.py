"""Worlds that the figures are tried in: other surfaces, other friction, other poses; as changes of an experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.bench import Experiment

SHORT = {"robot.start": (0.462, 0.0, 0.0), "approach.first": 0.467, "approach.hold": 0.3}
"""The last millimetres of the approach: the rest of it takes sixteen seconds and moves errors in contact by 4 %."""
RELAXING_FOAM = {
    "surface": {
        "kind": "standard-linear-solid",
        "stiffness": 5600.0,
        "damping": 13.0,
        "mass": 0.02,
        "branch_stiffness": 6900.0,
        "branch_time": 0.23,
    }
}
RUBBER_SURFACE = {"surface": {"kind": "kelvin-voigt", "stiffness": 34500.0, "damping": 480.0, "mass": 0.05}}


def moved(experiment: Experiment, x: float) -> Mapping[str, Any]:
    """Changes that bring start, approach and wall together to a wall at x [m]."""
    by = x - experiment.wall.x
    start = experiment.robot.start
    return {
        "wall.x": x,
        "robot.start": (start[0] + by, *start[1:]),
        "approach.first": experiment.approach.first + by,
    }


def rougher(experiment: Experiment, factor: float) -> Mapping[str, Any]:
    """Changes that multiply the joints' friction."""
    f = experiment.friction
    names = ("coulomb", "static", "bristle_stiffness", "bristle_damping")
    return {f"friction.{n}": tuple(factor * v for v in getattr(f, n)) for n in names}


def friction_and_pose(experiment: Experiment) -> dict[str, Mapping[str, Any]]:
    """What no figure of force control is left without: half and double friction, the wall nearer and farther."""
    return {
        "friction\nhalf": rougher(experiment, 0.5),
        "friction\ndouble": rougher(experiment, 2.0),
        "wall at\n0.40 m": moved(experiment, 0.40),
        "wall at\n0.49 m": moved(experiment, 0.49),
    }
