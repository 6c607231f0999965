"""A laboratory: values of the parameters that the thesis does not state, and their effect on an experiment."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import resources
from typing import Any, Literal

from palpate.bench import Experiment, with_values
from palpate.bench.toml_parts import TomlFiles
from palpate.controllers.hybrid import HybridController
from palpate.environments import KelvinVoigtSurface
from palpate.errors import InputError, unknown
from palpate.files import read_toml

FILES = TomlFiles("laboratory", "a", "palpate_thesis", "laboratories")
KEYS = {"about", "base", "command", "sentences", "unknowns"}
LINEAR, RELAXING, STIFFENING = 0.0, 1.0, 2.0
"""Laws of the foam: spring and damper, standard linear solid, Hunt and Crossley."""
LISTED_START = 0.454
"""x from which the listed approach starts [m]."""
SWITCH, DESIRED = 5.0, 20.0
"""Forces between which a stiffness is a secant; a damping is given at the second [N]."""
FOAM_LIMIT = 15000.0
"""A linear surface of the bench below this stiffness is foam, above it rubber [N/m]."""


@dataclass(frozen=True)
class Unknown:
    """A parameter that the thesis does not state."""

    name: str  # field of `Laboratory`
    unit: str  # of its values; "" for a number without one
    prior: Literal["even", "log-even", "one of", "any seed"]  # distribution of its values
    low: float  # of its range; of a choice, the first value
    high: float  # likewise; the last value
    reason: str  # of the range
    choices: tuple[float, ...] = ()  # possible values, if they are a few

    @property
    def values(self) -> tuple[float, ...]:
        """Possible values of a choice or a seed."""
        return self.choices or tuple(range(int(self.low), int(self.high) + 1))

    def quantile(self, fraction: float) -> float:
        """The value below which this fraction of the prior lies, 0 to 1."""
        if self.prior == "log-even":
            value = math.exp((1.0 - fraction) * math.log(self.low) + fraction * math.log(self.high))
            return min(max(value, self.low), self.high)  # rounding passes the ends
        if self.prior == "even":
            return (1.0 - fraction) * self.low + fraction * self.high
        return float(self.values[min(int(fraction * len(self.values)), len(self.values) - 1)])

    def fraction(self, value: float) -> float:
        """Fraction of the prior below a value: the inverse of `quantile`, or the middle of the choice."""
        if self.prior == "log-even":
            return math.log(value / self.low) / math.log(self.high / self.low)
        if self.prior == "even":
            return (value - self.low) / (self.high - self.low)
        return (self.values.index(value) + 0.5) / len(self.values)

    def check(self, value: Any, where: str) -> float:
        """Return a value as a number.

        Raises:
            InputError: it is no number, or out of range.
        """
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"{where}: {self.name} must be a number, got {value!r}")
        if value in self.choices or (not self.choices and self.low <= value <= self.high):
            return float(value)
        wanted = f"one of {list(self.choices)}" if self.choices else f"between {self.low:g} and {self.high:g}"
        raise InputError(f"{where}: {self.name} must be {wanted} {self.unit}".rstrip() + f", got {value:g}")


def _read_unknowns() -> tuple[Unknown, ...]:
    text = (resources.files("palpate_thesis") / "unknowns.toml").read_text("utf-8")
    unknowns = []
    for name, row in tomllib.loads(text).items():
        choices = tuple(row.get("choices", ()))
        low, high = row.get("range", (*choices[:1], *choices[-1:]))
        unknowns.append(Unknown(name, row.get("unit", ""), row["prior"], low, high, row["reason"], choices))
    return tuple(unknowns)


UNKNOWNS = _read_unknowns()


@dataclass(frozen=True)
class Laboratory:
    """Values of the unknowns, with the units and ranges of unknowns.toml; the defaults are the hand-chosen bench.

    All values are relative to the bench: what a figure varies, such as half the friction or a nearer wall, is varied
    about the laboratory's own value. If `start` is None, the figures try several seeds of the identifier's weights.
    """

    friction: float = 1.0
    stiction: float = 1.2
    presliding: float = 1.0
    asymmetry: float = 0.0
    foam_law: float = LINEAR
    foam_stiffness: float = 5200.0
    foam_damping: float = 200.0
    foam_mass: float = 0.1
    foam_branch: float = 1.0
    foam_branch_time: float = 0.1
    foam_exponent: float = 1.5
    rubber_stiffness: float = 34500.0
    rubber_damping: float = 480.0
    rubber_mass: float = 0.05
    sticking: float = 0.7
    noise: float = 0.6
    beyond: float = 0.0
    roughness: float = 0.0
    covariance: float = 1e10
    compensation: float = 0.0
    blend: float = 0.002
    amplitude: float = 40.0
    weights: float = 0.5
    output_sum: float = 0.0
    start: float | None = None
    wall: float = 0.465
    arm_stiffness: float = math.inf
    arm_frequency: float = 100.0
    arm_damping: float = 0.02
    restart: float = 5.0

    def numbers(self) -> dict[str, float]:
        """Finite values by name."""
        return {k: v for k, v in asdict(self).items() if v is not None and math.isfinite(v)}

    def adapt(self, experiment: Experiment) -> Experiment:
        """The experiment as this laboratory would have run it."""
        if self == BENCH:
            return experiment
        parts = (self._friction, self._place, self._sensor, self._identification)
        changes = {key: value for part in parts for key, value in part(experiment).items()}
        if isinstance(experiment.surface, KelvinVoigtSurface):  # other laws are tried by figures on purpose
            changes["surface"] = self._surface(experiment.surface)
        return with_values(experiment, changes)

    def _friction(self, e: Experiment) -> dict[str, Any]:
        f = e.friction
        level = tuple(self.friction * c for c in f.coulomb)
        ratio = self.stiction / BENCH.stiction
        static = tuple(
            max(1.0, ratio * s / c) * a for s, c, a in zip(f.static, f.coulomb, level, strict=True)
        )
        stiffer = self.friction * self.presliding
        damping = self.friction * math.sqrt(self.presliding)
        return {
            "friction.coulomb": level,
            "friction.static": static,
            "friction.bristle_stiffness": tuple(stiffer * v for v in f.bristle_stiffness),
            "friction.bristle_damping": tuple(damping * v for v in f.bristle_damping),
            "friction.asymmetry": self.asymmetry,
        }

    def _place(self, e: Experiment) -> dict[str, Any]:
        offset, (x, y, phi) = self.wall - BENCH.wall, e.robot.start
        moved = 0.0 if x == LISTED_START else offset  # a shortened approach stays as near to the surface
        place: dict[str, Any] = {
            "wall.x": e.wall.x + offset,
            "robot.start": (x + moved, y, phi),
            "approach.first": e.approach.first + moved,
            "wall.side_friction": e.wall.side_friction * self.sticking / BENCH.sticking,
        }
        if math.isfinite(self.arm_stiffness):
            mode = {"stiffness": self.arm_stiffness, "frequency": self.arm_frequency}
            place["elastic"] = {**mode, "damping": self.arm_damping}
        return place

    def _sensor(self, e: Experiment) -> dict[str, Any]:
        return {
            "force_sensor.noise": e.force_sensor.noise * self.noise / BENCH.noise,
            "force_sensor.beyond": self.beyond,
            "force_sensor.roughness": self.roughness,
        }

    def _identification(self, e: Experiment) -> dict[str, Any]:
        changes: dict[str, Any] = {
            "identification.covariance": e.identification.covariance * self.covariance / BENCH.covariance
        }
        if e.force.restart > 0.0:
            changes["force.restart"] = self.restart
        # Only the presses for identification have a constant force; their program is not printed, and (4.10) and
        # (4.13) compensate friction. The printed program of the neural controller does not.
        if isinstance(e.controller, HybridController) and e.force.second is None:
            level = tuple(self.compensation * self.friction * c for c in e.friction.coulomb)
            changes |= {"compensation.level": level, "compensation.blend": (self.blend,) * 3}
        return changes

    def _surface(self, surface: KelvinVoigtSurface) -> dict[str, Any]:
        """The foam or the rubber of this laboratory, varied as `surface` is varied from the bench's."""
        name = "foam" if surface.stiffness < FOAM_LIMIT else "rubber"
        stiffness, damping, mass = (
            getattr(self, f"{name}_{key}") * getattr(surface, key) / getattr(BENCH, f"{name}_{key}")
            for key in ("stiffness", "damping", "mass")
        )
        if name == "foam" and self.foam_law == STIFFENING:
            return stiffening(stiffness, damping, mass, self.foam_exponent)
        linear = {"kind": "kelvin-voigt", "stiffness": stiffness, "damping": damping, "mass": mass}
        if name == "rubber" or self.foam_law == LINEAR:
            return linear
        branch = {"branch_stiffness": self.foam_branch * stiffness, "branch_time": self.foam_branch_time}
        return {**linear, "kind": "standard-linear-solid", **branch}


BENCH = Laboratory()


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


def laboratory_at(fractions: Sequence[float]) -> Laboratory:
    """The laboratory at these fractions of the priors, 0 to 1, in the order of `UNKNOWNS`."""
    return Laboratory(**{u.name: u.quantile(f) for u, f in zip(UNKNOWNS, fractions, strict=True)})


def prior_fractions(laboratory: Laboratory) -> tuple[float, ...]:
    """Fractions of the priors below a laboratory's values, in the order of `UNKNOWNS`; 1 for a value that is absent."""
    values = laboratory.numbers()
    return tuple(u.fraction(values[u.name]) if u.name in values else 1.0 for u in UNKNOWNS)


def load_laboratory(name: str) -> Laboratory:
    """A laboratory by its name ("bench", or one of `laboratories/`), or from a TOML file.

    Raises:
        InputError: no such laboratory or file, TOML that does not parse, an unknown key, a value out of range.
    """
    if name == "bench":
        return BENCH
    tables = read_toml(FILES.source(name), name)
    strange = sorted(set(tables) - KEYS)
    if strange:
        raise InputError(f"{name}: unknown key {strange[0]!r}; a laboratory has {', '.join(sorted(KEYS))}")
    values: Any = tables.get("unknowns")
    if not isinstance(values, dict):
        raise InputError(f"{name}: no table [unknowns]; a laboratory has its values there")
    base = load_laboratory(tables["base"]) if "base" in tables else BENCH
    return laboratory_from(values, name, base)


def describe_laboratory(name: str) -> str:
    """Description of a laboratory in a sentence or two, from its file."""
    if name == "bench":
        return "Laboratory: the bench, chosen by hand."
    about = str(read_toml(FILES.source(name), name).get("about", ""))
    if name == "inferred":
        about += " " + str(read_toml(FILES.source("calibrated"), "calibrated")["about"])
    return f"Laboratory: {name}. {about}".rstrip()


def laboratory_from(values: Mapping[str, Any], where: str, base: Laboratory) -> Laboratory:
    """A laboratory from named values; the others are those of another laboratory.

    Raises:
        InputError: a name that is no unknown, a value that is no number or out of its range.
    """
    by_name = {unknown.name: unknown for unknown in UNKNOWNS}
    for name in values:
        if name not in by_name:
            raise InputError(f"{where}: {unknown('unknown of the laboratory', name, tuple(by_name))}")
    return replace(base, **{name: by_name[name].check(value, where) for name, value in values.items()})


def laboratory_text(laboratory: Laboratory, start: Laboratory, **head: str | Sequence[str]) -> str:
    """A laboratory as a TOML file that `load_laboratory` reads, with the values that are not those of its base.

    The base is `start`, which `head` names in `base`, or the bench; `head` has the texts of all other keys.
    """
    values, others = laboratory.numbers(), start.numbers()
    changed = [f"{name} = {value!r}" for name, value in values.items() if value != others.get(name)]
    return (
        "\n".join([*(f"{k} = {json.dumps(v)}" for k, v in head.items()), "", "[unknowns]", *changed]) + "\n"
    )
