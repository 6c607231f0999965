"""Bags that were cut off, or never closed: what is whole is read, and what is lost is said."""

from __future__ import annotations

import numpy as np
import pytest

from logs.ros_bags import KINDS, pose, storage, wrench, write_bag
from palpate.errors import InputError
from palpate.logs import read_log
from palpate.logs.bags import Bag
from palpate.logs.formats import kind_of

TIME = np.arange(3000) / 1000
FORCE = np.column_stack([0 * TIME, -TIME, np.sin(5 * TIME)])


@pytest.fixture(scope="module", params=KINDS)
def bag(request, tmp_path_factory):
    place = np.column_stack([TIME, TIME, TIME])
    path = tmp_path_factory.mktemp("bags") / "log.bag"
    return storage(write_bag(path, request.param, [wrench("/ft", TIME, FORCE), pose("/pose", TIME, place)]))


def cut(bag, tmp_path, share):
    whole = bag.read_bytes()
    path = tmp_path / f"cut{bag.suffix}"
    path.write_bytes(whole[: int(len(whole) * share)])
    return path


@pytest.mark.parametrize(
    "share", [0.5, 0.96, *(pytest.param(s, marks=pytest.mark.long) for s in (0.25, 0.77))]
)
def test_what_is_whole_is_read(bag, tmp_path, share):
    path = cut(bag, tmp_path, share)
    with Bag(path, kind_of(path)) as found:
        streams, _ = found.streams({"/ft": ["wrench.force.z", "wrench.force.y"]})
    values = streams["/ft"].values
    assert len(values) == pytest.approx(share * len(TIME), rel=0.2)
    np.testing.assert_array_equal(values, FORCE[: len(values), [2, 1]])
    (said,) = found.troubles
    assert "is cut short or was never closed" in said
    assert f"{sum(topic.count for topic in found.topics.values())} complete messages are read" in said


@pytest.mark.parametrize("kind", ["mcap", pytest.param("bag1", marks=pytest.mark.long)])
def test_packed_chunks_are_lost_one_at_a_time(tmp_path, kind):
    time = np.arange(20_000) / 1000
    noise = np.random.default_rng(0).normal(size=(len(time), 3))
    file = storage(write_bag(tmp_path / "log.bag", kind, [wrench("/ft", time, noise)], packed=True))
    path = cut(file, tmp_path, 0.8)
    with Bag(path, kind_of(path)) as found:
        streams, _ = found.streams({"/ft": ["wrench.force.z", "wrench.force.y"]})
    values = streams["/ft"].values
    assert 0.3 * len(time) < len(values) < 0.85 * len(time)
    np.testing.assert_array_equal(values, noise[: len(values), [2, 1]])


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_how_much_is_lost_is_said_where_the_file_tells(bag, tmp_path, share):
    path = cut(bag, tmp_path, share)
    with Bag(path, kind_of(path)) as found:
        (said,) = found.troubles
    if path.suffix == ".mcap":  # nothing in it says how long it was to be
        assert "what came after is lost" in said
    else:
        lost = float(said.rsplit("read, ", 1)[1].split("%")[0])
        assert lost == pytest.approx(100 * (1 - share), abs=2.0)


def test_the_record_says_it(bag, tmp_path):
    path = cut(bag, tmp_path, 0.6)
    record = read_log(path, position="/pose.pose.position.z", force="/ft.wrench.force.z")
    assert record.meta["notes"][0]["code"] == "log-cut-short"
    assert len(record) == pytest.approx(0.6 * len(TIME), rel=0.2)


def test_a_bag_that_has_lost_its_index_only(tmp_path):
    path = write_bag(tmp_path / "log.bag", "bag1", [wrench("/ft", TIME, FORCE)])
    path.write_bytes(path.read_bytes()[:-20])
    with Bag(path, kind_of(path)) as bag:
        assert bag.topics["/ft"].count == len(TIME)
    assert "all 3000 messages are there" in bag.troubles[0]


def test_a_bag_that_was_never_closed(tmp_path):
    """The recorder writes the place of the index last; until then it is 0."""
    path = write_bag(tmp_path / "log.bag", "bag1", [wrench("/ft", TIME, FORCE)])
    whole = path.read_bytes()
    at = whole.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(whole[at : at + 8], "little")
    path.write_bytes(whole[:at] + bytes(8) + whole[at + 8 : index])
    with Bag(path, kind_of(path)) as bag:
        assert bag.topics["/ft"].count == len(TIME)
    assert "never closed" in bag.troubles[0]


@pytest.mark.parametrize("kind", ["sqlite", "mcap"])
def test_a_folder_with_a_damaged_file(tmp_path, kind):
    path = write_bag(tmp_path / "log", kind, [wrench("/ft", TIME, FORCE)])
    file = storage(path)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with Bag(path, kind_of(path)) as bag:
        streams, _ = bag.streams({"/ft": ["wrench.force.z"]})
    values = streams["/ft"].values[:, 0]
    assert 0.3 * len(TIME) < len(values) < 0.7 * len(TIME)
    np.testing.assert_array_equal(values, FORCE[: len(values), 2])


def test_a_hole_in_the_middle_ends_it(tmp_path):
    """The index at the end promises messages that are not there any more."""
    path = storage(write_bag(tmp_path / "log", "sqlite", [wrench("/ft", TIME, FORCE)]))
    whole = bytearray(path.read_bytes())
    middle = len(whole) // 2 // 4096 * 4096
    whole[middle : middle + 8 * 4096] = b"\xff" * (8 * 4096)
    path.write_bytes(whole)
    with Bag(path, kind_of(path)) as bag:
        streams, _ = bag.streams({"/ft": ["wrench.force.z"]})
    values = streams["/ft"].values[:, 0]
    assert 0 < len(values) < len(TIME)
    assert bag.troubles
    np.testing.assert_array_equal(values, FORCE[: len(values), 2])


@pytest.mark.parametrize(
    ("kind", "packed"),
    [
        ("bag1", True),
        ("sqlite", False),
        ("mcap", True),
        *(pytest.param(kind, False, marks=pytest.mark.long) for kind in ("bag1", "mcap")),
    ],
)
def test_damage_anywhere_is_read_around_or_refused_in_a_line(tmp_path, kind, packed):
    """Noise, zeros or ones over a part of the file, as a failing disk leaves them."""
    rows = slice(0, 300)
    sent = [wrench("/ft", TIME[rows], FORCE[rows]), pose("/pose", TIME[rows], FORCE[rows])]
    path = storage(write_bag(tmp_path / "log", kind, sent, packed=packed))
    whole, rng, said = path.read_bytes(), np.random.default_rng(0), []
    for k in range(30):
        size, place = int(rng.choice([1, 8, 400, 4096])), int(rng.integers(len(whole)))
        noise = rng.integers(0, 256, size, dtype=np.uint8).tobytes()
        hurt = (noise, bytes(size), b"\xff" * size)[k % 3][: len(whole) - place]
        path.write_bytes(whole[:place] + hurt + whole[place + len(hurt) :])
        try:
            with Bag(path, kind_of(path)) as bag:
                bag.streams({"/ft": ["wrench.force.z"]})
                assert all(topic.times for topic in bag.topics.values() if topic.count)
        except InputError as error:
            said.append(str(error))
    assert 0 < len(said) < 30
    assert not any("\n" in text for text in said)


@pytest.mark.parametrize("size", [16, 60, 200])
def test_a_stub_is_refused_in_a_line(bag, tmp_path, size):
    path = tmp_path / f"stub{bag.suffix}"
    path.write_bytes(bag.read_bytes()[:size])
    with pytest.raises(InputError, match="cannot be read as") as caught:
        Bag(path, kind_of(path))
    assert "\n" not in str(caught.value)


def test_an_mcap_that_says_nothing_of_ros_is_read_if_its_messages_are(tmp_path):
    """Other tools write the same messages without ROS 2's profile, which the library asks for."""
    path = storage(write_bag(tmp_path / "log", "mcap", [wrench("/ft", TIME[:50], FORCE[:50])]))
    path.write_bytes(path.read_bytes().replace(b"ros2", b"none", 1))
    with Bag(path, kind_of(path)) as bag:
        streams, _ = bag.streams({"/ft": ["wrench.force.z"]})
        assert bag.troubles == []
    np.testing.assert_array_equal(streams["/ft"].values[:, 0], FORCE[:50, 2])


def test_messages_that_are_coded_otherwise_are_not_read_as_what_they_are_not(tmp_path):
    path = storage(write_bag(tmp_path / "log", "mcap", [wrench("/ft", TIME[:50], FORCE[:50])]))
    path.write_bytes(path.read_bytes().replace(b"ros2", b"none", 1).replace(b"cdr", b"xml"))
    with Bag(path, kind_of(path)) as bag:
        assert not bag.topics["/ft"].known
        assert bag.topics["/ft"].kind == "geometry_msgs/msg/WrenchStamped as xml"
