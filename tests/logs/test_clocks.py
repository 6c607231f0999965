"""Topics on clocks of their own: which time counts, and what is said when they disagree."""

from __future__ import annotations

import numpy as np
import pytest

from logs.ros_bags import pose, wrench, write_bag
from palpate.errors import InputError
from palpate.logs import read_log
from palpate.logs.bags import Stream
from palpate.logs.bags.loading import on_one_clock

TIME = np.arange(2000) / 500


def stream(topic="/a", offset=0.0, drift=0.0, delay=0.001, jitter=0.002, seed=0, time=TIME):
    """Messages stamped by a clock that is `offset` behind and loses `drift`, and received after a delay with jitter."""
    rng = np.random.default_rng(seed)
    late = delay + rng.exponential(jitter, len(time)) if jitter else np.full(len(time), delay)
    return Stream(topic, time + late, (time - offset) / (1 + drift), np.zeros((len(time), 1)))


def test_stamps_that_agree_are_taken_as_they_are():
    """Whatever the messages were on their way, as long as it is the transport's."""
    clocks = on_one_clock([stream("/a"), stream("/b", delay=0.015, seed=1)])
    assert clocks.warning is None
    for one in clocks.streams:
        np.testing.assert_array_equal(one.time, TIME)


def test_clocks_that_are_apart_are_moved_together_and_said():
    clocks = on_one_clock([stream("/a"), stream("/b", offset=0.5, seed=1)])
    assert "the stamps of /b stand 0.5 s behind those of /a" in clocks.warning
    assert "disagree" in clocks.warning
    first, second = clocks.streams
    np.testing.assert_allclose(first.time, TIME, atol=0.003)  # what is left is the least delay on the way
    np.testing.assert_allclose(second.time, first.time, atol=5e-4)


def test_a_clock_of_another_epoch():
    clocks = on_one_clock([stream("/a"), stream("/b", offset=1.7e9, seed=1)])
    np.testing.assert_allclose(clocks.streams[1].time, clocks.streams[0].time, atol=1e-3)


def test_a_clock_that_drifts():
    """2 % over four seconds: 80 ms, found to a hundredth of that."""
    clocks = on_one_clock([stream("/a"), stream("/b", drift=0.02, seed=1)])
    assert "drift by" in clocks.warning
    found = float(clocks.warning.split("drift by ")[1].split(" microseconds")[0])
    assert found == pytest.approx(0.02e6, rel=0.05)
    np.testing.assert_allclose(clocks.streams[1].time, clocks.streams[0].time, atol=1e-3)


def test_a_slow_way_is_doubted_and_not_mended():
    """50 ms may be a wireless link or a clock; the stamps are right in the first case, so they stay."""
    clocks = on_one_clock([stream("/a"), stream("/b", delay=0.05, seed=1)])
    assert "a clock error, or slow transport to the recorder" in clocks.warning
    np.testing.assert_array_equal(clocks.streams[1].time, TIME)


def test_a_message_that_came_before_it_was_stamped_tells_the_clock():
    clocks = on_one_clock([stream("/a"), stream("/b", offset=-0.05, seed=1)])
    assert "the clocks disagree" in clocks.warning
    np.testing.assert_allclose(clocks.streams[1].time, clocks.streams[0].time, atol=1e-3)


@pytest.mark.parametrize("stamps", [np.full(2000, np.nan), np.zeros(2000)])
def test_without_stamps_the_recorder_s_time_is_taken_for_all(stamps):
    bare = Stream("/b", TIME + 0.001, stamps, np.zeros((2000, 1)))
    clocks = on_one_clock([stream("/a", jitter=0.0), bare])
    assert "/b has no stamps" in clocks.said
    for one in clocks.streams:
        np.testing.assert_allclose(one.time, TIME + 0.001)


def test_topics_with_no_time_in_common_are_refused():
    with pytest.raises(InputError, match=r"no time in common \(/a 0 to .* /b 10 to"):
        on_one_clock([stream("/a", jitter=0.0), stream("/b", time=TIME + 10, jitter=0.0)])


@pytest.mark.parametrize("kind", ["bag1", "mcap"])
def test_a_bag_whose_clocks_disagree(tmp_path, kind):
    wave = np.sin(7 * TIME)
    vector = np.column_stack([0 * TIME, 0 * TIME, wave])
    sent = [
        wrench("/ft", TIME - 1.5, vector, received=TIME + 0.001),
        pose("/pose", TIME, vector, received=TIME + 0.001),
    ]
    record = read_log(
        write_bag(tmp_path / "log.bag", kind, sent),
        position="/pose.pose.position.z",
        force="/ft.wrench.force.z",
    )
    assert record.meta["notes"][0]["code"] == "clocks-disagree"
    np.testing.assert_allclose(record["force"], record["position"], atol=1e-6)
