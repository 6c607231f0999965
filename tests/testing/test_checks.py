"""The suite that users run on their parts: it passes good ones, and each of its laws catches what breaks it."""

from functools import partial

import numpy as np
import pytest

from own_parts import Normal, Push, Spring
from palpate.cli import main
from palpate.errors import InputError
from palpate.testing import controller_checks, identifier_checks, outcomes, surface_checks
from palpate.testing.check import checks_of
from palpate.testing.controllers import IN_PLAIN

pytestmark = pytest.mark.usefixtures("permitted")


def failing(checks):
    return {one.sentence for one in outcomes(checks) if one.failed}


@pytest.mark.parametrize("check", controller_checks(Push())[: len(IN_PLAIN)], ids=str)
def test_a_good_controller(check):
    check()


@pytest.mark.parametrize("check", identifier_checks(Normal), ids=str)
def test_a_good_identifier(check):
    check()


@pytest.mark.long
@pytest.mark.parametrize("check", [*surface_checks(Spring(5000.0)), *controller_checks(Push())], ids=str)
def test_good_parts_compiled(check):
    check()


COUNT = [0]


class Remembers(Push):
    """Counts its ticks outside its state."""

    def step(self, state, sense, task, model):
        COUNT[0] += 1
        torque, state = super().step(state, sense, task, model)
        return torque * float(COUNT[0]), state


class Silent(Push):
    def trouble(self, state):
        return None


def test_bad_controllers_are_caught():
    assert failing(controller_checks(Remembers())[:4]) == {"all memory is in the state"}
    assert failing(controller_checks(Silent())[:4]) >= {"report trouble and rest fit the loop"}


def test_a_surface_that_gives_energy_is_caught():
    active = Spring(5000.0, 100.0)._replace(damping=-20.0)
    checks = [c for c in surface_checks(active) if c.law.__name__ == "surface_is_passive"]
    assert failing(checks) == {"surface is passive"}


class Takes(Normal):
    def update(self, regressor, force):
        self.n += 1


def test_bad_identifiers_are_caught():
    found = failing(identifier_checks(Takes))
    assert {"stiffness of foam is found", "bad samples are refused without effect"} <= found


def test_an_estimate_of_another_shape_is_caught():
    class Two(Normal):
        def estimate(self):
            whole = super().estimate()
            return type(whole)(("B", "K"), whole.theta[1:], whole.covariance[1:, 1:], whole.samples)

    assert "estimate is finite" in failing(identifier_checks(partial(Two)))


def test_the_command_runs_them(capsys):
    assert main(["checks", "own_parts:Normal"]) == 0
    assert "all 8 checks hold" in capsys.readouterr().out
    assert main(["checks"]) == 2


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("own_parts", "neither module:Class nor a TOML file"),
        ("own_parts:mean_force", "is no part"),
        ("own_parts:Spring", "fields without a default"),
        ("nothing.toml", "no such file"),
    ],
)
def test_what_cannot_be_checked_is_refused(name, why):
    with pytest.raises(InputError, match=why):
        checks_of(name)


def test_outcomes_go_on_after_a_failure():
    found = list(outcomes(identifier_checks(Takes)))
    assert len(found) == len(identifier_checks(Takes))
    assert np.any([not one.failed for one in found])
