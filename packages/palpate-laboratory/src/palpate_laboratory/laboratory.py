"""A laboratory: the thesis' unstated parameters, as one frozen value, and their effect on an experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from palpate.bench import Experiment, with_values
from palpate.bench.toml_parts import TomlFiles
from palpate.controllers.neural import NeuralController
from palpate.environments import KelvinVoigtSurface
from palpate.errors import InputError, unknown
from palpate.files import read_toml
from palpate_laboratory.unknowns import BY_NAME, LINEAR, LISTING, RELAXING, STIFFENING, UNKNOWNS

FILES = TomlFiles("laboratory", "a", "palpate_laboratory", ("shipped",))
KEYS = {"about", "command", "seed", "unknowns"}


def load_laboratory(name: str) -> Laboratory:
    """A laboratory by its name, "inferred", or from a TOML file.

    Raises:
        InputError: no such laboratory or file, TOML that does not parse, an unknown key, a value out of range.
    """
    tables = read_toml(FILES.source(name), name)
    strange = sorted(set(tables) - KEYS)
    if strange:
        raise InputError(f"{name}: unknown key {strange[0]!r}; a laboratory has {', '.join(sorted(KEYS))}")
    unknowns: Any = tables.get("unknowns")
    if not isinstance(unknowns, dict):
        raise InputError(f"{name}: no table [unknowns]; a laboratory has its values there")
    return laboratory_from(unknowns, name)


def text(laboratory: Laboratory, about: str, command: str, seed: int) -> str:
    """A laboratory as a TOML file that `named` reads."""
    import json

    lines = [
        f"about = {json.dumps(about)}",
        f"command = {json.dumps(command)}",
        f"seed = {seed}",
        "",
        "[unknowns]",
    ]
    lines += [f"{name} = {value!r}" for name, value in laboratory.numbers().items()]
    return "\n".join(lines) + "\n"


BENCH_FOAM = (5200.0, 200.0, 0.1)
SWITCH, DESIRED = 5.0, 20.0
"""Forces between which a stiffness is a secant, and at which a damping is told [N]."""
BETWEEN = 15000.0
"""A linear surface of the bench below it is foam, above it rubber [N/m]."""


def is_foam(stiffness: float) -> bool:
    """Whether a linear surface of the bench stands for the foam."""
    return stiffness < BETWEEN


@dataclass(frozen=True)
class Foam:
    """A foam: its law, secant stiffness [N/m], damping at 20 N [N s/m], mass [kg], and what the law adds."""

    law: float
    stiffness: float
    damping: float
    mass: float
    branch: float  # of the relaxing branch, over K
    branch_time: float  # [s]
    exponent: float

    def instead_of(self, surface: KelvinVoigtSurface) -> dict[str, Any]:
        """This foam as a table, varied as the bench's foam is in `surface`."""
        stiffness, damping, mass = (
            own * there / bench
            for own, there, bench in zip(
                (self.stiffness, self.damping, self.mass),
                (surface.stiffness, surface.damping, surface.mass),
                BENCH_FOAM,
                strict=True,
            )
        )
        if self.law == STIFFENING:
            return stiffening(stiffness, damping, mass, self.exponent)
        linear = {"kind": "kelvin-voigt", "stiffness": stiffness, "damping": damping, "mass": mass}
        if self.law != RELAXING:
            return linear
        branch = {"branch_stiffness": self.branch * stiffness, "branch_time": self.branch_time}
        return {**linear, "kind": "standard-linear-solid", **branch}


def stiffening(secant: float, damping: float, mass: float, exponent: float) -> dict[str, Any]:
    """The Hunt-Crossley surface with this secant from 5 to 20 N [N/m] and this damping at 20 N [N s/m]."""
    spread = DESIRED ** (1.0 / exponent) - SWITCH ** (1.0 / exponent)
    stiffness = (spread * secant / (DESIRED - SWITCH)) ** exponent
    return {
        "kind": "hunt-crossley",
        "stiffness": stiffness,
        "damping": damping * stiffness / DESIRED,
        "exponent": exponent,
        "mass": mass,
    }


BENCH_NOISE, BENCH_WALL, BENCH_STICKING, BENCH_MOTOR2 = 0.6, 0.465, 0.7, 2.5
BENCH_STICTION, BENCH_COVARIANCE = 1.2, 1e10
BENCH_RUBBER = (34500.0, 480.0, 0.05)


@dataclass(frozen=True)
class Laboratory:
    """Values of the unknowns (`unknowns.UNKNOWNS` says which, in which units and ranges); as they stand, the bench's.

    Everything is taken relative to the hand-chosen bench: what a figure varies, half the friction or a nearer wall,
    is varied about the laboratory's own value. A `start` of None tries the seeds of the identifier's weights that the
    figures try.
    """

    friction: float = 1.0
    stiction: float = BENCH_STICTION
    presliding: float = 1.0
    asymmetry: float = 0.0
    foam_law: float = LINEAR
    foam_stiffness: float = 5200.0
    foam_damping: float = 200.0
    foam_mass: float = 0.1
    foam_branch: float = 1.0
    foam_branch_time: float = 0.1
    foam_exponent: float = 1.5
    rubber_stiffness: float = BENCH_RUBBER[0]
    rubber_damping: float = BENCH_RUBBER[1]
    rubber_mass: float = BENCH_RUBBER[2]
    sticking: float = BENCH_STICKING
    noise: float = BENCH_NOISE
    beyond: float = 0.0
    roughness: float = 0.0
    covariance: float = BENCH_COVARIANCE
    initial_stiffness: float = 2e5
    amplitude: float = 40.0
    weights: float = 0.5
    start: float | None = None
    controller_weights: float = LISTING
    wall: float = BENCH_WALL
    motor2: float = BENCH_MOTOR2
    arm_stiffness: float = math.inf
    arm_frequency: float = 100.0
    arm_damping: float = 0.02
    restart: float = 5.0

    @property
    def chosen(self) -> bool:
        """Whether it is the hand-chosen bench."""
        return self == CHOSEN

    def numbers(self) -> dict[str, float]:
        """Its values by name, without those that are not set."""
        return {k: v for k, v in asdict(self).items() if v is not None and math.isfinite(v)}

    def of(self, experiment: Experiment) -> Experiment:
        """The experiment as this laboratory would have run it."""
        if self.chosen:
            return experiment
        changes = {
            **self._friction(experiment),
            **self._place(experiment),
            **self._sensor(experiment),
            **self._thinking(experiment),
        }
        surface = self._surface(experiment.surface)
        if surface is not None:
            changes["surface"] = surface
        return with_values(experiment, changes)

    def _friction(self, e: Experiment) -> dict[str, Any]:
        f = e.friction
        level = tuple(self.friction * c for c in f.coulomb)
        ratio = self.stiction / BENCH_STICTION
        static = tuple(
            max(1.0, ratio * s / c) * a for s, c, a in zip(f.static, f.coulomb, level, strict=True)
        )
        stiffer = self.friction * self.presliding
        return {
            "friction.coulomb": level,
            "friction.static": static,
            "friction.bristle_stiffness": tuple(stiffer * v for v in f.bristle_stiffness),
            "friction.bristle_damping": tuple(
                self.friction * math.sqrt(self.presliding) * v for v in f.bristle_damping
            ),
            "friction.asymmetry": self.asymmetry,
        }

    def _place(self, e: Experiment) -> dict[str, Any]:
        by, (x, y, phi) = self.wall - BENCH_WALL, e.robot.start
        first, second, third = e.robot.torque_limits
        place: dict[str, Any] = {
            "wall.x": e.wall.x + by,
            "robot.start": (x + by, y, phi),
            "approach.first": e.approach.first + by,
            "wall.side_friction": e.wall.side_friction * self.sticking / BENCH_STICKING,
            "robot.torque_limits": (first, second * self.motor2 / BENCH_MOTOR2, third),
        }
        if math.isfinite(self.arm_stiffness):
            place["elastic"] = {
                "stiffness": self.arm_stiffness,
                "frequency": self.arm_frequency,
                "damping": self.arm_damping,
            }
        return place

    def _sensor(self, e: Experiment) -> dict[str, Any]:
        return {
            "force_sensor.noise": e.force_sensor.noise * self.noise / BENCH_NOISE,
            "force_sensor.beyond": self.beyond,
            "force_sensor.roughness": self.roughness,
        }

    def _thinking(self, e: Experiment) -> dict[str, Any]:
        mass, damping, _ = e.identification.initial
        changes: dict[str, Any] = {
            "identification.covariance": e.identification.covariance * self.covariance / BENCH_COVARIANCE,
            "identification.initial": (mass, damping, self.initial_stiffness),
        }
        if e.force.restart > 0.0:
            changes["force.restart"] = self.restart
        of_listing = isinstance(e.controller, NeuralController) and e.controller.weights == "thesis"
        if of_listing and self.controller_weights != LISTING:
            changes["controller.weights"] = "random"
            changes["controller.weights_seed"] = int(self.controller_weights)
        return changes

    def _surface(self, surface: Any) -> dict[str, Any] | None:
        """The foam or the rubber instead of the bench's; None for the other laws that a figure tries beside them."""
        if not isinstance(surface, KelvinVoigtSurface):
            return None
        if is_foam(surface.stiffness):
            foam = Foam(
                self.foam_law,
                self.foam_stiffness,
                self.foam_damping,
                self.foam_mass,
                self.foam_branch,
                self.foam_branch_time,
                self.foam_exponent,
            )
            return foam.instead_of(surface)
        stiffness, damping, mass = BENCH_RUBBER
        return {
            "kind": "kelvin-voigt",
            "stiffness": surface.stiffness * self.rubber_stiffness / stiffness,
            "damping": surface.damping * self.rubber_damping / damping,
            "mass": surface.mass * self.rubber_mass / mass,
        }


CHOSEN = Laboratory()
NAMES = tuple(field.name for field in fields(Laboratory))


def laboratory_at(shares: Sequence[float]) -> Laboratory:
    """The laboratory at these shares of the priors, each from 0 to 1, in the order of the unknowns."""
    return Laboratory(**{u.name: u.at(float(s)) for u, s in zip(UNKNOWNS, shares, strict=True)})


def laboratory_from(values: Mapping[str, Any], where: str) -> Laboratory:
    """A laboratory from named values; those left out are the bench's.

    Raises:
        InputError: a name that is no unknown, a value that is no number or out of its range.
    """
    for name, value in values.items():
        if name not in BY_NAME:
            raise InputError(f"{where}: {unknown('unknown of the laboratory', name, NAMES)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"{where}: {name} must be a number, got {value!r}")
        of = BY_NAME[name]
        if not of.holds(float(value)):
            told = f"one of {list(of.choices)}" if of.choices else f"between {of.low:g} and {of.high:g}"
            raise InputError(f"{where}: {name} must be {told} {of.unit}".rstrip() + f", got {value:g}")
    return Laboratory(**{name: float(value) for name, value in values.items()})
