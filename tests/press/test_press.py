"""`palpate press`: what it does with each arm, what it writes, and what it refuses."""

import json
import re
import sys
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from palpate import read_log
from palpate._vector import ZERO3, Mat3
from palpate.bench.summary import RETREAT
from palpate.cli import main
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.force.arm import Limits, ServoLoop, load_arm
from palpate.force.gains import gains_for
from palpate.press.cell import Reading, WristSensor, read_sensor
from palpate.press.engines import press_gains
from palpate.press.prepare import PressSpec, prepare_press, surface_of
from palpate.press.pressing import press
from palpate.press.sequence import CautiousDriver, Plan
from palpate.press.setting import cell_of, check_able
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.summary import PressRequest, summarise
from palpate.records import Record

PLAIN = ("press", "--arm", "fr3", "--force", "20:N", "--surface", "K=5000,B=50")


def question(**changes):
    return PressSpec(**{"arm": "fr3", "force": 20.0, "surface": surface_of("K=5000,B=50"), **changes})


def asked(**changes):
    pressing = prepare_press(question(**changes))
    record = pressing.run()
    return record, summarise(record, pressing.request)


@pytest.mark.parametrize(
    ("arm", "mode", "stiffness"),
    [pytest.param("fr3", "torque", 6e4, marks=pytest.mark.long), ("ur5e", "position", 5e3)],
)
def test_it_presses_with_the_force_asked_for_and_finds_the_surface(arm, mode, stiffness):
    asked_for = {"arm": arm, "mode": mode, "surface": surface_of(f"K={stiffness},B=50"), "seconds": 4.0}
    runs = [asked(**asked_for, seed=seed) for seed in range(3)]
    assert all(summary["end"] == "done" for _, summary in runs)
    # Of single presses the law may take K_u too high after the steps of the probe, and come back within 5 % slowly.
    means = [summary["force"]["mean_N"] for _, summary in runs]
    assert np.median(means) == pytest.approx(20.0, abs=0.1)
    assert min(means) > 0.95 * 20.0
    record, summary = runs[0]
    assert summary["force"]["overshoot_N"] < 0.1 * 20.0
    assert summary["force"]["settling_s"] < 0.5
    assert summary["contacts_lost"] == 0
    K = summary["identified"]["parameters"]["K"]
    assert K["verdict"] == "identified"
    assert K["ci95"][0] < stiffness < K["ci95"][1]
    if mode == "position":  # the tip's mass between encoders and surface is no negative mass of the surface
        B, M = (summary["identified"]["parameters"][name] for name in ("B", "M"))
        assert B["ci95"][0] < 50.0 < B["ci95"][1]
        assert "rejected" not in (B["verdict"], M["verdict"])
    assert np.abs(record["y"] - record["y"][0]).max() < 1e-3


@pytest.mark.parametrize("physics", ["own", pytest.param("mujoco", marks=pytest.mark.long)])
def test_a_servo_that_yields_presses_and_its_encoders_show_the_surface(physics, tmp_path):
    """The encoders are on the links: nothing is in series, and a surface stiffer than the servo is identified."""
    ours = load_arm("ur5e")
    inner = ServoLoop(mass=3.67, stiffness=4950.0, damping=990.0, delay=0.008)
    arm = msgspec.structs.replace(ours, inner=inner, limits=Limits(speed=0.25, stiffness=2e5))
    (tmp_path / "gains.toml").write_text(gains_for(arm, 15.0).to_toml())
    surface = surface_of("K=50000,B=0")
    changes = {"gains": tmp_path / "gains.toml", "physics": physics, "seconds": 3.0}
    _, summary = asked(arm="ur5e", force=20.0, surface=surface, **changes)
    assert summary["end"] == "done"
    assert summary["force"]["mean_N"] == pytest.approx(20.0, abs=0.1)
    assert summary["force"]["overshoot_N"] < 0.1 * 20.0
    low, high = summary["identified"]["parameters"]["K"]["ci95"]
    assert low < 5e4 < high < 1.5 * 5e4


def test_a_slow_touch_of_a_heavy_tip_is_not_taken_for_a_soft_surface():
    """In the noise for 30 ms: a start of the contact that is sought too coarsely has air before it, and is flat."""
    over = []
    for seed in (2, 9, 16, 36):
        pressing = prepare_press(question(arm="iiwa14", mode="position", seconds=0.4, seed=seed))
        over.append(float((pressing.run()["force"] - 20.0).max()))
    assert max(over) < 0.05 * 20.0


def test_gains_for_a_tip_without_mass_say_what_to_add(tmp_path):
    known = prepare_press(question(arm="ur5e", mode="position")).request.gains
    assert not any("under [inner]" in note for note in prepare_press(question(arm="ur5e")).request.notes)
    inner = msgspec.structs.replace(known.arm.inner, mass=None)
    massless = msgspec.structs.replace(known, arm=msgspec.structs.replace(known.arm, inner=inner))
    (tmp_path / "gains.toml").write_text(massless.to_toml())
    notes = prepare_press(question(arm="ur5e", gains=tmp_path / "gains.toml")).request.notes
    assert [note for note in notes if "add mass = M, 3.7 kg here, under [inner]" in note and "\n" not in note]


@pytest.mark.long
@pytest.mark.parametrize("controller", ["hybrid", "proportional-integral"])
def test_controllers_of_three_directions_press_with_seven_joints(controller):
    """Nothing of them was changed; damping of the surface is all that damps them, as on the bench."""
    _, summary = asked(controller=controller, arm="iiwa14", seconds=4.0)
    assert summary["end"] == "done"
    assert summary["force"]["mean_N"] == pytest.approx(20.0, abs=0.5)


def test_the_folder_and_what_is_printed(tmp_path, capsys):
    out = tmp_path / "press"
    assert main([*PLAIN, "--seconds", "1.5", "--out", str(out), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((out / "summary.json").read_text()).items() <= printed.items()
    assert {"end", "force", "identified", "truth", "saturated", "contacts_lost", "seed"} <= set(printed)
    assert printed["command"].startswith("palpate press --arm fr3")
    page = (out / "report.html").read_text()
    assert "data:image/svg+xml" in page
    assert " src=" not in page.replace(' src="data:', "")
    film = (out / "film.svg").read_text()
    assert film.count("<animate ") >= 5
    assert len(film) < 100_000
    record = read_log(out / "record.parquet", time="t", position="x_measured", force="force_sampled")
    assert len(record) > 2000
    assert main([*PLAIN, "--seconds", "1", "--out", str(out)]) == 2
    assert "exists" in capsys.readouterr().err
    assert main(["identify", str(out / "record.parquet"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]["K"]
    assert found["ci95"][0] < 5000.0 < found["ci95"][1]


def simulated(arm="fr3", **changes):
    """A press that is over soon: the arm, its driver, its place."""
    asked = prepare_press(question(arm=arm)).request
    robot = replace(asked.arm, **changes)
    cell = cell_of(robot, asked.place, asked.surface, asked.gains.arm)
    one = SimulatedArm(robot, asked.gains.arm, asked.place, cell)
    return one, CautiousDriver(one, ForceLoop(asked.gains), asked.place.normal), asked.place


def test_it_ends_at_the_end_of_a_joints_range():
    home = prepare_press(question()).request.arm.home
    one, driver, place = simulated(lower=home - 1e-4, upper=home + 1e-4)
    record = press(one, driver, place, Plan(20.0, 1.0), driver.loop.gains)
    assert record.meta["end"] == "joint limit"
    assert "reached the end of its range" in record.meta["why"]


def test_it_gives_up_where_there_is_no_surface():
    one, driver, place = simulated()
    record = press(one, driver, place, Plan(20.0, 1.0, longest=0.05), driver.loop.gains)
    assert record.meta["end"] == "no contact"
    assert np.count_nonzero(record["phase"] != RETREAT) == 50


def test_an_interrupted_press_keeps_what_there_is():
    one, driver, place = simulated()

    def progress(time, phase):
        if time > 0.3:
            raise KeyboardInterrupt

    record = press(one, driver, place, Plan(20.0, 1.0), driver.loop.gains, progress)
    assert record.meta["end"] == "interrupted"
    assert np.count_nonzero(record["phase"] != RETREAT) == 400


def test_a_place_and_a_normal_of_ones_own():
    pressing = prepare_press(question(at=(0.45, 0.1, 0.4), normal=(0.3, 0.0, -1.0)))
    place = pressing.request.place
    assert place.pose[:3, 2] == pytest.approx(np.array([0.3, 0.0, -1.0]) / np.sqrt(1.09), abs=1e-8)
    surface = place.pose[:3, 3] + 0.003 * place.normal
    assert surface == pytest.approx([0.45, 0.1, 0.4], abs=1e-8)


def test_a_users_own_gains(tmp_path):
    pressing = prepare_press(question(force=15.0))
    path = tmp_path / "gains.toml"
    path.write_text(pressing.request.gains.to_toml())
    again = prepare_press(question(force=15.0, gains=path))
    assert again.request.gains == pressing.request.gains
    others = [
        ({"mode": "position"}, "for a torque arm, and --mode says position"),
        ({"arm": "iiwa14"}, "for the Franka Research 3, and --arm says iiwa14"),
        ({"surface": surface_of("K=2e6,B=0")}, "the gains are for at most 1e[+]06 N/m"),
        ({"force_max": 60.0}, "the gains are for F_max = 75 N"),
    ]
    for changes, reason in others:
        with pytest.raises(InputError, match=reason):
            prepare_press(question(**{"force": 15.0, "gains": path, **changes}))


WRONG = [
    (["--arm", "fr33"], "did you mean 'fr3'"),
    (["--arm", "nowhere.xml"], "nowhere.xml"),
    (["--arm", "nowhere.urdf"], "give it with --site|Give it with --site"),
    (["--arm", "nowhere.urdf", "--site", "tip"], "No such file"),
    (["--site", "tip"], "--site is for files"),
    (["--force", "0"], "above 0 N"),
    (["--force", "-3"], "above 0 N"),
    (["--force", "20:m"], "unit of force"),
    (["--force", "0.5"], "standard deviations of the sensor's noise"),
    (["--force", "500"], "force limit|full scale"),
    (["--surface", "soft"], "needs K=5000,B=50"),
    (["--surface", "K=500,behind=1e5"], "thickness and behind together"),
    (["--surface", "K=500,thickness=20:mm,behind=1e5,M=1"], "without M"),
    (["--surface", "K=500,thickness=-1,behind=1e5"], "thickness must be above 0 m"),
    (
        ["--surface", "K=500,thickness=20:N,behind=1e5"],
        "thickness needs a unit of m, and 'N' is one of force",
    ),
    (["--surface", "K=500,thickness=20:mm,behind=2e6"], "the gains are for at most"),
    (["--free-force", "rope=3"], "--free-force needs cable=20"),
    (["--free-force", "ripple=1,wave=0"], "the wave must be longer"),
    (["--free-force", "ripple=1.5"], "in free motion the force changes with the position by"),
    (["--surface", "B=50"], "needs a stiffness"),
    (["--surface", "K=5000,K=3"], "has K twice"),
    (["--surface", "K=many"], "K needs a number"),
    (["--surface", "K=-5"], "stiffness must be above 0"),
    (["--surface", "K=2e6"], "the gains are for at most"),
    (["--mode", "speed"], "unknown mode 'speed'"),
    (["--physics", "bullet"], "unknown physics 'bullet'"),
    (["--controller", "hybird"], "did you mean 'hybrid'"),
    (["--controller", "hybrid", "--mode", "position"], "gives torques"),
    (["--at", "3,0,0"], r"out of reach of Franka Research 3 by \d"),
    (["--at", "3,0"], "three numbers"),
    (["--normal", "0,0,0"], "a normal needs a length"),
    (["--seconds", "0"], "longer than 0 s"),
    (["--seconds", "nan"], "must be a number"),
    (["--probe", "1.5"], "share of the force"),
    (["--seed", "1.5"], "whole number"),
    (["--gains", "nowhere.toml"], "No such file"),
]


@pytest.mark.parametrize(("words", "what"), WRONG, ids=[" ".join(words) for words, _ in WRONG])
def test_what_is_wrong_is_one_line(words, what, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = dict(zip(PLAIN[1::2], PLAIN[2::2], strict=True)) | dict(zip(words[::2], words[1::2], strict=True))
    code = main(["press", *(word for pair in given.items() for word in pair), "--out", "here"])
    said = capsys.readouterr().err
    assert code == 2, said
    assert len(said.strip().splitlines()) == 1
    assert re.search(what, said), said
    assert not (tmp_path / "here").exists()


def test_a_singular_pose_says_by_how_much(tmp_path, capsys):
    text = "title = 'Straight'\nhome = [0.0, -1.2, 0.0, 0.3, 0.4, 0.0]\n" + (names_file("ur5e")).split(
        "\n", 6
    )[-1].split("flange", 1)[1].join(["flange", ""])
    path = tmp_path / "straight.toml"
    path.write_text(text)
    code = main(["press", "--arm", str(path), *PLAIN[3:], "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert code == 2
    assert "singular: the smallest singular value of the Jacobian is" in said
    assert "at least" in said


def names_file(name):
    from importlib.resources import files

    return files("palpate.robots.serial").joinpath("arms", f"{name}.toml").read_text(encoding="utf-8")


def test_a_sample_is_of_its_own_instant():
    """Of a force that grows evenly the readings are exact, wherever between two steps a sample falls."""
    step, slope, sampling = 0.5e-3, 100.0, 480.0
    sensor = WristSensor(Mat3(ZERO3, ZERO3, ZERO3), ZERO3, ZERO3, 1.0, step, sampling, 0.0, 1e3)
    reading, seen = Reading(ZERO3, 0.0, 0.0, 0.0), []
    for k in range(1, 400):
        before = reading.samples
        reading = read_sensor(sensor, reading, slope * (k - 1) * step, k * step, np.zeros(8))
        if reading.samples != before:
            seen.append((before, reading.value))
    assert [int(number) for number, _ in seen] == list(range(len(seen)))
    for number, value in seen[1:]:  # the first is before the force
        assert value == pytest.approx(slope * number / sampling, abs=1e-9)


def test_a_heavy_tip_of_a_position_arm_does_not_deceive_the_law():
    """Some 6 N over before its swing was in the lag and in the time before anything is learned."""
    record, _ = asked(arm="iiwa14", mode="position", surface=surface_of("K=1e5,B=50"), seconds=0.6, probe=0.0)
    assert record["force"].max() < 1.05 * record["force_desired"].max()


def test_too_few_joints(tmp_path, capsys):
    from robots.serial.oracles import URDF

    assert (
        main(["press", "--arm", str(URDF), "--site", "probe", *PLAIN[3:], "--out", str(tmp_path / "o")]) == 2
    )
    assert "has 4 joints" in capsys.readouterr().err


def test_without_mujoco_the_extra_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert main([*PLAIN, "--physics", "mujoco", "--out", str(tmp_path / "out")]) == 2
    assert "pip install '.[arms]' in palpate's sources" in capsys.readouterr().err


def test_a_force_that_the_motors_cannot_give():
    pressing = prepare_press(question(arm="panda"))
    with pytest.raises(InputError, match=r"takes \S+ N m of joint\d, which gives"):
        check_able(pressing.request.arm, pressing.request.place, 0.003, 1000.0)


#: A user's model: position servos, a gripper, damping, a floor in the way, a keyframe, and no site.
def cell(damping=0.0):
    from palpate.robots import SerialArm
    from palpate.robots.serial.serial_arm import mjcf

    arm = SerialArm.named("iiwa14")
    text = mjcf(arm).replace('armature="0.1"', f'armature="0.1" damping="{damping}"')
    text = re.sub(
        r"<site [^>]*>", '<body name="hand" pos="0 0 0.045"><geom size="0.02" mass="0.1"/>'
        '<body name="finger"><joint name="grip" type="slide"/><geom size="0.01" mass="0.05"/></body></body>', text
    )  # fmt: skip
    servos = "".join(f'<position joint="{name}" kp="1000"/>' for name in arm.names)
    keys = " ".join(map(str, (*arm.home, 0.0)))
    extra = f'<actuator>{servos}</actuator><keyframe><key qpos="{keys}"/></keyframe>'
    floor = '<worldbody><geom type="plane" size="2 2 0.1" pos="0 0 0.5"/>'
    return text.replace("<worldbody>", floor).replace("</mujoco>", extra + "</mujoco>")


@pytest.mark.parametrize("physics", ["own", "mujoco"])
def test_a_users_own_model(tmp_path, physics):
    path = tmp_path / "cell.xml"
    path.write_text(cell())
    pressing = prepare_press(question(arm=str(path), site="hand", physics=physics, seconds=0.6))
    assert any("grip" in note for note in pressing.request.notes)
    record = pressing.run()
    assert record["force"][record["phase"] != RETREAT][-1] == pytest.approx(20.0, abs=1.0)
    assert record["force"][-1] == 0.0


@pytest.mark.long
def test_only_mujoco_knows_the_damping_of_its_joints(tmp_path):
    path = tmp_path / "cell.xml"
    path.write_text(cell(damping=30.0))
    pressing = prepare_press(question(arm=str(path), site="hand", physics="mujoco", seconds=0.4))
    assert any("damping" in note for note in pressing.request.notes)
    damped = pressing.run()
    free = prepare_press(question(arm=str(path), site="hand", seconds=0.4)).run()
    assert damped["x"][1000] < free["x"][1000] - 1e-5  # the approach is slower


def test_the_age_of_a_fast_sensors_reading_is_its_delay():
    """A sensor of 1010 Hz at 1 kHz: the age grows from 0 to a period of the sensor ten times a second."""
    gains = press_gains(load_arm("fr3"), 20.0)
    sensor = msgspec.structs.replace(gains.arm.sensor, sampling=1010.0)
    gains = msgspec.structs.replace(gains, arm=msgspec.structs.replace(gains.arm, sensor=sensor))
    request = PressRequest(None, gains, None, None, "cautious", "own", 0, ())
    t = np.arange(1000) / 1000.0
    random = np.random.default_rng(0).normal(size=1000)
    record = Record({"t": t, "force_sampled": random}, {"t": "s", "force_sampled": "N"}, {})
    assert request.delay(record) == pytest.approx(0.5 / 1010.0, rel=0.02)
    assert request.delay_std(record) == pytest.approx(1.0 / 1010.0 / np.sqrt(12.0 * 10.0), rel=0.07)
    held = replace(record, columns={"t": t, "force_sampled": np.repeat(np.arange(100.0), 10)})
    assert request.delay(held) == 0.0
