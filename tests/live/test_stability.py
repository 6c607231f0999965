"""Where the loop is stable, by a process of its own: the answers are those of `palpate.analysis`."""

import threading

import pytest

from live.conftest import PATIENCE, near
from palpate.analysis import linearise, margins
from palpate.live.stability import Stability, answers
from palpate.report.numbers import plain


def test_the_first_answers_are_those_of_the_linear_model():
    experiment = near()
    found = answers(experiment)
    assert next(found)["text"] == "Stable on this surface, by the linear model."
    second = next(found)
    assert f"the gain may grow {plain(margins(linearise(experiment)).gain, 2)} times" in second["text"]
    assert second["more"]


def test_an_unstable_gain_is_said():
    unstable = near(**{"controller.kf": 40.0})
    assert next(answers(unstable))["text"] == "Unstable on this surface, by the linear model."


def test_what_has_no_state_of_rest_is_said():
    found = list(answers(near(**{"force.first": 500.0})))
    assert found[-1]["stiffness"] is None
    assert found[-1]["text"].startswith("Nothing is known of its stability")


@pytest.mark.long
def test_a_process_of_its_own_answers_and_ends():
    came = threading.Event()
    own = Stability(came.set)
    own.ask(near())
    assert own.latest["text"].startswith("Working out")
    assert came.wait(PATIENCE)
    assert "linear model" in own.latest["text"]
    process = own._process
    own.close()
    assert process.poll() is not None


def test_a_proof_is_not_claimed_of_a_surface_that_it_does_not_cover(monkeypatch):
    import palpate.force

    class Proof:
        def __init__(self):
            self.claims = [type("Claim", (), {"kind": "held", "low": 400.0, "high": 4e5})()]

        def check(self):
            return type("Verdict", (), {"holds": True})()

    # The proof itself takes ten seconds, and is `tests/force`'s.
    monkeypatch.setattr(palpate.force, "certify", lambda gains, adapting: Proof())
    (bare,) = answers(near("foam-cautious", **{"surface.damping": 0.0}))
    (damped,) = answers(near("foam-cautious"))
    assert bare["stiffness"] == damped["stiffness"] == [400.0, 4e5]
    assert bare["proved"]
    assert not damped["proved"]
    assert "of which nothing is proved" in damped["text"]
