"""What is fitted behind a force sensor whose low-pass is known: its own samples, and the position as it sees it."""

from __future__ import annotations

import numpy as np
import pytest

from identification.problems import problem
from identification.sensor_logs import SAMPLING, TRUTH, log, press_and_chirp, rig, sensor_log
from palpate.errors import InputError
from palpate.identification.descent import Descent
from palpate.identification.filters import SensorPath
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.identification.options import USUAL_LAG, USUAL_LAG_STD
from palpate.identification.sample_clock import sample_clock_of
from palpate.identification.sampling import channels_of
from palpate.signals.low_pass import LowPass

DT = 1e-3
SENSOR = LowPass.parse("butterworth3:120")
LAG = SENSOR.lag + 1 / SAMPLING
"""Of a fresh reading: the low-pass, and the one sample that the sensor takes to give it out."""
CODE = 200 / 2**11
"""Of the converter [N]."""
CLOCK = DT / 12 / np.sqrt(12)
"""What 480 readings in 1000 rows leave open of the clock's phase: a twelfth of a row, evenly [s]."""


def asked(record, lag=LAG, **said):
    """The problem, and the rows in which the sensor's readings are fresh."""
    clock = sample_clock_of(channels_of(record).raw.held_force)
    return problem(record, lag, force_filter=SENSOR, **said), clock


@pytest.fixture(scope="module")
def chirp():
    """A log as the bench's sensor gives it."""
    return sensor_log("chirp", 1).record


def pressed_along(path, duration=3.0, noise=0.6, seed=0):
    run = rig(seed, noise=noise).run(path, duration, seed=seed)
    return log(run["t"], run["x_measured"], run["force_sampled"])


def twice(t):
    """Two presses of 3 mm, from 1 mm above and back, a second apart [m]."""
    x = np.full_like(t, -1e-3)
    for begin, way in ((0.3, 1), (0.9, -1), (1.6, 1), (2.3, -1)):
        u = np.clip((t - begin) / 0.1, 0, 1)
        x += way * 4e-3 * u**3 * (10 - 15 * u + 6 * u * u)
    return x


def within(t):
    """3 mm deep, shaken at 3 and 20 Hz, never out of contact [m]."""
    return 3e-3 + 1e-3 * np.sin(2 * np.pi * 3 * t) + 1e-4 * np.sin(2 * np.pi * 20 * t)


@pytest.mark.parametrize("path", ["chirp", "steps"])
def test_the_models_law_holds_in_every_row_at_the_true_lag(path):
    """Without noise the readings are M a + B v + K x to half a code, and to what the clock's phase leaves open."""
    made = sensor_log(path, 3, noise=0.0)
    question, _ = asked(made.record)
    motion = question.motion
    assert isinstance(motion.chain, SensorPath)
    x, v, a = (motion.filtered(motion.position, d, made.lag) for d in range(3))
    jerk = np.gradient(a, motion.chain.period)
    force = TRUTH["K"] * (x + question.origin) + TRUTH["B"] * v + TRUTH["M"] * a
    rate = np.abs(TRUTH["K"] * v + TRUTH["B"] * a + TRUTH["M"] * jerk)
    assert len(force) > 1000
    # Of the phase, half of the twelfth of a row at most; 2e-3 N are weights left out and steps of the physics.
    assert (np.abs(question.force - force) <= CODE / 2 + rate * DT / 24 + 2e-3).all()
    assert np.std(question.force - force) == pytest.approx(CODE / np.sqrt(12), rel=0.4)


@pytest.mark.parametrize("std", [0.0, 5e-6, 2e-4])
def test_a_calibrated_lag_is_as_sure_as_the_calibration_and_the_sensors_clock(chirp, std):
    question, _ = asked(chirp, LAG, lag_std=std, mass=(0.3, 0.01))
    assert question.lag.known
    assert question.lag.value == LAG
    assert question.lag.std == pytest.approx(np.hypot(std, CLOCK), rel=1e-3)
    assert question.lag.mass == (0.3, 0.01)


def test_of_a_lag_that_nobody_calibrated_the_low_pass_is_known_and_the_rest_usual(chirp):
    question, _ = asked(chirp, None, mass=(0.3, 0.01))
    assert not question.lag.known
    assert question.lag.value == pytest.approx(SENSOR.lag + USUAL_LAG, abs=1e-6)
    assert question.lag.std == pytest.approx(np.hypot(USUAL_LAG_STD, 0.5 / SAMPLING), rel=1e-3)
    assert question.lag.mass == (0.3, 0.01)


def slopes(question, lag):
    """Of the force by the lag, K, B, M and the offset, at the truth."""
    motion = question.motion
    x, v, a = (motion.filtered(motion.position, d, lag) for d in range(3))
    jerk = (
        motion.filtered(motion.position, 2, lag - 1e-5) - motion.filtered(motion.position, 2, lag + 1e-5)
    ) / 2e-5
    by_lag = -(TRUTH["K"] * v + TRUTH["B"] * a + TRUTH["M"] * jerk)
    return np.column_stack([by_lag, x, v, a, np.ones_like(x)])


def test_least_squares_err_within_the_cramer_rao_bound():
    """A chirp, the lag calibrated."""
    made = sensor_log("chirp", 5)
    question, _ = asked(made.record, made.lag)
    fitted = Descent(KELVIN_VOIGT_MASS, question.motion, question.force, made.lag).at({}).theta
    jacobian = slopes(question, made.lag)[:, 1:]
    bound = 0.6 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    truth = [TRUTH[name] for name in ("K", "B", "M")]
    assert np.all(np.abs(fitted[:3] - truth) < 4 * bound[:3])


def test_each_contact_has_its_own_rows_and_what_is_between_has_none():
    question, _ = asked(pressed_along(twice))
    time = question.time
    assert set(question.spans) == {0, 1}
    # Touched about a third of a press' 100 ms after its begin; the reading is late by 5 ms.
    for number, (touched, left) in enumerate(((0.33, 0.97), (1.63, 2.37))):
        own = time[question.spans == number]
        assert touched + question.motion.chain.settling <= own[0] < touched + 0.06
        assert left - 0.02 < own[-1] < left + 2 * LAG
    touch = question.with_touches
    assert set(touch.spans) == {0, 1}
    assert set(question.motion.rows) <= set(touch.motion.rows)
    assert touch.motion.rows[0] < question.motion.rows[0]


def test_a_probe_that_never_leaves_counts_from_the_middle_of_its_motion():
    record = pressed_along(within)
    question, clock = asked(record, bonded=True)
    assert question.with_touches is None
    assert question.free == ()
    inside = question.motion.position[clock.rows[question.motion.rows]]
    assert inside.mean() == pytest.approx(0.0, abs=1e-15)
    assert question.origin == pytest.approx(3e-3, abs=1e-4)
    # All but what the low-pass' weights reach for beyond the log's ends.
    assert len(question.force) > 0.95 * 3.0 * SAMPLING


@pytest.mark.parametrize(
    ("every", "low_pass"),
    [(4, "butterworth3:120"), (1, "butterworth1:120"), (1, "butterworth2:400")],
    ids=["rows too rare", "first order", "low-pass too fast"],
)
def test_a_low_pass_that_the_rows_cannot_follow_filters_the_position_all_the_same(every, low_pass):
    """Then both channels go through the filter chain, and K is what it was."""
    run = rig().run(press_and_chirp, 3.0)
    thin = log(run["t"][::every], run["x"][::every], run["force_sampled"][::every])
    question = problem(thin, LAG, force_filter=low_pass)
    assert not isinstance(question.motion.chain, SensorPath)
    fitted = Descent(KELVIN_VOIGT_MASS, question.motion, question.force, question.lag.value).at({})
    assert fitted.theta[0] == pytest.approx(TRUTH["K"], rel=0.02)


def test_a_tap_too_short_for_the_low_pass_is_refused():
    """85 ms of contact, of which the low-pass settles for 27: less than 30 samples of 480 a second."""

    def tap(t):
        u = np.clip((t - 1.0) / 0.14, 0, 1)
        return -1e-3 + 3e-3 * np.sin(np.pi * u) ** 2

    with pytest.raises(InputError, match=r"only \d+ usable samples in contact; at least 30") as caught:
        asked(pressed_along(tap, noise=0.1), bonded=False)
    assert "\n" not in str(caught.value)
