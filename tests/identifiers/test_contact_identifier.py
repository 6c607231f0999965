"""On line from position and force: the same regressors and the same answer as of a log of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.signal import butter, lfilter

from palpate.errors import InputError
from palpate.identifiers import ContactIdentifier
from palpate.identifiers.contact_identifier import NAMES
from palpate.identifiers.contact_stream import UNSET, sampled_at
from palpate.signals.low_pass import LowPass, read, taps

RATE = 1000.0
SENSOR = LowPass.parse("butterworth3:120")
LAG = SENSOR.lag + 2.1e-3
SETTLING = 10 / SENSOR.decay * RATE
"""Ticks until what was before is e^-10 of itself."""
TICKS = 1500


class Taken:
    """An estimator that only keeps what it is given."""

    def __init__(self):
        self.regressors, self.forces = [], []

    def update(self, regressor, force):
        self.regressors.append(np.array(regressor))
        self.forces.append(force)

    def estimate(self):
        raise AssertionError("nobody asked")


def moving(seed=0):
    """A tip that wanders through 10 mm or so, and a force that never repeats; shape (TICKS,) each."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(0, 1e-4, TICKS)) + 0.5, 20 + rng.normal(0, 1, TICKS)


def identifier(estimator=None, **changes):
    """One that takes all it is given for a contact, unless the test is of that."""
    given_ = {"low_pass": SENSOR, "rate": RATE, "lag": LAG, "touch": 0.0, **changes}
    return ContactIdentifier(estimator=estimator, **given_)


def told(one):
    estimate = one.estimate()
    return np.concatenate([estimate.theta, estimate.covariance.ravel(), [estimate.samples]])


@pytest.mark.parametrize("lag", [0.0, SENSOR.lag, LAG, 0.0301])
@pytest.mark.parametrize("low_pass", ["butterworth3:120", "butterworth2:250+butterworth1:80"])
def test_a_stream_has_the_regressors_of_a_log(lag, low_pass):
    """Each tick's, from the first that the low-pass has settled for; and each `delay` ticks after its force."""
    x, force = moving()
    sees, taken = LowPass.parse(low_pass), Taken()
    one = identifier(taken, low_pass=sees, lag=lag)
    waited = []
    for tick, (position, f) in enumerate(zip(x, force, strict=True)):
        one.update(position, f)
        waited += [tick - np.flatnonzero(force == f)[0] for f in taken.forces[len(waited) :]]
    rows = np.flatnonzero(np.isin(force, taken.forces))
    np.testing.assert_array_equal(taken.forces, force[rows])
    np.testing.assert_array_equal(np.diff(rows), 1)
    weights = taps(sees, 1 / RATE, 3)
    log = read(x - x[0], rows - (lag - sees.lag) * RATE, weights)
    got = np.array(taken.regressors).T
    for d, column in enumerate(got[2::-1]):
        wanted = log[d] * RATE**d
        # The same weights, summed in another order; instants in the middle of two places may round either way.
        np.testing.assert_allclose(column, wanted, rtol=0, atol=1e-3 * np.abs(wanted).max(), err_msg=str(d))
        assert np.median(np.abs(column - wanted)) < 1e-11 * np.abs(wanted).max()
    np.testing.assert_array_equal(got[3], 1.0)
    late = max((lag - sees.lag) * RATE, 0.0)
    settled = 10 / sees.decay * RATE
    assert max(settled, 0) <= rows[0] <= max(settled, weights.before + late) + 2
    assert set(waited) == {waited[0]}
    assert waited[0] <= one.delay <= waited[0] + 1
    assert TICKS - 1 - rows[-1] == waited[0]


def test_its_answer_is_the_least_squares_of_these():
    """From a start so vague that it counts for nothing: 1e6 N/m beside the 100 or so that the log leaves open."""
    t = np.arange(TICKS) / RATE
    x = 3e-3 + sum(a * np.sin(2 * np.pi * f * t) for a, f in ((1e-3, 3.0), (2e-4, 12.0), (5e-5, 31.0)))
    instants = np.arange(TICKS) - (LAG - SENSOR.lag) * RATE
    log = read(x - x[0], instants, taps(SENSOR, 1 / RATE, 3))
    columns = np.column_stack([log[d] * RATE**d for d in (2, 1, 0)])
    noise = np.random.default_rng(1).normal(0, 0.6, TICKS)
    force = columns @ [0.3, 60.0, 5200.0] + 30 + noise
    taken, one = Taken(), identifier()
    for other in (identifier(taken), one):
        other.update_many(x, force)
    theta = np.linalg.lstsq(np.array(taken.regressors), np.array(taken.forces), rcond=None)[0]
    estimate = one.estimate()
    assert estimate.names == NAMES
    # The octaves count by their own noise and leave out the ends of the log: the two differ within their interval.
    assert (np.abs(estimate.theta - theta) < 1.96 * estimate.std).all()
    assert (np.abs(estimate.theta - [0.3, 60.0, 5200.0, 30.0]) < 4 * estimate.std).all()
    assert estimate.std[2] < 60.0
    assert estimate.samples == len(taken.forces)


def test_what_is_lost_with_a_contact_comes_with_the_next():
    """Nothing is taken out of contact, nor before the low-pass has forgotten that it was."""
    x, _ = moving()
    force = np.random.default_rng(2).normal(0, 0.1, TICKS)
    force[400:800] += 20
    force[1000:1400] += 20
    taken = Taken()
    one = identifier(taken, touch=2.0)
    one.update_many(x, force)
    rows = np.flatnonzero(np.isin(force, taken.forces))
    waits = one.delay
    for begin, end in ((400, 800), (1000, 1400)):
        own = rows[(rows >= begin) & (rows < end)]
        # A tenth of the force makes a mean over the settling a touch.
        assert begin + SETTLING < own[0] <= begin + np.ceil(SETTLING) + np.ceil(SETTLING / 10)
        # The last ticks wait for what comes after them: they are left out.
        assert end - 1 - waits <= own[-1] < end
        assert (np.diff(own) == 1).all()
    assert ((rows >= 400) & (rows < 800) | (rows >= 1000) & (rows < 1400)).all()


def test_a_touch_has_hysteresis():
    """It is lost below half of the force that it began with; noise about either decides nothing."""
    x, _ = moving()
    force = np.full(TICKS, 1.5)
    force[100:200] = 2.5
    force[900:] = 0.5
    force += np.random.default_rng(3).normal(0, 0.6, TICKS)
    taken = Taken()
    identifier(taken, touch=2.0).update_many(x, force)
    rows = np.flatnonzero(np.isin(force, taken.forces))
    assert 100 + SETTLING < rows[0] < 100 + 2 * np.ceil(SETTLING)
    assert rows[-1] < 900
    assert (np.diff(rows) == 1).all()


def test_many_ticks_are_ticks_one_by_one():
    x, force = moving()
    one, many, mixed = identifier(), identifier(), identifier()
    for position, f in zip(x, force, strict=True):
        one.update(position, f)
    many.update_many(x, force)
    mixed.update_many(x[:700].tolist(), force[:700].tolist())
    mixed.update_many(x[700:], force[700:])
    np.testing.assert_array_equal(told(many), told(one))
    np.testing.assert_array_equal(told(mixed), told(one))


def test_where_the_position_counts_from_does_not_matter():
    """The offset is the force at the first position, wherever that is."""
    x, force = moving()
    here, there = identifier(), identifier()
    here.update_many(x, force)
    there.update_many(x + 100.0, force)
    # 100 m cost a position of a micrometre four of its ten digits.
    np.testing.assert_allclose(there.estimate().theta, here.estimate().theta, rtol=1e-6)


@pytest.mark.parametrize("tick", [(np.inf, 1.0), (0.5, -np.inf), (1.1e3, 1.0), (1e150, 1.0), (0.5, -1.1e6)])
def test_a_tick_out_of_any_range_is_refused_and_changes_nothing(tick):
    x, force = moving()
    bad, good = identifier(), identifier()
    for one in (bad, good):
        one.update_many(x[:900], force[:900])
    with pytest.raises(InputError, match=r"a tick must be finite, .* got position .* call skip\(\)"):
        bad.update(*tick)
    for one in (bad, good):
        one.update_many(x[900:], force[900:])
    np.testing.assert_array_equal(told(bad), told(good))


@pytest.mark.parametrize("glitch", [1.0, 999.0, -37.0])
def test_a_position_that_no_tip_reaches_is_a_missing_one(glitch):
    """As if it had been NaN; a tip cannot travel so far in a tick."""
    x, force = moving()
    spoiled, missing = identifier(), identifier()
    lost, bad = x.copy(), x.copy()
    lost[[500, 900]], bad[[500, 900]] = np.nan, glitch
    spoiled.update_many(bad, force)
    missing.update_many(lost, force)
    np.testing.assert_array_equal(told(spoiled), told(missing))


def test_a_position_that_stays_where_it_jumped_is_read_again():
    """An encoder that is reset: the second reading confirms the first, and contact goes on from there."""
    x, force = moving()
    x[800:] += 2.0
    taken = Taken()
    identifier(taken).update_many(x, force)
    rows = np.flatnonzero(np.isin(force, taken.forces))
    assert rows[-1] > 1400
    assert not np.isin(np.arange(800, 810), rows).any()


def test_a_value_beyond_any_contact_is_rejected():
    """A position in nanometres that is told to be metres makes a spring of 5e10 N/m."""
    t = np.arange(TICKS) / RATE
    x = 1e-3 * np.sin(2 * np.pi * 3 * t) + 1e-4 * np.sin(2 * np.pi * 20 * t)
    one = identifier()
    one.update_many(1e-7 * x, 5200 * read(x, np.arange(TICKS) - 2.1, taps(SENSOR, 1 / RATE, 3))[0])
    assert "beyond that of any contact" in one.estimate().rejected


def test_a_damping_below_zero_is_no_damping():
    t = np.arange(3 * TICKS) / RATE
    x = 1e-3 * np.sin(2 * np.pi * 3 * t) + 1e-4 * np.sin(2 * np.pi * 20 * t)
    columns = read(x, np.arange(len(t)) - 2.1, taps(SENSOR, 1 / RATE, 3))
    one = identifier()
    noise = np.random.default_rng(0).normal(0, 0.01, len(t))
    one.update_many(x, 5200 * columns[0] - 60 * RATE * columns[1] + noise)
    estimate = one.estimate()
    assert abs(estimate.theta[1] + 60) < 6
    verdicts = estimate.verdicts()
    assert (verdicts["B"], verdicts["K"]) == ("rejected", "identified")


def test_missing_ticks_keep_their_place():
    """Regressors beside gaps are those of the whole motion; samples within reach of a long gap are left out."""
    t = np.arange(TICKS) / RATE
    x = 1e-3 * np.sin(2 * np.pi * 3 * t) + 1e-4 * np.sin(2 * np.pi * 20 * t)
    force = np.random.default_rng(4).normal(20, 1, TICKS)
    whole, gappy = Taken(), Taken()
    identifier(whole).update_many(x, force)
    one = identifier(gappy)
    lost = np.isin(np.arange(TICKS), [300, 500, 501, 700, 701, 702])
    for k in range(TICKS):
        if k == 1000 or 1100 <= k < 1120:
            one.skip()
        else:
            one.update(np.nan if lost[k] else x[k], force[k])
    kept = np.isin(whole.forces, gappy.forces)
    rows = np.flatnonzero(np.isin(force, np.array(whole.forces)[~kept]))
    assert 1000 in rows
    assert set(rows) - {1000} <= set(range(1050, 1200))
    assert set(range(1100, 1120)) <= set(rows)
    wanted = np.array(whole.regressors)[kept]
    error = np.abs(np.array(gappy.regressors) - wanted).max(axis=0)
    # A cubic through two readings on each side is off by (2 pi 20 Hz 1 ms)^4 of the faster tone.
    assert (error[:3] < 2e-3 * np.abs(wanted).max(axis=0)[:3]).all()


@pytest.mark.parametrize("shapes", [((5,), (4,)), ((2, 2), (2, 2)), ((), ())])
def test_many_ticks_of_different_shapes_are_refused(shapes):
    with pytest.raises(InputError, match=r"must be an array of real numbers of shape \("):
        identifier().update_many(*(np.zeros(shape) for shape in shapes))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"low_pass": "butterworth1:120"}, "second order at least, got butterworth1:120"),
        ({"low_pass": "none"}, "second order at least, got none"),
        ({"low_pass": "bessel3:120"}, "a force filter is given as butterworth3:120"),
        ({"rate": 400.0}, "four times the cut-off of 120 Hz, got 400 Hz"),
        ({"rate": np.nan}, "four times the cut-off"),
        ({"rate": np.inf}, "four times the cut-off"),
        ({"lag": -1e-3}, "a number of seconds from 0, got -0.001"),
        ({"lag": np.nan}, "a number of seconds from 0"),
        ({"sampling": 1002.0}, "above 0 and at most the rate of 1000 Hz, got 1002"),
        ({"sampling": 0.0}, "above 0 and at most the rate"),
        ({"touch": -1.0}, "a force of 0 N or more, got -1"),
        ({"touch": np.nan}, "a force of 0 N or more"),
        ({"lag_std": -1e-3}, "the lag_std must be a number of seconds from 0, got -0.001"),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(InputError, match=words) as caught:
        identifier(**changes)
    assert "\n" not in str(caught.value)


def seen(period, phase, changes, told_period=None):
    """True instants of a sensor's samples, and what the clock says in each row that it finds one in.

    Args:
        period: of the sensor [rows].
        phase: of the first sample, as a share of the period.
        changes: whether each sample is another than the one before, shape (k,).
        told_period: what it is told; None for the same.
    """
    instants = period * (phase + np.arange(len(changes)))
    rows = np.ceil(instants).astype(int)
    changed = np.zeros(rows[-1] + 1, bool)
    changed[rows[changes]] = True
    clock, known = np.array(UNSET), told_period or period
    found = ((row, sampled_at(clock, float(row), bool(c), True, known)) for row, c in enumerate(changed))
    return instants, rows, [(row, instant) for row, instant in found if np.isfinite(instant)]


periods = st.floats(1.001, 12.0) | st.sampled_from([25 / 12, 1.25, 2.0, 2.5])
phases = st.floats(0.01, 0.99)
"""Shares of a period."""


def apart_from_rows(period, phase, count=300):
    """Whether no instant falls on a row, where rounding decides which row shows it."""
    instants = period * (phase + np.arange(count))
    return np.abs(instants - np.round(instants)).min() > 1e-6


@settings(max_examples=60)
@given(periods, phases)
def test_each_sample_is_found_in_its_row_to_half_a_row(period, phase):
    assume(apart_from_rows(period, phase))
    instants, rows, found = seen(period, phase, np.ones(300, bool))
    np.testing.assert_array_equal([row for row, _ in found], rows)
    error = np.array([instant for _, instant in found]) - instants
    assert np.abs(error).max() <= 0.5 + 1e-6


@settings(max_examples=60)
@given(st.floats(2.0, 12.0), phases, st.lists(st.booleans(), min_size=300, max_size=300))
def test_a_sample_that_equals_the_one_before_is_counted(period, phase, changes):
    """From two rows a sample on, a change cannot be mistaken for that of the next sample; a row late at most."""
    changes = np.array([True, *changes[1:]])
    assume(apart_from_rows(period, phase))
    instants, rows, found = seen(period, phase, changes)
    last = int(np.flatnonzero(changes)[-1])
    assert [round((instant - instants[0]) / period) for _, instant in found[: last + 1]] == list(
        range(last + 1)
    )
    late = np.array([row for row, _ in found[: last + 1]]) - rows[: last + 1]
    assert set(late) <= {0, 1}
    assert (late[np.flatnonzero(changes)] == 0).all()
    error = np.array([instant for _, instant in found[: last + 1]]) - instants[: last + 1]
    assert np.abs(error).max() <= 0.5 + 1e-6


@pytest.mark.parametrize("drift", [-1e-4, 1e-4])
def test_a_clock_that_drifts_is_followed(drift):
    """A row in ten thousand: 20 s bring it two rows away, and no sample is further off than the row it shows in."""
    instants, rows, found = seen(25 / 12 * (1 + drift), 0.3, np.ones(9600, bool), told_period=25 / 12)
    own = dict(found)
    error = np.array([own[row] for row in rows]) - instants
    assert np.abs(error).max() <= 0.5 + 1e-6
    # Each time the clock has passed a twelfth of a row, one may be given twice.
    assert len(found) <= 9600 + 20_000 * abs(drift) * 12 + 1


def identify_with(bad, touch=None, count=1, seconds=70.0):
    """K of a surface of 7 kN/m, and its standard deviation; after ten seconds `count` ticks show the force `bad`."""
    rng, t = np.random.default_rng(0), np.arange(round(seconds * 1000.0)) / 1000.0
    depth = np.minimum(t, 1.0) ** 2 * (
        2e-3 + sum(1e-4 * np.sin(2.0 * np.pi * f * t + f) for f in (0.5, 1.3, 3.1, 7.0, 13.0))
    )
    x = np.where(t < 1.0, depth - 2e-3 * (1.0 - t), depth)
    force = np.where(x > 0.0, 7e3 * x + 40.0 * np.gradient(x, 1e-3), 0.0)
    clean = lfilter(*butter(3, 2.0 * 120.0 / 1000.0), force)
    shown = np.floor(t * 480.0 + 1e-9).astype(int)  # the number of the sensor's sample in each tick
    first = np.unique(shown, return_index=True)[1]
    readings = (clean[first] + 0.1 * rng.normal(size=len(first)))[shown]
    if bad is not None:
        readings[10_000 : 10_000 + count] = bad
    one = ContactIdentifier("butterworth3:120", 1000.0, 3.2e-3, sampling=480.0, touch=touch)
    one.update_many(x + 1e-6 * rng.normal(size=len(x)), readings)
    result = one.estimate()
    assert result.rejected == ""
    assert one.contacts == 1
    return result.theta[2], result.std[2]


@pytest.mark.parametrize("touch", [None, 0.0, 3.0])
def test_one_bad_sample_neither_moves_nor_widens_the_estimate(touch):
    _, clean = identify_with(None, touch)
    for bad, count in ((0.0, 1), (100.0, 1), (1000.0, 1), (-1000.0, 2)):
        K, std = identify_with(bad, touch, count)
        assert abs(K - 7e3) < 1.96 * std
        assert std == pytest.approx(clean, rel=0.02)  # a sample of 33,000 is missing


def test_a_step_of_the_force_is_no_outlier():
    """A change that stays counts from its first sample on: as many come through as without it."""
    random, t = np.random.default_rng(1), np.arange(8000) / 1000.0
    x = 2e-3 + 1e-4 * np.sin(2.0 * np.pi * 3.0 * t)
    samples = []
    for step in (0.0, 5.0, 100.0):
        one = ContactIdentifier("butterworth3:120", 1000.0, 3.2e-3, touch=0.0)
        one.update_many(x, 7e3 * x + step * (t > 4.0) + 0.1 * random.normal(size=len(t)))
        samples.append(one.samples)
    assert len({*samples}) == 1
