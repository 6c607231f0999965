"""Laws of every part: the conformance suite of palpate's own parts, for your own parts too.

import pytest
from palpate.testing import controller_checks

@pytest.mark.parametrize("check", controller_checks(Damped(ki=3.0)), ids=str)
def test_my_controller(check):
    check()

A check that fails raises an AssertionError that names the violated law. ``palpate checks module:Class`` runs them all.
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.testing.check import Check, CheckOutcome, outcomes
    from palpate.testing.controllers import controller_checks
    from palpate.testing.identifiers import identifier_checks
    from palpate.testing.surfaces import surface_checks

__all__ = ["Check", "CheckOutcome", "controller_checks", "identifier_checks", "outcomes", "surface_checks"]

_HOMES = {
    "check": ("Check", "CheckOutcome", "outcomes"),
    "controllers": ("controller_checks",),
    "identifiers": ("identifier_checks",),
    "surfaces": ("surface_checks",),
}
__getattr__ = importer(__name__, _HOMES)
