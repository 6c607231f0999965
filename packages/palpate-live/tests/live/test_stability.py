"""Where the loop is stable, by a process of its own: the answers are those of `palpate_studies.analysis`."""

import threading

import pytest

from live.conftest import PATIENCE, near
from palpate.force.certificate import Claim
from palpate.force.expected import margins as margins_on
from palpate.press.engines import loop_of, press_gains
from palpate.units import plain
from palpate_live import stability
from palpate_live.stability import OfArm, OfBench, Stability, answers
from palpate_studies.analysis import linearise, margins


@pytest.mark.long
def test_the_first_answers_are_those_of_the_linear_model():
    experiment = near()
    found = answers(OfBench(experiment))
    assert next(found)["text"] == "Stable on this surface, by the linear model."
    second = next(found)
    assert (
        f"the gain may grow by a factor of {plain(margins(linearise(experiment)).gain, 2)}" in second["text"]
    )
    assert second["more"]


def test_an_unstable_gain_is_said():
    unstable = near(**{"controller.kf": 40.0})
    assert next(answers(OfBench(unstable)))["text"] == "Unstable on this surface, by the linear model."


def test_what_has_no_state_of_rest_is_said():
    found = list(answers(OfBench(near(**{"force.first": 500.0}))))
    assert found[-1]["stiffness"] is None
    assert found[-1]["text"].startswith("Its stability is unknown")


@pytest.mark.long
def test_a_process_of_its_own_answers_and_ends():
    came = threading.Event()
    own = Stability(came.set)
    own.ask(OfBench(near()))
    assert own.latest["text"].startswith("Computing")
    assert came.wait(PATIENCE)
    assert "linear model" in own.latest["text"]
    process = own._process
    own.close()
    assert process.poll() is not None


@pytest.fixture
def proof(monkeypatch):
    """A claim of surfaces without damping: the proof itself takes ten seconds, and is `tests/force`'s."""
    kinds = ("held", "adapting")
    claims = tuple(
        Claim(kind=kind, low=400.0, high=4e5, least=0.0, most=0.0, shares=(0.0, 1.0), ages=(2, 2))
        for kind in kinds
    )
    monkeypatch.setattr(stability, "_proof", lambda encoded, adapting: claims[: 1 + adapting])


def test_a_proof_is_not_claimed_of_a_surface_that_it_does_not_cover(proof):
    bare = list(answers(OfBench(near("foam-cautious", **{"surface.damping": 0.0}))))[-1]
    damped = list(answers(OfBench(near("foam-cautious"))))[-1]
    assert bare["stiffness"] == damped["stiffness"] == [400.0, 4e5]
    assert bare["proved"]
    assert not damped["proved"]
    assert "does not cover the present surface" in damped["text"]


def test_an_arm_s_proof_and_margins_are_those_of_its_gains(proof):
    gains = press_gains(loop_of("ur5e", "UR5e", "position", 5.0), 20.0)
    found = list(answers(OfArm(gains, 5000.0, 0.0)))
    assert "Proving" in found[0]["text"]
    assert (
        f"the gain may grow by a factor of {plain(margins_on(gains, gains.seen_cap).gain, 2)}"
        in found[-1]["text"]
    )
    # The claim is of what the encoders feel; the page's axis of the surface's own stiffness.
    assert found[-1]["stiffness"] == [gains.arm.surface(400.0), gains.cap]
    assert "while it adapts: every constant K, without damping" in found[-1]["text"]
    softer = list(answers(OfArm(gains, 100.0, 0.0)))[-1]
    assert not softer["proved"]


@pytest.mark.long
def test_what_cannot_be_proved_is_said(monkeypatch):
    monkeypatch.setattr(stability, "_proof", lambda encoded, adapting: ())
    gains = press_gains(loop_of("fr3", "FR3", "torque", 5.0), 20.0)
    assert list(answers(OfArm(gains, 5000.0, 0.0)))[-1]["text"].startswith("Nothing could be proved")
