"""One check of a part, its outcome, and the checks of a plug-in."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from palpate.bench.tables import load
from palpate.bench.toml_parts import CONTROLLER, IDENTIFIER, SURFACE, Role, find_role, plugin_table
from palpate.errors import InputError
from palpate.plugins import is_plugin, reason


@dataclass(frozen=True)
class Check:
    """A sentence that must be true of a part; calling it raises an AssertionError if it is not.

    Args:
        law: a function of the subject; its name is the sentence.
        subject: a part, or a maker of an identifier.
    """

    law: Callable[[Any], None]
    subject: Any

    def __call__(self) -> None:
        self.law(self.subject)

    def __str__(self) -> str:
        return self.law.__name__

    @property
    def sentence(self) -> str:
        """The law in words."""
        return self.law.__name__.replace("_", " ")


@dataclass(frozen=True)
class CheckOutcome:
    """Outcome of a check.

    Args:
        sentence: what must be true.
        failed: why it is not; "" if it is.
    """

    sentence: str
    failed: str


def outcomes(checks: Iterable[Check]) -> Iterator[CheckOutcome]:
    """Run all checks; an exception of one does not stop the others."""
    for check in checks:
        try:
            check()
        except AssertionError as error:
            yield CheckOutcome(check.sentence, " ".join(str(error).split()) or "it fails")
        except Exception as error:  # noqa: BLE001 - whatever the user's own code raises
            yield CheckOutcome(check.sentence, reason(error))
        else:
            yield CheckOutcome(check.sentence, "")


def require(condition: object, why: str) -> None:
    """Raise the AssertionError of a check; not by `assert`, which an optimising interpreter leaves out."""
    if not condition:
        raise AssertionError(why)


TICK, WALL = 0.001, 0.465
"""Time between ticks [s], and x of the surface [m], for which a part is made that names neither."""


def checks_of(name: str) -> dict[str, list[Check]]:
    """The checks of a plug-in, ``module:Class``, or of each part of the user's in an experiment's TOML file.

    Returns:
        The checks by their subject, as "controller student:Damped".

    Raises:
        InputError: the plug-in cannot be imported, is no part, needs numbers, or the file has no part of the user's.
    """
    if Path(name).suffix == ".toml":
        return _of_experiment(name)
    if not is_plugin(name):
        raise InputError(
            f"{name!r} is neither module:Class nor a TOML file of an experiment; give one of them"
        )
    role = find_role(name)
    make_table = plugin_table(role, name)
    try:
        table = make_table()
    except TypeError as error:
        raise InputError(
            f"{name} has fields without a default ({error}); give them one, or name an experiment's file that has "
            "their numbers"
        ) from None
    return {f"{role.key} {name}": _checks(role, table, TICK, WALL)}


def _of_experiment(name: str) -> dict[str, list[Check]]:
    experiment = load(name)
    checks = {}
    for role in (CONTROLLER, SURFACE, IDENTIFIER):
        table = getattr(experiment, role.key)
        if hasattr(table, "plugin"):
            subject = f"{role.key} {table.plugin.name}"
            checks[subject] = _checks(role, table, 1.0 / experiment.run.rate, experiment.wall.x)
    if not checks:
        raise InputError(f"{name} has no part of your own; name one as kind = 'module:Class' in it")
    return checks


def _checks(role: Role, table: Any, tick: float, wall: float) -> list[Check]:
    from palpate.testing import controller_checks, identifier_checks, surface_checks

    if role is IDENTIFIER:
        return identifier_checks(partial(table.build, tick))
    part = table.build(tick, wall)
    return controller_checks(part) if role is CONTROLLER else surface_checks(part)
