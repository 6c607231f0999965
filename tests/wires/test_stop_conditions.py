"""Each reason to stop, by the reading that is one; and a reading that is none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.force import ForceLoop, load_arm
from palpate.press.engines import press_gains
from palpate.wires import ArmReading, AtRest, PressLimits, PressTask, check_order
from palpate.wires.guard import Moment, reading_fault, reason_to_stop

GAINS = press_gains(load_arm("ur5e"), 10.0)
THETA = GAINS.theta
SENSE = ArmReading(100.0, 5.0, (0.0, 0.0, -10.0), (0.0,) * 3, (0.4, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0))
REST = AtRest(np.array(SENSE.position), np.zeros(3), 0.1, 0.0, 0.1, 500.0, SENSE, 95.0)
MOMENT = Moment(SENSE, 10.0, 0.001, 0.0, 0, 0.0, 1.0)


@pytest.fixture(scope="module")
def order():
    """Made by the first test: a loop is compiled where there is none yet."""
    task = PressTask(10.0, (0.0, 0.0, -1.0), 3.0, 0.001)
    return check_order(ForceLoop(GAINS), task, PressLimits(force=40.0, speed=0.02, travel=0.01, seconds=20.0))


def test_a_press_within_its_limits_goes_on(order):
    assert reason_to_stop(MOMENT, order, REST) is None


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"sense": SENSE._replace(force=(0.0, 40.1, 0.0))}, "the force is 40.1 N, above the limit of 40 N"),
        ({"force": -5.1}, "against the press"),
        ({"depth": 0.0101}, "10.1 mm from the start"),
        ({"depth": -0.0101}, "-10.1 mm from the start"),
        ({"sense": SENSE._replace(position=(0.42, 0.0, 0.299))}, "left the line"),
        ({"speed": 0.06}, "moves at 60 mm/s"),
        ({"since_start": 20.1}, "the time limit of 20 s is over"),
        ({"age": 1.01 * THETA}, "late, more than the loop's lag"),
    ],
)
def test_each_limit_says_what_was_passed(order, changed, says):
    assert says in reason_to_stop(MOMENT._replace(**changed), order, REST)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"force": (math.nan, 0.0, 0.0)}, "no number"),
        ({"position": (math.inf, 0.0, 0.0)}, "no number"),
        ({"stamp": math.nan}, "no number"),
        ({"stamp": 4.0}, "went back, from 5 to 4 s"),
        ({"stamp": 5.0}, "went back"),
        ({"stamp": 1e6, "received": 100.002}, "ahead of this computer's"),
        ({"stamp": 5.002 + 1.1 * THETA, "received": 100.002}, "run too fast"),
        ({"position_lag": math.nan}, "no number"),
        ({"position_lag": 1.01 * THETA}, "s before the force, more than the loop's lag"),
        ({"position_lag": -1.01 * THETA}, "s after the force, more than the loop's lag"),
        ({"quaternion": (0.0, 0.0, 0.0, 0.0)}, "a quaternion of length 0"),
        ({"quaternion": (1e200, 0.0, 0.0, 1e200)}, "which is no orientation"),
        ({"quaternion": (0.0, 0.0, 0.0, 1.006)}, "which is no orientation"),
    ],
)
def test_a_reading_that_is_none_is_named(changed, says):
    sense = SENSE._replace(**{"stamp": 5.002, "received": 100.002} | changed)
    assert says in reading_fault(sense, SENSE, REST, THETA)


def test_a_reading_that_catches_up_within_the_lag_counts():
    late = SENSE._replace(received=SENSE.received + 0.9 * THETA)
    caught_up = SENSE._replace(stamp=5.0 + THETA, received=late.received + 0.1 * THETA)
    assert reading_fault(caught_up, late, REST, THETA) is None
