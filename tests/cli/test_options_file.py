"""Options of a cell in a file, and presets of makers, as a user types them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cli.asked import ask, refused
from contact_frame.synthetic_arm import any_world, log_of
from palpate.logs.presets import presets


@pytest.fixture
def ur_log(elsewhere):
    """A press as a UR records it, from 1 kHz on."""
    world = any_world(
        np.random.default_rng(0), frame="base", weight=np.zeros(3), tcp=np.array([0, 0, 0.1]), turns=False
    )
    record = log_of(world, np.random.default_rng(1))
    turn = Rotation.from_quat(np.column_stack([record[f"quaternion_{a}"] for a in "xyzw"])).as_rotvec()
    force = [record[f"force_{a}"] for a in "xyz"] + [np.zeros(len(record))] * 3
    pose = [record[f"position_{a}"] for a in "xyz"] + list(turn.T)
    names = [
        "timestamp",
        *(f"actual_TCP_force_{i}" for i in range(6)),
        *(f"actual_TCP_pose_{i}" for i in range(6)),
    ]
    rows = np.column_stack([record["time"], *force, *pose])
    np.savetxt("ur.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return elsewhere / "ur.csv"


@pytest.mark.long
def test_a_preset_and_a_saved_file_say_the_same_as_all_words(ur_log, capsys):
    words = ["--preset", "ur-rtde", "--tcp", "0,0,100:mm", "--save-options", "my-cell.toml"]
    code, found = ask(capsys, "identify", ur_log, *words)
    assert code == 1  # K is a lower bound: the arm's own compliance is in it
    assert found["parameters"]["K"]["value"] == pytest.approx(5000, rel=0.05)
    text = (ur_log.parent / "my-cell.toml").read_text()
    assert 'rotation = "rotation-vector"' in text
    assert 'tcp = "0,0,100:mm"' in text
    again = ask(capsys, "identify", ur_log, "--options", "my-cell.toml")[1]
    assert again["parameters"]["K"]["value"] == found["parameters"]["K"]["value"]


def test_what_is_typed_wins_over_the_file_and_the_file_over_the_preset(ur_log, capsys, elsewhere):
    (elsewhere / "cell.toml").write_text('preset = "ur-rtde"\nmax_size = 1.5\nposition-from = "tip"\n')
    code, found = ask(
        capsys,
        "identify",
        ur_log,
        "--options",
        "cell.toml",
        "--position-from",
        "joints",
        "--save-options",
        "told.toml",
    )
    assert code == 1
    assert (
        found["parameters"]["K"]["verdict"] == "not identifiable"
    )  # a lower bound, from encoders in the joints
    told = (elsewhere / "told.toml").read_text()
    assert 'position-from = "joints"' in told
    assert "max-size = 1.5" in told


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('wrench_fram = "base"', "did you mean 'wrench-frame'"),
        ("json = true", "unknown option 'json'"),
        ('preset = "ur-rtd"', "did you mean 'ur-rtde'"),
        ("wrench-frame = {a = 1}", "must be a text"),
        ("= 1", "not TOML"),
        ('wrench-frame = "moon"', "moon"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(ur_log, capsys, elsewhere, text, says):
    (elsewhere / "cell.toml").write_text(text)
    assert says in refused(capsys, "identify", ur_log, "--options", "cell.toml")


def test_an_unknown_preset_and_a_missing_file_are_refused(ur_log, capsys):
    assert "there are: franka, ros2, ur-rtde" in refused(capsys, "identify", ur_log, "--preset", "kuka")
    assert "none.toml" in refused(capsys, "identify", ur_log, "--options", "none.toml")


@pytest.mark.parametrize("name", presets())
def test_every_preset_is_understood(capsys, name):
    assert "ur.csv" in refused(capsys, "identify", "ur.csv", "--preset", name)
