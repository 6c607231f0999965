"""`palpate payload`, and the file it writes in `palpate identify`, as a user types them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cli.asked import ask
from contact_frame.synthetic_arm import any_world
from contact_frame.synthetic_arm import log_of as press_of
from contact_frame.turning_tool import Tool, log_of, six
from palpate.cli import main
from palpate.logs import write_record
from palpate.records import Record


def write(record, name):
    units = {"time": "s", "force": "N", "torque": "N m", "position": "m", "quaternion": "1"}
    write_record(Record(record.columns, {n: units[n.partition("_")[0]] for n in record.columns}), name)


def test_a_log_is_weighed_and_everything_is_written(elsewhere, capsys):
    write(log_of(Tool(), six(), np.random.default_rng(0)), "turning.parquet")
    words = [
        "payload",
        "turning.parquet",
        "--wrench-frame",
        "tool",
        "--out",
        "tool.toml",
        "--report",
        "tool.html",
    ]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "The tool weighs 0.80" in shown
    assert "centre of mass" in shown
    assert "mass = 0.80" in (elsewhere / "tool.toml").read_text()
    assert (
        "<svg" in (elsewhere / "tool.html").read_text()
        or "image/svg+xml" in (elsewhere / "tool.html").read_text()
    )
    assert main(words) == 2
    assert "--replace" in capsys.readouterr().err


@pytest.mark.long
def test_poses_that_do_not_tell_are_exit_code_1_and_nothing_is_written(elsewhere, capsys):
    write(log_of(Tool(), Rotation.from_rotvec(np.zeros((3, 3))), np.random.default_rng(0)), "still.parquet")
    code, found = ask(capsys, "payload", "still.parquet", "--wrench-frame", "tool", "--out", "tool.toml")
    assert code == 1
    assert found["payload"] is None
    assert "hardly turns" in found["lacking"][0]
    assert not (elsewhere / "tool.toml").exists()


@pytest.mark.long
def test_a_press_is_identified_with_the_payload(elsewhere, capsys):
    tool = Tool(side=-1.0, taken_off=1.0)
    write(log_of(tool, six(), np.random.default_rng(0)), "turning.parquet")
    assert main(["payload", "turning.parquet", "--wrench-frame", "tool", "--out", "tool.toml"]) == 0
    capsys.readouterr()
    world = any_world(
        np.random.default_rng(1),
        frame="tool",
        turns=False,
        weight=np.array([0.0, 0.0, 0.8 * 9.80665]),
        sign=-1.0,
    )
    write(press_of(world, np.random.default_rng(2)), "press.parquet")
    code, found = ask(capsys, "identify", "press.parquet", "--wrench-frame", "tool", "--payload", "tool.toml")
    assert code == 0
    K = found["parameters"]["K"]
    assert K["ci95"][0] < 5000 < K["ci95"][1]
    words = ["--wrench-frame", "tool", "--payload", "tool.toml", "--no-figure", "--verbose"]
    assert main(["identify", "press.parquet", *words]) == 0
    assert "by the payload file" in capsys.readouterr().out


@pytest.mark.long
def test_a_payload_of_other_axes_is_refused(elsewhere, capsys):
    write(log_of(Tool(), six(), np.random.default_rng(0)), "turning.parquet")
    main(["payload", "turning.parquet", "--wrench-frame", "tool", "--out", "tool.toml"])
    capsys.readouterr()
    assert main(["identify", "turning.parquet", "--wrench-frame", "base", "--payload", "tool.toml"]) == 2
    assert "weighed with a wrench in the tool's axes" in capsys.readouterr().err


def test_a_log_of_one_axis_is_refused(elsewhere, capsys):
    (elsewhere / "one.csv").write_text("t,x,f\n" + "\n".join(f"{i / 100},{i},{i}" for i in range(50)))
    assert main(["payload", "one.csv", "--time", "t", "--position", "x", "--force", "f"]) == 2
    assert "three dimensions" in capsys.readouterr().err
