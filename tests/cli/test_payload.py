"""`palpate payload`, and the file it writes in `palpate identify`, as a user types them."""

from __future__ import annotations

import json

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
    words = ["--wrench-frame", "tool", "--payload", "tool.toml", "--verbose"]
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


FLANGE = (0.0, 0.0, -0.05)
"""Of the wrist, from the point that the torque is about [m]."""


@pytest.fixture
def turning(elsewhere):
    """A tool's log; the words that weigh it."""
    write(log_of(Tool(), six(), np.random.default_rng(0)), "turning.parquet")
    return ["payload", "turning.parquet", "--wrench-frame", "tool", "--flange", "0,0,-50:mm"]


def test_load_files_are_written_as_their_controllers_read_them(turning, elsewhere, capsys):
    """By readers of their own: a script's call, JSON, and YAML."""
    from ruamel.yaml import YAML

    tool = Tool()
    mass, centre = (
        pytest.approx(tool.mass, abs=0.002),
        pytest.approx(np.subtract(tool.centre, FLANGE), abs=5e-4),
    )
    for ending in ("script", "json", "yaml"):
        assert main([*turning, "--out", f"tool.{ending}", "--json"]) == 0
        capsys.readouterr()
    taken = {}
    script = "\n".join(
        line for line in (elsewhere / "tool.script").read_text().splitlines() if line[0] != "#"
    )
    exec(script, {"set_target_payload": lambda m, cog: taken.update(m=m, cog=cog)})
    assert (taken["m"], taken["cog"]) == (mass, centre)
    desk = json.loads((elsewhere / "tool.json").read_text())
    assert (desk["mass"], desk["centerOfMass"]) == (mass, centre)
    assert (len(desk["transformation"]), len(desk["inertia"])) == (16, 9)
    ros = YAML(typ="safe").load((elsewhere / "tool.yaml").read_text())
    params = ros["sensor_filter_chain"]["filter1"]["params"]
    assert (params["tool"]["mass"], params["tool"]["CoG"]) == (mass, centre)
    # This sensor shows the action, so that the weight which the filter is to subtract points up.
    assert params["tool"]["gravity_field"][2] == pytest.approx(9.81, abs=0.01)
    assert ros["gravity_compensation"]["CoG"]["force"] == pytest.approx(-9.81 * tool.mass, abs=0.02)


def test_no_load_file_is_made_of_a_log_without_weight(elsewhere, capsys):
    write(log_of(Tool(mass=0.0), six(), np.random.default_rng(0)), "weightless.parquet")
    words = ["--wrench-frame", "tool", "--gravity-compensated", "--tolerance", "1", "--out", "tool.script"]
    assert main(["payload", "weightless.parquet", *words]) in {1, 2}
    assert not (elsewhere / "tool.script").exists()


def test_a_centre_is_turned_into_the_axes_of_the_sensor(elsewhere, capsys):
    """A sensor turned by a quarter about z has its x where the tool's y is."""
    tool = Tool(sensor=Rotation.from_euler("xyz", [0.0, 0.0, np.pi / 2]))
    write(log_of(tool, six(), np.random.default_rng(0)), "turned.parquet")
    words = ["payload", "turned.parquet", "--wrench-frame", "sensor", "--sensor-rpy", "0,0,90"]
    assert main([*words, "--out", "tool.yaml", "--json"]) == 0
    assert "CoG: [-0.0199" in (elsewhere / "tool.yaml").read_text()
