"""The phases: look, press, find the surface lost, look again."""

import itertools

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build
from palpate.bench.force_input import Sequence
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.references import Approach

TICK = 0.001
SEQUENCE = Sequence(Approach(0.454, 0.1, 0.456, 0.001, 0.05), switch=5.0, release=1.0, wait=0.02, tick=TICK)


def phases(forces, sequence=SEQUENCE, x=0.465):
    state, states = sequence.start(), []
    for force in forces:
        state = sequence.step(state, x, float(force))
        states.append(state)
    return states


def test_it_holds_and_then_steps_on_the_ticks_of_the_approach():
    states = phases([0.0] * 260)
    assert {s.phase for s in states} == {APPROACH}
    x = np.array([s.x_d for s in states])
    # The first step call is the tick at time 0, so `since` counts from there.
    steps = np.flatnonzero(np.diff(x)) + 1
    assert np.diff(steps).tolist() == [50] * (len(steps) - 1)
    assert x[0] == 0.454
    assert x[-1] == pytest.approx(0.459)


def test_contact_is_made_at_the_switch_and_kept_down_to_the_release():
    states = phases([0.0, 4.99, 5.0, 30.0, 1.0, 0.99])
    assert [s.phase for s in states] == [APPROACH, APPROACH, CONTACT, CONTACT, CONTACT, LOST]
    assert [s.since for s in states[2:5]] == pytest.approx([0.0, TICK, 2 * TICK])
    assert states[2].x0 == 0.465
    assert states[-1].contacts == 1.0


def test_after_a_loss_it_waits_and_then_approaches_without_the_hold():
    forces = [6.0, 0.0] + [0.0] * 60
    states = phases(forces)
    lost = [s.phase for s in states].count(LOST)
    assert lost == 20
    anew = next(s for s in states[2:] if s.phase == APPROACH)
    assert anew.x_d == 0.456
    assert states[30].phase == APPROACH


def test_a_surface_that_yields_is_lost_and_looked_for_again():
    """A force schedule that asks for less than the release after a while: the arm lets go, waits, comes back."""
    experiment = quick(
        "foam-hybrid",
        run={"duration": 4.0, "losses": 0},
        force={"first": 15.0, "second": -5.0, "period": 0.3},
        approach={"release": 0.5, "wait": 0.1},
    )
    record = build(experiment).run(4.0, seed=2)
    phase = record["phase"]
    changes = [(a, b) for a, b in itertools.pairwise(phase) if a != b]
    assert changes[:2] == [(APPROACH, CONTACT), (CONTACT, LOST)]
    assert changes.count((APPROACH, CONTACT)) + changes.count((LOST, CONTACT)) >= 2, "found again"
    at = 1 + int(np.argmax((phase[:-1] == CONTACT) & (phase[1:] == LOST)))
    assert record["force_measured"][at] < 0.5 <= record["force_measured"][at - 1]
    assert record["force_desired"][at] == 0.0
    assert not record["displacement"][phase != CONTACT].any()
