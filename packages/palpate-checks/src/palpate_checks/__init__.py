"""Laws of every part: the conformance suite of palpate's own parts, for your own parts too.

import pytest
from palpate_checks import controller_checks

@pytest.mark.parametrize("check", controller_checks(Damped(ki=3.0)), ids=str)
def test_my_controller(check):
    check()

A check that fails raises an AssertionError that names the violated law. ``palpate checks module:Class`` runs them all.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate_checks.check import Check, CheckOutcome, outcomes
    from palpate_checks.controllers import controller_checks
    from palpate_checks.identifiers import identifier_checks
    from palpate_checks.surfaces import surface_checks

__all__ = ["Check", "CheckOutcome", "controller_checks", "identifier_checks", "outcomes", "surface_checks"]
_MODULES = {
    "controller_checks": "controllers",
    "identifier_checks": "identifiers",
    "surface_checks": "surfaces",
}


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first used: the help of the command imports none."""
    if name not in __all__:
        raise AttributeError(f"palpate_checks has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"palpate_checks.{_MODULES.get(name, 'check')}"), name)
