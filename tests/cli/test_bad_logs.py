"""Logs and words that are wrong: one line that says what to do, exit code 2, nothing written."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from identification.synthetic_contacts import pressed
from logs.arm_bags import a_press, topics_of
from logs.ros_bags import joints, pose, storage, wrench, write_bag
from palpate.cli import main
from palpate.records import Record

TIME = np.arange(200) / 100
ZERO = np.zeros((200, 3))
MOVED = np.column_stack([TIME, TIME, np.sin(TIME)])


def refused(folder, capsys, words, pattern):
    """The command ends with code 2 and one line that matches, and leaves the folder and the log as they were."""
    before = _state(folder, words[1])
    assert main(list(map(str, words))) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("palpate: ")
    assert printed.err.count("\n") == 1
    assert re.search(pattern, printed.err), printed.err
    assert _state(folder, words[1]) == before


def _state(folder, log):
    places = [*folder.rglob("*"), *Path(log).parent.rglob("*")]
    return {path: path.stat().st_mtime_ns for path in places}


def folder_without_a_bag(path):
    path.mkdir()
    (path / "notes.md").write_text("nothing")


def half(path, kind, size):
    whole = storage(write_bag(path.with_name("whole"), kind, [wrench("/ft", TIME, ZERO)]))
    path.write_bytes(whole.read_bytes()[:size])


FILES = {
    "missing": (lambda path: None, "there is no file"),
    "empty": (lambda path: path.write_bytes(b""), "is empty"),
    "folder": (folder_without_a_bag, "is a folder and no ROS 2 bag"),
    "empty folder": (lambda path: path.mkdir(), "is a folder and no ROS 2 bag"),
    "pipe": (os.mkfifo, "is a pipe or a device"),
    "a stub of an MCAP": (lambda path: half(path, "mcap", 40), "cannot be read as MCAP"),
    "an old ROS bag": (
        lambda path: path.write_bytes(b"#ROSBAG V1.2\n" + bytes(50)),
        "version 1.2 is not supported",
    ),
    "another database": (
        lambda path: path.write_bytes(b"SQLite format 3\x00" + bytes(4080)),
        "cannot be read",
    ),
}


@pytest.mark.parametrize("command", ["identify", pytest.param("topics", marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", FILES)
def test_a_file_that_is_none(tmp_path, capsys, kind, command):
    make, pattern = FILES[kind]
    make(tmp_path / "log")
    refused(tmp_path, capsys, [command, "log"], pattern)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
@pytest.mark.parametrize("command", ["identify", "topics"])
def test_a_file_that_may_not_be_read(tmp_path, capsys, command):
    path = tmp_path / "log.bag"
    path.write_bytes(b"#ROSBAG V2.0\n")
    path.chmod(0)
    refused(tmp_path, capsys, [command, path], "check its permissions")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    _, whole = a_press()
    record = Record({name: column[::10] for name, column in whole.columns.items()}, whole.units, whole.meta)
    flat = np.zeros((len(record), 1))
    joint = joints("/joint_states", record["time"], ["lift"], flat, flat)
    return write_bag(
        tmp_path_factory.mktemp("bags") / "press", "mcap", [*topics_of(record), joint], extra="/grip"
    )


WORDS = {
    "force alone": (["--force", "/ft.wrench.force.z"], "--force needs its --position"),
    "both kinds": (["--force", "/ft.wrench.force.z", "--pose", "/pose"], "not of both"),
    "too short a tcp": (["--tcp", "0,0"], "--tcp needs three numbers, as 0,0,0.12"),
    "a tcp in newtons": (["--tcp", "0,0,1:N"], "'N' of --tcp is a unit of force"),
    "a tcp that is no number": (["--tcp", "0,0,nan"], "--tcp needs three numbers"),
    "a normal of other axes": (["--normal", "world:0,0,1"], "--normal needs x,y,z, base:x,y,z or tool:x,y,z"),
    "an unknown frame": (["--wrench-frame", "flange"], "flange.*--help"),
    "a sign": (["--force-sign", "reaction", "--wrench-frame", "tool"], "say --force-sign action"),
    "free": (["--free", "1"], "--free needs BEGIN,END in seconds"),
    "tool": (["--tool-mass", "heavy"], "--tool-mass needs VALUE or VALUE:STD, as 0.8 or 0.8:0.02"),
    "tool below zero": (["--tool-mass", "-1"], "0 kg or more|needs an argument|requires"),
    "negative std": (["--robot-stiffness", "4e4:-1"], "must be 0 or more"),
    "two stiffnesses": (["--robot-stiffness", "4e4", "--robot-stiffness-from", "wall"], "not both"),
    "no wall": (["--robot-stiffness-from", "wall.mcap"], "there is no file wall.mcap"),
    "softer than the log": (["--robot-stiffness", "1000"], "softer than the log's own"),
    "filter": (["--force-filter", "bessel:3"], "butterworth3:120"),
    "mass": (["--mass", "some"], "--mass needs VALUE or VALUE:STD"),
    "report's kind": (["--report", "a.pdf"], "HTML file; name it a.html"),
    "report's folder": (["--report", "none/a.html"], "no folder none"),
    "a cut of nothing": (["--start", "99"], "no row of"),
    "missing words": (["--missing", "NA"], "--missing needs numbers"),
}


@pytest.mark.parametrize("kind", WORDS)
def test_words_that_are_wrong(tmp_path, bag, capsys, kind):
    words, pattern = WORDS[kind]
    refused(tmp_path, capsys, ["identify", bag, *words], pattern)


def test_no_wrench_or_two(tmp_path, capsys):
    write_bag(tmp_path / "none", "mcap", [pose("/pose", TIME, MOVED)])
    refused(
        tmp_path,
        capsys,
        ["identify", "none"],
        r"none of its topics is a wrench.*palpate topics none lists them",
    )
    sent = [wrench("/ft", TIME, MOVED), wrench("/hand", TIME, MOVED), pose("/pose", TIME, MOVED)]
    write_bag(tmp_path / "two", "mcap", sent)
    refused(tmp_path, capsys, ["identify", "two"], "there are /ft, /hand")


def test_a_wrench_of_a_log_of_one_axis(tmp_path, capsys):
    flat = pressed()
    columns = [flat[name] for name in ("time", "position", "force")]
    np.savetxt("log.csv", np.column_stack(columns), delimiter=",", header="time,position,force", comments="")
    refused(tmp_path, capsys, ["identify", "log.csv", "--tcp", "0,0,1"], "this log has one axis")
    refused(tmp_path, capsys, ["identify", "log.csv", "--wrench", "force"], "name the pose's columns")
    refused(
        tmp_path,
        capsys,
        ["identify", "log.csv", "--wrench", "force", "--pose", "position"],
        "--wrench needs fx,fy,fz",
    )
    assert main(["identify", "log.csv"]) == 0
    capsys.readouterr()


def test_a_name_that_begins_with_a_bracket_is_a_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    t = np.arange(200) / 100
    rows = "".join(f"{a},{1e-3 * np.sin(9 * a)},{2 + np.sin(9 * a)}\n" for a in t)
    Path("plain.csv").write_text("t,x,f\nthis is another file\n")
    for name in ('["plain.csv"]', "[1]press.csv", "{1}.csv"):
        Path(name).write_text("t,x,f\n" + rows)
        assert main(["identify", name, "--time", "t", "--position", "x", "--force", "f", "--json"]) in {0, 1}
        assert f'"file": {json.dumps(name)}' in capsys.readouterr().out


@pytest.mark.parametrize("command", ["topics", "identify"])
def test_a_name_that_is_not_utf_8_in_every_output(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    t = np.arange(200) / 100
    log = Path(os.fsdecode(b"pr\xe9sse.csv"))
    log.write_text("t,x,f\n" + "".join(f"{a},{1e-3 * np.sin(9 * a)},{2 + np.sin(9 * a)}\n" for a in t))
    columns = ["--time", "t", "--position", "x", "--force", "f"] if command == "identify" else []
    assert main([command, str(log), *columns, "--json"]) in {0, 1}
    printed = json.loads(capsys.readouterr().out)
    assert "sse.csv" in printed["files"][0]["file"]
    if columns:
        assert main([command, str(log), *columns, "--report", "r.html"]) in {0, 1}
        assert "sse.csv" in Path("r.html").read_text()
