"""Printed numbers of the thesis (printed.toml), and the values of a laboratory that contradict them."""

import operator
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from itertools import product
from typing import Any, Literal

import msgspec

from palpate.bench import Experiment, load
from palpate.identifiers.neural_probe import SETTINGS
from palpate.robots.arm3 import Arm3
from palpate_thesis.figures import fig_6_10_17 as force
from palpate_thesis.laboratory import Laboratory
from palpate_thesis.neural_identifier.network import identifier_network

EXPERIMENTS: Mapping[str, Experiment] = {
    "press on foam": load("foam-rls"),
    "press on rubber": load("rubber-rls"),
    "steps on foam": force.ON_FOAM,
    "sine on foam": force.ON_FOAM_SINE,
    "small rate": force.SLOW_FOAM,
    "steps on rubber": force.ON_RUBBER,
    "sine on rubber": force.ON_RUBBER_SINE,
    "hybrid alone": force.HYBRID_ALONE.PARAMETERS,
    "free directions": force.FreeDirections.PARAMETERS,
}
"""Experiments of chapter 6. Those of force control start nearer to the surface, see `runs.SHORT`."""


class PrintedFact(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A number that the thesis prints."""

    path: str  # of the attribute that has the value, "robot.torque_limits"
    printed: Any  # number, list of them, or word; "none" for the absence of a value
    where: str  # place in the thesis, and what contradicts it there
    rule: Literal["equal", "at most", "above"] = "equal"  # of a laboratory's value to it

    def allows(self, value: Any) -> bool:
        """True if a value agrees with the printed one."""
        printed = None if self.printed == "none" else self.printed
        if isinstance(printed, list):
            values = tuple(value)
            return len(values) == len(printed) and all(map(RULES[self.rule], values, printed))
        return RULES[self.rule](value, printed)


RULES: Mapping[str, Callable[[Any, Any], bool]] = {
    "equal": operator.eq,
    "at most": operator.le,
    "above": operator.gt,
}


@cache
def printed_facts() -> Mapping[str, tuple[PrintedFact, ...]]:
    """Facts of printed.toml, by the names of what they are of; "each" stands for every experiment."""
    text = resources.files("palpate_thesis").joinpath("printed.toml").read_text("utf-8")
    groups = msgspec.toml.decode(text, type=dict[str, tuple[PrintedFact, ...]])
    return {", ".join(EXPERIMENTS) if of == "each" else of: facts for of, facts in groups.items()}


def subjects(laboratory: Laboratory) -> dict[str, Any]:
    """The arm, every experiment, the identifier and its probes in a laboratory, by name."""
    return {
        "arm": Arm3(),
        "identifier": identifier_network(laboratory),
        **{f"probe on {surface}": setting for surface, setting in SETTINGS.items()},
        **{name: laboratory.adapt(experiment) for name, experiment in EXPERIMENTS.items()},
    }


def contradictions(laboratory: Laboratory) -> list[str]:
    """Values of a laboratory that contradict a printed number, each in a line."""
    by_name = subjects(laboratory)
    lines = []
    for of, facts in printed_facts().items():
        for name, fact in product(of.split(", "), facts):
            value = operator.attrgetter(fact.path)(by_name[name])
            if not fact.allows(value):
                lines.append(f"{name}: {fact.path} is {value}, printed {fact.printed} ({fact.where})")
    return lines


def count_contradictions(laboratory: Laboratory) -> str:
    """Sentence on how many printed numbers a laboratory contradicts."""
    count, lines = sum(map(len, printed_facts().values())), contradictions(laboratory)
    named = f": {lines[0]}" if lines else ""
    return f"Contradicts {len(lines) or 'none'} of the {count} printed numbers{named}."
