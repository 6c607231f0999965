"""The checks of a plug-in: of its class, or of its instance in an experiment."""

from functools import partial
from pathlib import Path
from typing import Any

from palpate.bench.tables import Experiment, load
from palpate.bench.toml_parts import CONTROLLER, IDENTIFIER, SURFACE, Role, role_of, table_of
from palpate.errors import InputError
from palpate.plugins import is_plugin
from palpate_checks.check import Check
from palpate_checks.controllers import TICK, WALL, controller_checks
from palpate_checks.identifiers import identifier_checks
from palpate_checks.surfaces import surface_checks


def checks_of(name: str) -> dict[str, list[Check]]:
    """The checks of a plug-in, ``module:Class``, or of every part of the user's in an experiment's TOML file.

    Returns:
        They, by what they are of: "controller student:Damped".

    Raises:
        InputError: it cannot be imported, is no part, needs numbers, or the file has no part of the user's.
    """
    if Path(name).suffix == ".toml":
        return _of_experiment(name)
    if not is_plugin(name):
        raise InputError(
            f"{name!r} is neither module:Class nor a TOML file of an experiment; give one of them"
        )
    role = role_of(name)
    kind = table_of(role, name)
    try:
        table = kind()
    except TypeError as error:
        raise InputError(
            f"{name} has fields without a default ({error}); give them one, or name an experiment's file that has "
            "their numbers"
        ) from None
    return {f"{role.key} {name}": _checks(role, table, TICK, WALL)}


def _of_experiment(name: str) -> dict[str, list[Check]]:
    experiment: Experiment = load(name)
    tick, wall = 1.0 / experiment.run.rate, experiment.wall.x
    found = {}
    for role in (CONTROLLER, SURFACE, IDENTIFIER):
        table = getattr(experiment, role.key)
        if hasattr(table, "plugin"):
            found[f"{role.key} {table.plugin.name}"] = _checks(role, table, tick, wall)
    if not found:
        raise InputError(f"{name} has no part of your own; name one as kind = 'module:Class' in it")
    return found


def _checks(role: Role, table: Any, tick: float, wall: float) -> list[Check]:
    if role is IDENTIFIER:
        return identifier_checks(partial(table.build, tick))
    part = table.build(tick, wall)
    return controller_checks(part) if role is CONTROLLER else surface_checks(part)
