"""`palpate identify` and `palpate topics` on bags of a robot, as a user types them."""

from __future__ import annotations

import numpy as np
import pytest

from cli.asked import ask
from identification.synthetic_contacts import pressed
from logs.arm_bags import a_press, press_bag, topics_of
from logs.ros_bags import joints, pose, wrench, write_bag
from palpate.cli import main


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
