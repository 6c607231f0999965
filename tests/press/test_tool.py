"""A tool on a simulated arm: what its sensor shows, what a tare and a payload file take off, what is named."""

import json
from dataclasses import replace

import numpy as np
import pytest

from palpate.cli import main
from palpate.contact_frame import Payload
from palpate.errors import InputError
from palpate.press.prepare import PressSpec, prepare_press, surface_of
from palpate.press.setting import cell_of, held_tool, with_tool
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.summary import summarise
from palpate.report.press import notes
from palpate.robots import SerialArm

G = 9.80665
TOOL = Payload(
    mass=1.2, mass_std=0.01, weight=(0.0, 0.0, 1.2 * G), weight_std=0.05, bias=(0.5, -1.0, 2.0), bias_std=0.02,
    noise=0.1, wrench_frame="tool", centre=(0.01, 0.02, 0.06), centre_std=0.001, inertia=1.2, inertia_std=0.02,
)  # fmt: skip


def changed(**fields):
    return Payload(**{name: getattr(TOOL, name) for name in TOOL.__struct_fields__} | fields)


def pressing(tool=TOOL, **changes):
    asked = {"arm": "fr3", "force": 20.0, "surface": surface_of("K=5000,B=50"), "normal": (0.0, 0.0, -1.0)}
    return prepare_press(PressSpec(**{**asked, "payload": tool, "seconds": 4.0, **changes}))


def simulated(tool, physics="own", arm="ur5e", **changes):
    """An arm in free motion whose sensor has no noise."""
    asked = pressing(tool, arm=arm, physics=physics, **changes).request
    cell = cell_of(asked.arm, asked.place, asked.surface, asked.gains.arm, held_tool(tool))
    cell = cell._replace(place=cell.place + 1.0, sensor=cell.sensor._replace(noise=0.0))
    return SimulatedArm(asked.arm, asked.gains.arm, asked.place, cell, physics, resolution=0.0), asked


def test_the_arms_mass_is_that_of_both():
    """By MuJoCo, in which the tool is a body of its own."""
    import mujoco

    from palpate.robots.serial.serial_arm import mjcf

    arm = SerialArm.named("panda")
    spec = mujoco.MjSpec.from_string(mjcf(arm))
    spec.compiler.balanceinertia = True
    tip = next(site for site in spec.sites if site.name == "tip")
    hung = tip.parent.add_body(pos=tip.pos, quat=tip.quat)
    hung.mass, hung.ipos, hung.inertia, hung.explicitinertial = TOOL.mass, TOOL.centre, [1e-9] * 3, True
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = arm.home
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    loaded = with_tool(arm, TOOL)
    # Franka's link 4, which breaks the triangle inequality, is balanced by MuJoCo: links before it are another matter.
    np.testing.assert_allclose(loaded.mass_matrix(arm.home)[4:, 4:], M[4:, 4:], rtol=1e-6)
    np.testing.assert_allclose(loaded.gravity_torque(arm.home), data.qfrc_bias, atol=1e-9)


def test_at_rest_the_sensor_shows_weight_and_bias_and_the_tare_takes_them_off():
    arm, asked = simulated(TOOL)
    bias = asked.arm.forward_kinematics(asked.place.q)[:3, :3] @ np.array(TOOL.bias)
    arm.tare()
    # It points down on its surface, against what holds the tool; 1e-2 N of the arm's own motion on its springs.
    assert arm.zero == pytest.approx(-(1.2 * G + bias[2]), abs=1e-2)
    assert np.abs(arm.read().force).max() < 2e-2


@pytest.mark.parametrize("physics", ["own", "mujoco"])
def test_in_the_air_the_reading_follows_the_acceleration_of_the_tools_centre(physics):
    """By second differences of where the centre really is, over a shove of the arm."""
    arm, asked = simulated(TOOL, physics, arm="fr3", mode="torque")
    arm.tare()
    goal, reading, centre = asked.place.pose.copy(), [], []
    for k in range(300):
        goal[2, 3] = asked.place.pose[2, 3] + 0.004 * np.sin(2 * np.pi * 4.0 * k * 1e-3)
        goal[:3, :3] = asked.place.pose[:3, :3]
        arm._goal[:] = goal
        arm.move(np.zeros(3))
        pose = asked.arm.forward_kinematics(arm.truth.q)
        centre.append((pose[:3, :3] @ np.array(TOOL.centre) + pose[:3, 3]) @ asked.place.normal)
        reading.append(arm.read().force[2] * asked.place.normal[2])
    acceleration = np.gradient(np.gradient(centre, 1e-3), 1e-3)
    late = round(asked.gains.arm.low_pass.lag / 1e-3)
    shown, expected = np.array(reading[50 + late : 290]), 1.2 * acceleration[50 : 290 - late]
    assert np.ptp(expected) > 1.0
    # Sampled and filtered once a millisecond, of a motion of 4 Hz.
    assert np.abs(shown - shown.mean() - expected + expected.mean()).max() < 0.1 * np.ptp(expected)


@pytest.fixture(scope="module")
def pressed():
    """A press with the tool, and its record."""
    press = pressing()
    return press, press.run()


def test_it_presses_with_the_force_asked_for_and_the_tools_mass_is_taken_off(pressed):
    press, record = pressed
    found = summarise(record, press.request)
    assert found["end"] == "done"
    assert found["force"]["mean_N"] == pytest.approx(20.0, abs=0.1)
    K = found["identified"]["parameters"]["K"]
    assert K["ci95"][0] < 5000 < K["ci95"][1]
    assert record.meta["tool_mass_kg"] == [1.2, 0.02]
    assert not found["sensor_saturated"]


@pytest.mark.long
def test_a_wrong_sign_is_named_and_mass_and_damping_are_refused(tmp_path, capsys):
    (tmp_path / "tool.toml").write_text(changed(inertia=-0.3).to_toml())
    words = [
        "press",
        "--arm",
        "fr3",
        "--force",
        "20:N",
        "--surface",
        "K=5000,B=50",
        "--seconds",
        "3",
        "--json",
    ]
    code = main([*words, "--payload", str(tmp_path / "tool.toml"), "--out", str(tmp_path / "out")])
    assert code == 0
    found = json.loads(capsys.readouterr().out)["identified"]
    named = [note for note in found["warnings"] if note["code"] == "tool-inertia"]
    assert "with the wrong sign" in named[0]["text"]
    assert found["parameters"]["B"]["verdict"] == "rejected"
    assert "with the wrong sign" in (tmp_path / "out" / "report.html").read_text()
    assert main(["identify", str(tmp_path / "out" / "record.parquet"), "--json"]) in {0, 1}
    again = json.loads(capsys.readouterr().out)
    assert again["parameters"]["B"]["verdict"] == "rejected"
    assert "tool-inertia" in {note["code"] for note in again["warnings"]}


@pytest.mark.parametrize(("share", "says"), [(0.95, "tare it"), (2.0, "the end of its scale")])
def test_an_untared_and_a_saturated_sensor_are_refused(share, says):
    scale = pressing().request.gains.arm.sensor.full_scale
    with pytest.raises(InputError, match=says):
        pressing(changed(bias=(0.0, 0.0, share * scale))).run()


@pytest.mark.long
def test_a_sensor_that_meets_the_end_of_its_scale_under_way_is_named(pressed):
    press, record = pressed
    scale = press.request.gains.arm.sensor.full_scale
    shown = np.where(record["force_sampled"] > 19.0, scale - record.meta["tare_N"], record["force_sampled"])
    summary = summarise(replace(record, columns={**record.columns, "force_sampled": shown}), press.request)
    assert summary["sensor_saturated"] == pytest.approx(np.mean(record["force_sampled"] > 19.0))
    assert any("sensor was saturated" in note for note in notes(summary))


def test_a_tool_that_is_too_heavy_and_a_model_that_is_mujocos_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"takes \S+ N m of"):
        pressing(changed(mass=40.0))
    from palpate.robots.serial.serial_arm import mjcf

    path = tmp_path / "cell.xml"
    path.write_text(mjcf(SerialArm.named("iiwa14")))
    with pytest.raises(InputError, match="give the tool a body there"):
        pressing(arm=str(path), site="tip", physics="mujoco")
