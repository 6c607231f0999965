"""Logs that would crash the program or exhaust the machine: refused in a line, soon, and with little memory."""

from __future__ import annotations

import bz2
import contextlib
import os
import re
import sqlite3
import struct
import subprocess
import sys
import zipfile
import zlib

import numpy as np
import polars
import pytest
from scipy.io import savemat

from logs.ros_bags import storage, wrench, write_bag
from palpate.cli import main
from palpate.errors import InputError
from palpate.files.reading import ReadingLimits
from palpate.logs import read_log, read_record
from palpate.logs.bags import Bag
from palpate.logs.formats import kind_of
from palpate.logs.listing import list_log
from palpate.logs.read import measured_by

T = np.arange(50) / 100
COLUMNS = {"time": "t", "position": "x", "force": "f"}
SMALL = ReadingLimits(size=1e7)


def refused(path, words, limits=None, **columns):
    with pytest.raises(InputError, match=words) as caught:
        read_log(path, limits=limits, **(columns or COLUMNS))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", [0, 65535])
def test_a_tag_of_matlab_that_no_library_survives(tmp_path, kind):
    path = tmp_path / "log.mat"
    savemat(path, {"t": T, "x": T, "f": T}, do_compression=False)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(struct.pack("<II", 9, 400), struct.pack("<II", kind, 400), 1))
    refused(path, "cannot be read as a MATLAB file")


@pytest.mark.long
def test_a_small_file_of_matlab_that_unpacks_to_much(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"t": np.zeros(4_000_000)}, do_compression=True)
    assert path.stat().st_size < 40_000
    refused(path, "more than 0.01 GB unpacked.*--max-size", SMALL)
    assert len(read_log(path, rate=1, position="t", limits=ReadingLimits(size=1e8))) == 4_000_000


def test_a_long_text_of_nothing(tmp_path):
    path = tmp_path / "log.csv"
    with path.open("wb") as file:
        file.write(b"t,x,f\n" + b"".join(b"%d,%d,%d\n" % (k, k, k) for k in range(50)))
        file.truncate(10**10)  # a file with holes: it takes no room on the disk
    refused(path, "more than 2 GB")


def test_a_first_line_without_an_end_and_a_cell_without_one(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("x" * 5_000_000 + "\n1,2,3\n")
    refused(path, "first line of .* has over 4,000,000 bytes")
    path.write_text("t,x,f," + "y" * 140_000 + "\n" + "".join(f"{k},{k},{k},1\n" for k in range(50)))
    assert len(read_log(path, **COLUMNS)) == 50
    path.write_text('t,x,f,"' + "y" * 140_000 + "\n" + "".join(f"{k},{k},{k},1\n" for k in range(50)))
    assert len(read_log(path, **COLUMNS)) == 50


@pytest.mark.parametrize("command", ["link", "folder", "pipe"])
def test_only_files_are_opened(tmp_path, command):
    path = tmp_path / "log.db3"
    if command == "pipe":
        os.mkfifo(path)
    elif command == "link":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
        (path / "a.db3").symlink_to("/dev/zero")
    refused(path, "is a pipe or a device", force="/a.x", position="/a.y")


def database(path, messages):
    with sqlite3.connect(path) as own:
        own.executescript(
            "CREATE TABLE topics(id, name, type); INSERT INTO topics VALUES(1, '/a', 'geometry_msgs/msg/Point');"
            + messages
        )
    own.close()
    return path


def test_a_view_that_never_ends(tmp_path):
    path = database(
        tmp_path / "a.db3",
        "CREATE VIEW messages AS WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r)"
        " SELECT n AS id, 1 AS topic_id, n AS timestamp, x'00' AS data FROM r;",
    )
    refused(path, "messages is not a plain table but a view", force="/a.x", position="/a.y")


def test_a_table_that_makes_its_own_data(tmp_path):
    path = database(
        tmp_path / "a.db3",
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp,"
        " data BLOB GENERATED ALWAYS AS (zeroblob(900000000)));"
        "INSERT INTO messages(topic_id, timestamp) VALUES (1, 1), (1, 2);",
    )
    refused(path, "cannot be read as a ROS 2 bag", force="/a.x", position="/a.y")


def bag1_record(header, data):
    fields = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k + b"=" + v for k, v in header.items())
    return struct.pack("<I", len(fields)) + fields + struct.pack("<I", len(data)) + data


@pytest.mark.parametrize(
    ("says", "words"),
    [
        pytest.param(1000, "cannot be read as a ROS 1 bag", marks=pytest.mark.long),
        (10**8, "more than 0.01 GB"),
    ],
)
def test_a_chunk_of_a_bag_that_unpacks_to_much(tmp_path, says, words):
    path = tmp_path / "log.bag"
    about = {b"op": b"\x05", b"compression": b"bz2", b"size": struct.pack("<I", says)}
    begin = {b"op": b"\x03", b"index_pos": bytes(8), b"conn_count": bytes(4), b"chunk_count": bytes(4)}
    packed = bag1_record(about, bz2.compress(bytes(10**8)))
    path.write_bytes(b"#ROSBAG V2.0\n" + bag1_record(begin, b" " * 99) + packed)
    assert path.stat().st_size < 1000
    refused(path, words, SMALL, force="/a.x", position="/a.y")


def test_a_chunk_of_an_mcap_that_unpacks_to_much(tmp_path):
    import lz4.frame

    packed = lz4.frame.compress(bytes(10**8))
    chunk = (
        struct.pack("<QQQI", 0, 0, 10**8, 0)
        + struct.pack("<I", 3)
        + b"lz4"
        + struct.pack("<Q", len(packed))
        + packed
    )
    path = tmp_path / "log.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x06" + struct.pack("<Q", len(chunk)) + chunk)
    refused(path, "more than 0.01 GB", SMALL, force="/a.x", position="/a.y")


METADATA = {
    "no map": "- 1\n- 2\n",
    "a number for a list": "rosbag2_bagfile_information:\n  relative_file_paths: 7\n",
    "numbers for names": "rosbag2_bagfile_information:\n  relative_file_paths: [1, 2]\n",
    "brackets": "[" * 1200,
    "bytes": "\x01\x02",
    "another list for a word": "rosbag2_bagfile_information:\n  compression_mode: [file]\n",
}


@pytest.mark.parametrize("kind", METADATA)
def test_metadata_of_a_bag_that_is_spoiled(tmp_path, kind):
    path = write_bag(tmp_path / "log", "mcap", [wrench("/ft", T, np.zeros((50, 3)))])
    (path / "metadata.yaml").write_text(METADATA[kind])
    with Bag(path, kind_of(path)) as bag:
        assert bag.topics["/ft"].count == 50
        assert "metadata.yaml is spoiled" in bag.troubles[0]


def test_a_file_that_the_metadata_names_and_that_is_missing(tmp_path):
    path = write_bag(tmp_path / "log", "sqlite", [wrench("/ft", T, np.zeros((50, 3)))])
    about = path / "metadata.yaml"
    name = storage(path).name
    about.write_text(about.read_text().replace(f"- {name}", f"- {name}\n  - log_1.db3", 1))
    with Bag(path, kind_of(path)) as bag:
        assert "log_1.db3 is missing" in bag.troubles[0]


@pytest.mark.parametrize(
    "spoiled",
    [
        '{"units": {"t": 1}, "meta": {}}',
        "[" * 5000,
        *(pytest.param(s, marks=pytest.mark.long) for s in ("[", "[]", '{"units": 3}')),
    ],
)
def test_metadata_of_ours_that_is_spoiled(tmp_path, spoiled):
    path = tmp_path / "r.parquet"
    polars.DataFrame({"t": T, "x": T, "f": T}).write_parquet(path, metadata={"palpate": spoiled})
    for read in (read_record, lambda path: read_log(path, **COLUMNS)):
        with pytest.raises(InputError, match="metadata of palpate that is spoiled"):
            read(path)


@pytest.mark.parametrize(
    "instruments",
    [
        '{"force": {"filter": 1, "delay_s": 0}}',
        *(pytest.param(s, marks=pytest.mark.long) for s in ('{"force": 3}', '"x"')),
    ],
)
def test_instruments_of_ours_that_are_spoiled(tmp_path, instruments):
    path = tmp_path / "r.parquet"
    about = f'{{"units": {{"t": "s"}}, "meta": {{"instruments": {instruments}}}}}'
    polars.DataFrame({"t": T}).write_parquet(path, metadata={"palpate": about})
    with pytest.raises(InputError, match="of the instruments is damaged"):
        measured_by(path)


def test_where_a_shell_allows_little_memory_logs_are_read_all_the_same(tmp_path):
    """A process may not raise the limit that it was given, for those that it begins."""
    polars.DataFrame({"t": T, "x": T, "f": T}).write_parquet(tmp_path / "log.parquet")
    code = (
        "import resource, sys\nresource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))\n"
        "from palpate.logs import read_log\nprint(len(read_log(sys.argv[1], time='t', position='x', force='f')))"
    )
    words = [sys.executable, "-c", code, str(tmp_path / "log.parquet")]
    assert subprocess.run(words, capture_output=True, check=True, text=True).stdout == "50\n"


@pytest.mark.parametrize("ask", ["identify", "topics"])
def test_a_page_of_parquet_that_no_library_survives(tmp_path, capfd, ask):
    """Polars aborts its process at the length in this page's header, after some lines on standard error."""
    path = tmp_path / "r.parquet"
    time = np.arange(200) * 1e-3
    polars.DataFrame({"t": time, "x": time, "f": time}).write_parquet(path)
    spoiled = bytearray(path.read_bytes())
    spoiled[14] = 255
    path.write_bytes(spoiled)
    if ask == "identify":
        refused(path, "cannot be read as Parquet .it is damaged.")
    else:
        assert "cannot be read as Parquet" in list_log(path).troubles[0]
    assert capfd.readouterr() == ("", "")


def test_a_parquet_of_few_bytes_and_many_rows(tmp_path):
    path = tmp_path / "r.parquet"
    polars.DataFrame({name: np.zeros(3_000_000) for name in "txf"}).write_parquet(path)
    assert path.stat().st_size < 100_000
    refused(path, "more than 0.01 GB", SMALL)


def test_a_spreadsheet_that_unpacks_to_much(tmp_path):
    path = tmp_path / "log.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/workbook.xml", " " * 20_000_000)
    refused(path, "more than 0.01 GB", SMALL)


@pytest.mark.long
def test_noise_over_any_part_of_a_file_of_matlab(tmp_path):
    """Each is read, or refused in a line; the process survives."""
    path, rng = tmp_path / "log.mat", np.random.default_rng(0)
    savemat(path, {"t": T, "x": T, "f": T}, do_compression=False)
    whole = path.read_bytes()
    for _ in range(4):
        place = int(rng.integers(128, len(whole) - 8))
        path.write_bytes(whole[:place] + rng.bytes(8) + whole[place + 8 :])
        with contextlib.suppress(InputError):
            assert len(read_log(path, **COLUMNS)) == len(T)


def test_packed_noise(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"t": T}, do_compression=True)
    whole = path.read_bytes()
    noise = zlib.compress(bytes(np.random.default_rng(1).integers(0, 256, 300, dtype=np.uint8)))
    path.write_bytes(whole[:128] + struct.pack("<II", 15, len(noise)) + noise)
    refused(path, "cannot be read as a MATLAB file")


def test_a_bag_that_says_its_plain_messages_are_packed(tmp_path):
    path = write_bag(tmp_path / "bag", "sqlite", [wrench("/ft", T, np.outer(T, [1, 2, 3]))])
    about = path / "metadata.yaml"
    text = about.read_text()
    about.write_text(re.sub("compression_mode:.*", "compression_mode: message", text))
    assert "compression_mode: message" in about.read_text()
    columns = {"force": "/ft.wrench.force.z", "position": "/ft.wrench.force.x"}
    assert len(read_log(path, **columns)) == len(T)
    with sqlite3.connect(storage(path)) as own:  # the beginning of what is packed, and no more of it
        own.execute("UPDATE messages SET data = x'28b52ffdffffffffff'")
    own.close()
    refused(path, "cannot be unpacked|a message on /ft is no", **columns)


@pytest.mark.parametrize("field", ["name", "type"])
def test_a_bag_whose_names_are_no_text(tmp_path, field):
    path = storage(write_bag(tmp_path / "bag", "sqlite", [wrench("/ft", T, np.outer(T, [1, 2, 3]))]))
    with sqlite3.connect(path) as own:
        own.execute(f"UPDATE topics SET {field} = x'ff00ff'")
    own.close()
    refused(
        path, "cannot be read as a ROS 2 bag|holds no messages", force="/ft.wrench.force.z", position="/ft.x"
    )
    with pytest.raises(InputError):
        list_log(path)


@pytest.mark.parametrize(
    ("limit", "words"), [(1.2e9, "its libraries need 2 GB"), (2.1e9, "GB of memory to be read")]
)
def test_little_memory_is_a_line(tmp_path, limit, words):
    path = tmp_path / "log.csv"
    path.write_text("t,x,f\n" + "".join(f"{k},{k},{k}\n" for k in range(50)))
    with path.open("ab") as file:
        file.truncate(10**8)  # a file with holes: it takes no room on the disk
    command = f"ulimit -v {int(limit / 1024)}; exec {sys.executable} -m palpate topics {path}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, check=False)
    assert done.returncode == 2
    assert words in done.stderr.decode()
    assert done.stderr.count(b"\n") == 1


def test_a_position_as_large_as_a_number_can_be(tmp_path, capsys):
    """A byte that is spoiled makes one reading of 1e307: a multiple of it is no number any more."""
    rows = [f"{k / 1000:.3f},{k % 7 / 10},{k % 7}" for k in range(200)]
    rows[150] = "0.150,-1.6e307,3"
    log = tmp_path / "log.csv"
    log.write_text("time_s,position_mm,force_N\n" + "\n".join(rows) + "\n")
    assert main(["topics", str(log)]) == 0
    assert "position_mm" in capsys.readouterr().out
