"""Streams of different rates on the rows of the fastest."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identification.sample_clock import sample_clock_of
from palpate.identification.sampling import channels_of
from palpate.logs.bags.loading import Timed, align
from palpate.records import Record


def timed(time, values, topic="/a"):
    return Timed(topic, np.asarray(time, float), np.asarray(values, float).reshape(len(time), -1))


def wave(time, frequency=3.0):
    return np.sin(2 * np.pi * frequency * np.asarray(time))


FAST = np.arange(4000) / 1000


def test_the_rows_are_those_of_the_fastest():
    slow = np.arange(3.0, 3900.0, 8.0) / 1000
    table = align([timed(slow, wave(slow)), timed(FAST, wave(FAST), "/b")])
    np.testing.assert_array_equal(table.time, FAST[(slow[0] <= FAST) & (slow[-1] >= FAST)])
    np.testing.assert_array_equal(table.values[1][:, 0], wave(table.time))


def test_a_slower_stream_stands_in_the_nearest_row_at_its_own_rate():
    slow = np.arange(0.0004, 3.9, 0.008)
    table = align([timed(slow, wave(slow)), timed(FAST, wave(FAST), "/b")])
    column = table.values[0][:, 0]
    there = np.isfinite(column)
    assert there.sum() == pytest.approx(len(slow), abs=1)
    np.testing.assert_allclose(column[there], wave(table.time[there]), atol=1e-5)
    assert "/a has 125 readings a second, /b 1000" in table.notes[0]["text"]


def test_what_is_read_about_as_often_is_read_in_every_row():
    """Half a step apart, a straight line would lose 1 - cos(pi f T), 0.3 % at 25 Hz of 1 kHz; a spline loses less."""
    shifted = FAST + 0.0005
    table = align([timed(FAST, wave(FAST, 25)), timed(shifted, wave(shifted, 25), "/b")])
    assert np.isfinite(table.values[1]).all()
    np.testing.assert_allclose(table.values[1][10:-10, 0], wave(table.time[10:-10], 25), atol=1e-4)
    assert table.notes == []


def test_a_gap_is_left_empty():
    holed = FAST[(FAST < 1.0) | (FAST > 1.5)] + 0.0003
    table = align([timed(FAST, wave(FAST)), timed(holed, wave(holed), "/b")])
    empty = np.isnan(table.values[1][:, 0])
    assert empty[(table.time > 1.01) & (table.time < 1.49)].all()
    assert not empty[(table.time < 0.99) | (table.time > 1.51)].any()


def test_held_readings_are_left_out_and_said():
    """A driver that publishes at 1 kHz what its sensor gives at 100 Hz."""
    held = wave(np.floor(FAST * 100) / 100)
    table = align([timed(FAST, wave(FAST)), timed(FAST, held, "/b")])
    assert np.isfinite(table.values[1][:, 0]).sum() == pytest.approx(400, abs=2)
    assert [note["code"] for note in table.notes] == ["held-samples", "missing-samples"]


def test_what_is_to_be_held_is_not_moved():
    """Each reading stands in the first row that is not before it, from which the sensor's own grid comes back."""
    sensor = np.arange(0.00013, 3.9, 1 / 480)
    table = align([timed(FAST, wave(FAST)), timed(sensor, wave(sensor), "/ft")], held="/ft")
    column = table.values[1][:, 0]
    rows = np.flatnonzero(np.isfinite(column))
    np.testing.assert_array_equal(column[rows], wave(sensor)[: len(rows)])
    late = table.time[rows] - sensor[: len(rows)]
    assert (late >= 0).all()
    assert (late < 0.001).all()
    filled = column[rows][np.maximum(np.searchsorted(rows, np.arange(len(column)), side="right") - 1, 0)]
    grid = sample_clock_of(filled)
    instants = table.time[0] + grid.instants * 0.001
    np.testing.assert_allclose(np.interp(instants[5:-5], sensor, sensor), instants[5:-5], atol=1e-12)
    nearest = np.abs(instants[5:-5, None] - sensor[None, :]).min(axis=1)
    assert nearest.max() < 1e-4


def test_the_identification_sees_the_slower_one_s_rate():
    slow = np.arange(0.0, 3.99, 0.01)
    table = align([timed(slow, wave(slow)), timed(FAST, wave(FAST), "/b")])
    columns = {"time": table.time, "position": table.values[0][:, 0], "force": table.values[1][:, 0]}
    channels = channels_of(Record(columns, {"time": "s", "position": "m", "force": "N"}))
    assert channels.rate == pytest.approx(100, rel=0.01)
    np.testing.assert_allclose(channels.position, wave(channels.time), atol=0.005)


def test_out_of_order_repeated_and_empty_messages():
    time = np.r_[FAST[:2000], FAST[1999], FAST[3999:1999:-1]]
    values = wave(time)
    values[5] = np.nan
    values[6] = -9999.0
    table = align([timed(time, values), timed(FAST, wave(FAST), "/b")], missing=[-9999.0])
    assert np.all(np.diff(table.time) > 0)
    codes = sorted(note["code"] for note in table.notes)
    assert codes == ["irregular-time", "missing-samples"]
    assert any("2 of 4000 messages of /a hold no reading" in note["text"] for note in table.notes)
    np.testing.assert_allclose(table.values[0][:, 0], wave(table.time), atol=1e-5)


WRONG = {
    "few": (timed(FAST[:10], wave(FAST[:10])), "/a has 10 readings"),
    "empty": (timed(FAST, np.full(4000, np.nan)), "/a has 0 readings"),
    "elsewhere": (timed(FAST[:4000] + 3.99, wave(FAST)), "readings in common"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_too_little_is_refused(kind):
    one, words = WRONG[kind]
    with pytest.raises(InputError, match=words):
        align([one, timed(FAST, wave(FAST), "/b")])
