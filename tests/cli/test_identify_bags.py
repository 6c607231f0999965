"""`palpate identify` and `palpate topics` on bags of a robot, as a user types them."""

from __future__ import annotations

from html import unescape

import numpy as np
import pytest

from cli.asked import ask
from contact_frame.synthetic_arm import log_of
from identification.synthetic_contacts import pressed
from logs.arm_bags import a_press, press_bag, topics_of
from logs.ros_bags import joints, pose, storage, wrench, write_bag
from palpate.cli import main
from palpate.records import Record


def codes(found):
    return {warning["code"] for warning in found["warnings"]}


def stiffness(found):
    return found["parameters"]["K"]["value"]


@pytest.mark.parametrize(
    "kind", [*(pytest.param(k, marks=pytest.mark.long) for k in ("bag1", "sqlite")), "mcap"]
)
def test_a_bag_with_one_wrench_and_one_pose_needs_no_words(tmp_path, capsys, kind):
    press_bag(tmp_path / "press.bag", kind)
    code, found = ask(capsys, "identify", "press.bag")
    assert code == 0
    assert stiffness(found) == pytest.approx(5000, rel=0.03)
    low, high = found["parameters"]["K"]["ci95"]
    middle, half = (low + high) / 2, (high - low) / 2
    assert abs(middle - 5000) < 1.5 * half  # 3 of 1000 true intervals are farther off
    assert "frame-guess" in codes(found)
    assert set(found) >= {"model", "parameters", "contacts", "lag_s", "fit", "warnings", "working_point"}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["press.bag"]


def test_what_was_declared_and_found_is_shown(tmp_path, capsys):
    world = press_bag(tmp_path / "press", seed=1)
    x, y, z = 1e3 * world.tcp
    words = [
        "--wrench-frame",
        "tool",
        "--tcp",
        f"{x},{y},{z}:mm",
        "--tool-mass",
        "0.4:0.01",
        "--no-figure",
        "--verbose",
    ]
    assert main(["identify", "press", *words]) == 0
    shown = capsys.readouterr().out
    assert "wrench of /ft, pose of /pose" in shown
    assert "timed by the stamps in their headers" in shown
    assert f"the tool touches at ({x:.3g}, {y:.3g}, {z:.3g}) mm" in shown
    assert "found from the force (std" in shown
    assert "bias and weight together" in shown
    assert "the tool's 0.4 kg (std 0.01) are taken out of M" in shown
    assert "frame-guess" not in shown


@pytest.mark.long
def test_the_page_and_the_figure(tmp_path, capsys):
    press_bag(tmp_path / "press")
    assert main(["identify", "press", "--report", "press.html", "--figure", "press.png", "--verbose"]) == 0
    shown = capsys.readouterr().out
    assert "figure: press.png" in shown
    assert "report: press.html" in shown
    text = (tmp_path / "press.html").read_text()
    assert text.startswith("<!doctype html>")
    told = [line for line in shown.splitlines() if line.startswith(("wrench ", "normal ", "bias ", "timed "))]
    assert len(told) == 5
    assert all(line in unescape(text) for line in told)


@pytest.mark.long
def test_a_slower_pose(tmp_path, capsys):
    press_bag(tmp_path / "press", every=8)
    _, found = ask(capsys, "identify", "press")
    low, high = found["parameters"]["K"]["ci95"]
    assert low < 5000 < high < 1.1 * low
    assert "missing-samples" in codes(found)


def test_a_bag_that_was_cut_is_identified_as_far_as_it_goes(tmp_path, capsys):
    file = storage(press_bag_path(tmp_path))
    file.write_bytes(file.read_bytes()[: int(0.6 * file.stat().st_size)])
    _, found = ask(capsys, "identify", file)
    assert "log-cut-short" in codes(found)
    assert stiffness(found) == pytest.approx(5000, rel=0.01)


def press_bag_path(tmp_path, **said):
    press_bag(tmp_path / "press", **said)
    return tmp_path / "press"


@pytest.mark.long
def test_clocks_that_disagree_are_said(tmp_path, capsys):
    """The force's computer is 0.7 s behind; the recorder's own times put it right but for the way to it."""
    _, record = a_press(2)
    force, place = topics_of(record)
    force.received, place.received = force.time + 0.001, place.time + 0.001
    force.time = force.time - 0.7
    write_bag(tmp_path / "press", "mcap", [force, place])
    _, found = ask(capsys, "identify", "press")
    (text,) = [w["text"] for w in found["warnings"] if w["code"] == "clocks-disagree"]
    assert "the stamps of /ft stand 0.7 s behind those of /pose" in text
    assert stiffness(found) == pytest.approx(5000, rel=0.005)


@pytest.mark.long
def test_one_axis_of_a_joint(tmp_path, capsys):
    flat = pressed()
    sent = joints("/joint_states", flat["time"], ["lift"], flat["position"][:, None], flat["force"][:, None])
    write_bag(tmp_path / "press", "mcap", [sent])
    words = ("--position", "/joint_states.position.lift:m", "--force", "/joint_states.effort.lift:N")
    _, found = ask(capsys, "identify", "press", *words)
    assert stiffness(found) == pytest.approx(5000, rel=0.03)
    assert found["parameters"]["K"]["verdict"] == "not identifiable"
    assert "a lower bound" in found["parameters"]["K"]["reason"]
    assert "series-compliance" in codes(found)
    _, tip = ask(capsys, "identify", "press", *words, "--position-from", "tip")
    assert tip["parameters"]["K"]["verdict"] == "identified"


@pytest.mark.long
def test_the_robot_s_stiffness_from_a_press_on_a_wall(tmp_path, capsys):
    """Poses made from the joints: each is off by what the arm gives way, f / 40 kN/m."""
    for name, surface in (("wall", 4e7), ("foam", 5000.0)):
        flat = pressed(k=surface, b=0.0 if name == "wall" else 40.0)
        depth = flat["position"] + flat["force"] / 40e3
        down = np.column_stack([0 * depth, 0 * depth, -depth])
        force = np.column_stack([0 * depth, 0 * depth, flat["force"]])
        write_bag(
            tmp_path / name, "mcap", [wrench("/ft", flat["time"], force), pose("/pose", flat["time"], down)]
        )
    words = ("--wrench-frame", "base", "--normal", "0,0,-1")
    _, found = ask(capsys, "identify", "foam", *words, "--robot-stiffness-from", "wall")
    assert stiffness(found) == pytest.approx(5000, rel=0.05)
    _, plain = ask(capsys, "identify", "foam", *words, "--position-from", "joints")
    assert stiffness(plain) == pytest.approx(5000 * 40 / 45, rel=0.05)


@pytest.mark.long
def test_two_sensors_of_opposite_signs(tmp_path, capsys):
    _, record = a_press(3)
    force, place = topics_of(record)
    other = wrench("/hand", force.time, -force.values[:, :3])
    write_bag(tmp_path / "press", "mcap", [force, other, place])
    found = [ask(capsys, "identify", "press", "--wrench", topic)[1] for topic in ("/ft", "/hand")]
    assert stiffness(found[0]) == pytest.approx(stiffness(found[1]), rel=1e-6)


@pytest.mark.long
def test_a_force_at_the_end_of_its_range(tmp_path, capsys):
    """An axis of a tilted sensor stands at its limit while the tool goes on; those readings are left out."""
    _, record = a_press(8, noise=0.02)
    force, place = topics_of(record)
    span = np.abs(force.values[:, :3] - force.values[0, :3]).max(axis=0)
    axis = int(np.argmax(span))
    away = np.sign(force.values[1000, axis] - force.values[0, axis])
    limit = force.values[0, axis] + 0.7 * away * span[axis]
    force.values[:, axis] = away * np.minimum(away * force.values[:, axis], away * limit)
    write_bag(tmp_path / "press", "mcap", [force, place])
    _, found = ask(capsys, "identify", "press", "--wrench-frame", "tool")
    assert "saturated" in codes(found)
    own = found["parameters"]["K"]
    assert own["verdict"] != "identified" or own["ci95"][0] < 5000 < own["ci95"][1]


@pytest.mark.long
def test_only_free_motion(tmp_path, capsys):
    rng = np.random.default_rng(0)
    time = np.arange(3000) / 1000
    place = np.column_stack([0.1 * np.sin(time), 0 * time, 0.05 * np.sin(2 * time)])
    force = np.array([1.0, -2.0, 9.0]) + rng.normal(0, 0.05, (len(time), 3))
    write_bag(tmp_path / "press", "mcap", [wrench("/ft", time, force), pose("/pose", time, place)])
    code, found = ask(capsys, "identify", "press", "--wrench-frame", "tool")
    assert code == 1
    assert "no-contact" in codes(found)
    assert all(parameter["verdict"] != "identified" for parameter in found["parameters"].values())
    assert all(parameter["value"] is None for parameter in found["parameters"].values())
    assert not {"contact-at-start", "normal-uncertain"} & set(codes(found))
    main(["identify", "press", "--wrench-frame", "tool", "--no-figure", "--verbose"])
    shown = capsys.readouterr().out
    assert "free motion only" in shown
    assert "no free motion" not in shown


@pytest.mark.long
def test_many_short_contacts(tmp_path, capsys):
    """Taps of 0.13 s, 0.4 s apart."""
    time = np.arange(10_000) / 1000
    depth = 2e-3 * np.sin(2 * np.pi * 2.5 * time) - 1e-3
    speed = 2e-3 * 2 * np.pi * 2.5 * np.cos(2 * np.pi * 2.5 * time)
    force = np.where(depth > 0, np.maximum(5000 * depth + 20 * speed, 0), 0.0)
    force += np.random.default_rng(0).normal(0, 0.02, len(time))
    vector = np.column_stack([0 * time, 0 * time, force])
    down = np.column_stack([0 * time, 0 * time, -depth])
    write_bag(tmp_path / "taps", "mcap", [wrench("/ft", time, vector), pose("/pose", time, down)])
    _, found = ask(capsys, "identify", "taps", "--wrench-frame", "base")
    assert len(found["contacts"]) == 25
    point = found["working_point"]["stiffness"]
    assert point["ci95"][0] < 5000 < point["ci95"][1]


@pytest.mark.long
def test_a_table_of_an_arm(tmp_path, capsys):
    """The same wrench and pose as columns of a CSV file."""
    world, record = a_press(4, frame="base")
    names = [name for name in record.columns if not name.startswith("torque")]
    np.savetxt(
        "arm.csv",
        np.column_stack([record[n] for n in names]),
        delimiter=",",
        header=",".join(names),
        comments="",
    )
    words = (
        "--wrench",
        "force_x,force_y,force_z",
        "--pose",
        ",".join(names[4:]),
        "--tcp",
        ",".join(map(str, world.tcp)),
    )
    _, named = ask(capsys, "identify", "arm.csv", "--time", "time", *words, "--wrench-frame", "base")
    assert stiffness(named) == pytest.approx(5000, rel=0.005)
    _, own = ask(capsys, "identify", "arm.csv", *words[4:], "--wrench-frame", "base")
    for said in ("options", "command"):
        assert own.pop(said) != named.pop(said), "what was said differs"
    assert own == named


def test_topics_of_a_bag(tmp_path, capsys):
    _, record = a_press()
    flat = np.zeros((len(record), 1))
    sent = [*topics_of(record), joints("/joint_states", record["time"], ["lift"], flat, flat)]
    write_bag(tmp_path / "press", "mcap", sent, extra="/grip")
    assert main(["topics", "press"]) == 0
    shown = capsys.readouterr().out
    for words in (
        "4 topics, times from 2023-11-14 22:13:20 UTC on",
        "--wrench /ft",
        "--pose /pose",
        "1000 Hz",
        "3.999 s",
    ):
        assert words in shown
    _, found = ask(capsys, "topics", "press")
    entries = {entry["name"]: entry for entry in found["entries"]}
    assert entries["/ft"]["count"] == 4000
    assert entries["/ft"]["rate"] == pytest.approx(1000)
    assert entries["/ft"]["last"] - entries["/ft"]["first"] == pytest.approx(3.999)
    assert entries["/joint_states"]["about"] == "/joint_states.FIELD"
    assert entries["/joint_states"]["fields"] == ["position.lift", "velocity.lift", "effort.lift"]
    assert entries["/grip"]["fields"] == ["grip", "load.left", "load.right"]
    assert found["identify"]["command"] == "palpate identify press --wrench /ft --pose /pose"


def test_topics_of_a_bag_that_was_cut(tmp_path, capsys):
    file = storage(press_bag_path(tmp_path))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert main(["topics", str(file)]) == 0
    assert "complete messages" in capsys.readouterr().out


def test_columns_of_a_table(root, capsys):
    _, found = ask(capsys, "topics", root / "examples/data/press.csv")
    time, position, _ = found["entries"]
    assert time["name"] == "time_s"
    assert time["about"].endswith("(time?)")
    assert position["rate"] == pytest.approx(500)
    assert position["last"] == pytest.approx(7.998)


@pytest.mark.long
def test_a_record_in_three_dimensions_that_palpate_wrote(tmp_path, capsys):
    from palpate.logs import write_record

    world, record = a_press(5, frame="base")
    units = {
        name: {"force": "N", "position": "m", "time": "s"}.get(name[:-2] or name, "1")
        for name in record.columns
    }
    write_record(Record(record.columns, units | {"time": "s"}), tmp_path / "arm.parquet")
    words = ("--wrench-frame", "base", "--tcp", ",".join(map(str, world.tcp)))
    _, found = ask(capsys, "identify", "arm.parquet", *words)
    assert stiffness(found) == pytest.approx(5000, rel=0.005)


def test_a_tool_that_turns_tells_its_weight(tmp_path, capsys):
    rng = np.random.default_rng(0)
    world, _ = a_press(6, turns=True)
    write_bag(tmp_path / "press", "mcap", topics_of(log_of(world, rng)))
    words = ["--wrench-frame", "tool", "--tcp", ",".join(map(str, world.tcp)), "--no-figure", "--verbose"]
    assert main(["identify", "press", *words]) == 0
    shown = capsys.readouterr().out
    assert f"tool's weight {np.linalg.norm(world.weight):.3g} N" in shown
    assert "--tool-mass" in shown
