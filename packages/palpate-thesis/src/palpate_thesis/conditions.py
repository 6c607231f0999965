"""Worlds that the figures are tried in: other surfaces, other friction, other poses; as changes of an experiment."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeVar

from palpate.bench import Experiment
from palpate_thesis.claims import often, on_one_line
from palpate_thesis.runs import VARIED_SEEDS, Runs

T = TypeVar("T")
W = TypeVar("W")

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


SURFACES: Mapping[str, Mapping[str, Any]] = {
    "foam": {},
    "rubber": RUBBER_SURFACE,
    "relaxing\nfoam": RELAXING_FOAM,
}


def move_wall(experiment: Experiment, x: float) -> Mapping[str, Any]:
    """Changes that bring start, approach and wall together to a wall at x [m]."""
    by = x - experiment.wall.x
    start = experiment.robot.start
    return {
        "wall.x": x,
        "robot.start": (start[0] + by, *start[1:]),
        "approach.first": experiment.approach.first + by,
    }


LUGRE = ("coulomb", "static", "bristle_stiffness", "bristle_damping")


def rougher(experiment: Experiment, factor: float, *names: str) -> Mapping[str, Any]:
    """Changes that multiply the joints' friction: parameters of these names, or all."""
    f = experiment.friction
    return {f"friction.{n}": tuple(factor * v for v in getattr(f, n)) for n in names or LUGRE}


def friction_and_pose(experiment: Experiment) -> dict[str, Mapping[str, Any]]:
    """Variations of every force-control figure: half and double friction, the wall nearer and farther."""
    return {
        "friction\nhalf": rougher(experiment, 0.5),
        "friction\ndouble": rougher(experiment, 2.0),
        "wall at\n0.40 m": move_wall(experiment, 0.40),
        "wall at\n0.49 m": move_wall(experiment, 0.49),
    }


def by_condition(
    runs: Runs, worlds: Mapping[str, W], work: Callable[[W, int], T], full: Collection[str]
) -> dict[str, list[T]]:
    """`work` of each world and seed, by the world's name: over all seeds in the worlds of `full`, a few in others."""
    cases = {
        name: [(world, seed) for seed in runs.seeds[: None if name in full else VARIED_SEEDS]]
        for name, world in worlds.items()
    }
    return runs.map_each(lambda case: work(*case), cases)


def stops_holding(found: Mapping[str, Sequence[T]], holds: Callable[[T], bool]) -> str:
    """A sentence: under which variations a conclusion holds, and under which it does not."""
    broken, kept = [], []
    for name, runs in found.items():
        told = on_one_line(name)
        if often(map(holds, runs)):
            kept.append(told)
        else:
            broken.append(f"{told} ({sum(map(holds, runs))} of {len(runs)} runs)")
    parts = [f"holds with: {', '.join(kept)}"] if kept else []
    parts += [f"does not with: {', '.join(broken)}"] if broken else ["and under every variation tried"]
    return f"It {'; it '.join(parts) if broken else ', '.join(parts)}."
