"""Friction of a joint or an axis: intervals that hold, and no number that the motion does not show."""

from __future__ import annotations

import json

import numpy as np
import pytest

import palpate
from contact_frame.sliding_axis import MOTIONS, simulate
from palpate._vector import Vec3
from palpate.cli import main
from palpate.contact_frame import AxisFriction, identify_friction
from palpate.errors import InputError
from palpate.friction import LuGre
from palpate.identification import Verdict
from palpate.instruments import Encoder
from palpate.records import Record

TIME = np.arange(0.0, 20.0, 4e-3)
SWING = 0.5 * np.sin(2 * np.pi * 0.4 * TIME)
TRUE = {"Fc": 2.0, "B": 3.0, "F0": 1.0}


def record(speed=SWING, *, extra=0.0, sign=1.0, noise=0.05, seed=1, **columns) -> Record:
    """A log of an axis in N and m, with its position unless other columns are given."""
    force = TRUE["F0"] + TRUE["Fc"] * np.sign(speed) + TRUE["B"] * speed + extra
    force += noise * np.random.default_rng(seed).standard_normal(len(speed))
    columns = columns or {"position": 4e-3 * np.cumsum(speed)}
    units = {"time": "s", "force": "N", "position": "m", "velocity": "m/s"}
    return Record(
        {"time": TIME, "force": sign * force, **columns},
        {name: units[name] for name in ("time", "force", *columns)},
        {},
    )


def holds(friction: AxisFriction, name: str, value: float) -> bool:
    ends = friction.parameters[name].ci95
    return ends is not None and ends[0] <= value <= ends[1]


def count(seeds, names=("Fc", "B")):
    """How often the interval of each parameter holds, and how often it is identified."""
    held, identified = dict.fromkeys(names, 0), dict.fromkeys(names, 0)
    for seed in seeds:
        log, truth = simulate(seed)
        friction = identify_friction(log)
        for name in names:
            held[name] += holds(friction, name, getattr(truth, name))
            identified[name] += friction.parameters[name].verdict is Verdict.IDENTIFIED
    return held, identified


@pytest.mark.parametrize("motion", MOTIONS)
def test_intervals_hold_in_each_motion(motion):
    log, truth = simulate(2, motion, position=True)
    friction = identify_friction(log)
    for name in ("Fc", "B", "F0"):
        assert holds(friction, name, getattr(truth, name)), name


@pytest.mark.long
@pytest.mark.parametrize("first", [0, 1000])
def test_intervals_hold_in_95_percent_of_200_logs(first):
    """With white and coloured noise, an offset, a Stribeck effect, and speeds made from noisy positions."""
    held, identified = count(range(first, first + 200))
    assert min(held.values()) >= 184, held  # of 200 at 95 %, fewer are chance in one of 40
    assert min(identified.values()) >= 160, identified


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_of_the_force_is_irrelevant(sign):
    friction = identify_friction(record(sign=sign))
    assert holds(friction, "Fc", 2.0)
    assert holds(friction, "B", 3.0)
    assert [note["code"] for note in friction.notes] == ["force-sign-turned"] * (sign < 0)


def test_a_known_lag_of_the_force_is_taken_out():
    log, late = record(), 0.06
    columns = {**log.columns, "force": np.interp(TIME - late, TIME, log["force"])}
    log = Record(columns, log.units, {})
    unknown, known = identify_friction(log), identify_friction(log, lag=late)
    assert holds(known, "Fc", 2.0)
    assert holds(known, "B", 3.0)
    assert known.parameters["Fc"].std < 0.5 * unknown.parameters["Fc"].std


@pytest.mark.parametrize("extra", [0.3 * np.gradient(SWING, TIME), 5.0 * np.cumsum(SWING) * 4e-3])
def test_inertia_and_a_spring_are_no_friction(extra):
    friction = identify_friction(record(extra=extra))
    assert holds(friction, "Fc", 2.0)
    assert holds(friction, "B", 3.0)


def test_one_speed_has_one_number():
    """Coulomb and viscous friction are bounded, their sum is known."""
    speed = 0.2 * np.sign(np.sin(2 * np.pi * 0.3 * TIME))
    frictions = [identify_friction(record(speed, seed=seed)) for seed in range(6)]
    assert sum(holds(friction, "F", 2.0 + 3.0 * 0.2) for friction in frictions) >= 5
    for friction in frictions:
        assert friction.parameters["F"].verdict is Verdict.IDENTIFIED
        for name in ("Fc", "B"):
            parameter = friction.parameters[name]
            assert parameter.value is None
            assert parameter.verdict is Verdict.NOT_IDENTIFIABLE
            assert holds(friction, name, TRUE[name])
            assert "one speed" in parameter.reason


def test_one_direction_has_no_coulomb_friction():
    friction = identify_friction(record(np.where(TIME < 10.0, 0.1, 0.4)))
    for name in ("Fc", "F0", "F"):
        assert friction.parameters[name].ci95 is None
        assert "one direction" in friction.parameters[name].reason
    assert holds(friction, "B", 3.0)


@pytest.mark.parametrize(
    "position", [np.zeros(len(TIME)), np.random.default_rng(1).standard_normal(len(TIME))]
)
def test_no_motion_has_no_friction(position):
    friction = identify_friction(record(position=position))
    assert not friction.identified
    assert "too little motion" in friction.parameters["Fc"].reason


def test_a_curved_friction_is_rejected():
    friction = identify_friction(record(extra=8.0 * SWING * abs(SWING)))
    assert {friction.parameters[name].verdict for name in ("Fc", "B")} == {Verdict.REJECTED}
    assert [note["code"] for note in friction.notes] == ["model-rejected"]
    assert holds(friction, "F0", 1.0)


@pytest.mark.parametrize("joint", range(3))
def test_the_friction_of_the_thesis_joints(joint):
    """LuGre friction of the bench's joints, with presliding and stiction, turned past the bench's encoders."""
    friction = LuGre(sigma2=Vec3(0.5, 0.1, 0.02))
    own = LuGre(*(field[joint] if isinstance(field, tuple) else field for field in friction))
    dt = 1e-4
    time = np.arange(0.0, 12.0, dt)
    speed = 0.4 * np.sin(2 * np.pi * 0.25 * time) + 0.2 * np.sin(2 * np.pi * 0.7 * time + 1.0)
    bristle, torque = own.start(), np.empty(len(time))
    for k, v in enumerate(speed):
        torque[k], bristle = own.step(bristle, float(v), dt)
    torque += 0.01 * own.coulomb * np.random.default_rng(joint).standard_normal(len(time))
    angle = Encoder((614400.0, 409600.0, 2000.0)[joint]).read(dt * np.cumsum(speed))
    rows = slice(None, None, 10)
    columns = {"time": time[rows], "position": angle[rows], "force": torque[rows]}
    result = identify_friction(Record(columns, {"time": "s", "position": "rad", "force": "N m"}, {}))
    assert holds(result, "Fc", own.coulomb)
    assert holds(result, "B", own.sigma2)
    assert result.parameters["Fc"].verdict is Verdict.IDENTIFIED
    assert result.parameters["Fc"].unit == "N m"
    assert result.parameters["B"].unit == "N m s/rad"


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"time": TIME[:9], "force": TIME[:9], "position": TIME[:9]}, "needs 50 rows at least, got 9"),
        ({"time": TIME, "position": TIME}, "there is no force"),
        ({"time": TIME, "force": TIME}, "there is no position or velocity"),
        ({"time": TIME + 1e7 * (TIME > 9), "force": TIME, "position": TIME}, "gaps nearly everywhere"),
    ],
)
def test_what_is_no_log_of_an_axis_is_refused(columns, words):
    with pytest.raises(InputError, match=words):
        identify_friction(Record(columns, dict.fromkeys(columns, "1"), {}))


@pytest.fixture
def joint_csv(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = record(velocity=SWING)
    table = np.column_stack([log["time"], log["velocity"], log["force"]])
    np.savetxt("joint.csv", table, delimiter=",", header="t,qd,tau", comments="")
    return tmp_path


NAMED = ("--friction", "--time", "t", "--velocity", "qd:rad/s", "--force-column", "tau:Nm")


def test_the_command_answers_as_text_and_as_json(capsys, joint_csv):
    assert main(["identify", "joint.csv", *NAMED, "--figure", "f.png", "--report", "page.html"]) == 0
    text = capsys.readouterr().out
    assert "Coulomb friction 2.0" in text
    assert "N m s/rad" in text
    assert (joint_csv / "f.png").read_bytes().startswith(b"\x89PNG")
    assert "viscous friction" in (joint_csv / "page.html").read_text()
    assert main(["identify", "joint.csv", *NAMED, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    parameter = answer["parameters"]["Fc"]
    assert parameter["ci95"][0] < 2.0 < parameter["ci95"][1]
    assert parameter["verdict"] == "identified"
    found = palpate.identify_friction("joint.csv", time="t", velocity="qd:rad/s", force="tau:Nm")
    assert found.parameters["Fc"].value == parameter["value"]
    assert "Coulomb friction" in str(found)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--friction", "--velocity", "qd", "--time", "t"), "with --force-column (palpate topics"),
        (("--friction", "--force-column", "tau", "--time", "t"), "with --position or --velocity (palpate"),
        (("--friction", "--force-column", "tau", "--velocity", "qd"), "with --time or --rate (palpate"),
        (("--friction",), "with --force-column and --position or --velocity and --time or --rate"),
        (("--friction", "--wrench", "a,b,c"), "--friction is of one axis"),
        ((*NAMED, "--indenter", "sphere:5:mm"), "--indenter is for a press; leave out --friction"),
        ((*NAMED, "--lag", "8"), "is 8 ms meant?"),
        ((*NAMED, "--budget"), "--budget is for a press"),
        (("--velocity", "qd"), "--velocity is for the friction of an axis; add --friction"),
        (("other.csv", *NAMED), "--friction takes one log, got 2"),
    ],
)
def test_options_that_do_not_fit_are_one_line(capsys, joint_csv, words, said):
    assert main(["identify", "joint.csv", *words]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert said in printed.err
    assert printed.err.count("\n") == 1
