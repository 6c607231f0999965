"""From a log to an identification in one call, and on to gains and a press of the same surface."""

from __future__ import annotations

import json

import numpy as np
import pytest

import palpate
from palpate.cli import main
from palpate.errors import InputError
from palpate.logs.listing import list_log

K, B, RATE = 8000.0, 40.0, 500


def ur_log(path, seed=0):
    """A press of a UR with its own recorder's 13 columns: down, hold with three dips, up; encoders of 1 um."""
    rng, time = np.random.default_rng(seed), np.arange(9 * RATE) / RATE

    def step(at, over):
        u = np.clip((time - at) / over, 0, 1)
        return u**3 * (10 - 15 * u + 6 * u * u)

    deep = -2e-3 + 4.4e-3 * (step(1.0, 1.5) - step(7.0, 1.2))
    deep -= 0.6e-3 * sum(step(t, 0.3) - step(t + 0.6, 0.3) for t in (3.2, 4.6, 5.9))
    x = np.maximum(deep, 0.0)
    force = np.where(x > 0, np.maximum(K * x + B * np.gradient(x, 1 / RATE), 0.0), 0.0)
    pose = np.tile([-0.4, -0.13, 0.21, 3.1415, 0.0, 0.0], (len(time), 1))
    pose[:, 2] -= deep
    pose[:, :3] += rng.normal(0, 1e-6, (len(time), 3))
    wrench = rng.normal(0, 0.15, (len(time), 6))
    wrench[:, 2] += force
    names = [
        "timestamp",
        *(f"actual_TCP_pose_{i}" for i in range(6)),
        *(f"actual_TCP_force_{i}" for i in range(6)),
    ]
    np.savetxt(path, np.column_stack([time, pose, wrench]), header=" ".join(names), comments="", fmt="%.7g")
    return path


def test_a_log_of_a_ur_leads_to_its_preset_and_is_read_alone(tmp_path, capsys):
    path = ur_log(tmp_path / "robot_data.csv")
    proposal = list_log(path).proposal
    assert proposal.command(path) == f"palpate identify {path} --preset ur-rtde"
    assert not proposal.guesses
    assert "all 13 columns" in proposal.facts[0]
    assert "4.4 mm along z" in proposal.facts[0]
    found = palpate.identify_log(path)
    assert found.working_point.stiffness.value == pytest.approx(K, rel=0.02)
    assert (
        main(["identify", str(path), "--json"]) == 1
    )  # K is a lower bound: the arm's own compliance is in it
    own = json.loads(capsys.readouterr().out)
    assert own["parameters"] == json.loads(json.dumps(found.to_json()["parameters"]))


def franka_log(path, name="{}[{}]", unit=1e-3, start=5000.0):
    """The same press by a Franka: members of libfranka's RobotState, each column named as recorders do."""
    log = np.genfromtxt(ur_log(path), names=True)
    matrix = np.tile([1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], (len(log), 1))
    for i in range(3):
        matrix[:, 12 + i] = log[f"actual_TCP_pose_{i}"]
    names = ["time", *(name.format("O_T_EE", i) for i in range(16))]
    names += [name.format("O_F_ext_hat_K", i) for i in range(6)]
    wrench = [log[f"actual_TCP_force_{i}"] for i in range(6)]
    time = start + np.round(log["timestamp"] / unit, 6)
    np.savetxt(
        path, np.column_stack([time, matrix, *wrench]), header=" ".join(names), comments="", fmt="%.9g"
    )
    return path


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("{}[{}]", 1e-3, "--preset franka --time time:ms"),
        *(
            pytest.param(*one, marks=pytest.mark.long)
            for one in (
                ("state.{}[{}]", 1.0, "--preset franka --time time --wrench 'state.O_F_ext_hat_K[0],"),
                ("{}_{}", 1e-3, "--preset franka --time time:ms --wrench O_F_ext_hat_K_0,O_F_ext_hat_K_1"),
            )
        ),
    ],
)
def test_a_log_of_a_franka_leads_to_its_preset_and_is_read_alone(tmp_path, name, unit, words):
    path = franka_log(tmp_path / "press.csv", name, unit)
    proposal = list_log(path).proposal
    assert proposal.command(path).startswith(f"palpate identify {path} {words}")
    assert not proposal.guesses
    assert palpate.identify_log(path).working_point.stiffness.value == pytest.approx(K, rel=0.02)


def test_joints_without_a_pose_are_no_press_and_the_reason_names_the_columns_to_record(tmp_path):
    names = ["time", *(f"state.{part}[{i}]" for part in ("q", "tau_ext_hat_filtered") for i in range(7))]
    rows = np.random.default_rng(0).normal(size=(400, len(names)))
    rows[:, 0] = np.arange(400)
    np.savetxt(tmp_path / "log.csv", rows, header=",".join(names), comments="", delimiter=",")
    assert list_log(tmp_path / "log.csv").proposal.options is None
    with pytest.raises(InputError, match="record O_F_ext_hat_K and O_T_EE of RobotState"):
        palpate.identify(tmp_path / "log.csv")


@pytest.mark.parametrize(("steps", "proposed"), [(19, False), (20, True)])
def test_a_position_of_fewer_than_twenty_counts_is_never_proposed(tmp_path, steps, proposed):
    ramp = np.concatenate([np.arange(steps + 1), np.arange(steps, -1, -1)]).repeat(20)
    rows = [f"{0.002 * i:.3f},{0.01 * x:.2f},{3.0 * x:.1f}" for i, x in enumerate(ramp)]
    (tmp_path / "log.csv").write_text("\n".join(["time_s,position_mm,force_N", *rows]) + "\n")
    assert (list_log(tmp_path / "log.csv").proposal.options is not None) == proposed


@pytest.mark.long
def test_what_was_measured_can_be_pressed_though_its_damping_has_no_number(tmp_path, capsys, monkeypatch):
    """An unknown damping counts at the upper end of its interval, and the tuning says so."""
    monkeypatch.chdir(tmp_path)
    ur_log(tmp_path / "robot_data.csv")
    assert main(["identify", "robot_data.csv", "--json"]) == 1  # K is a lower bound
    printed = capsys.readouterr().out
    damping = json.loads(printed)["parameters"]["B"]
    assert damping["value"] is None
    low, high = damping["ci95"]
    assert low < B < high
    (tmp_path / "found.json").write_text(printed)
    assert (
        main(["tune", "found.json", "--arm", "ur5e", "--force", "15", "--out", "gains.toml", "--json"]) == 0
    )
    tuned = json.loads(capsys.readouterr().out)
    assert tuned["assumed"]["damping"]["value"] >= high
    cap = tuned["gains"]["stiffness_cap"]
    assert cap > K + high / tuned["theta_s"]
    words = ["press", "--arm", "ur5e", "--force", "15", "--gains", "gains.toml", "--seconds", "1", "--json"]
    assert main([*words, "--surface", f"K={K:g},B={B:g}", "--out", "pressed"]) == 0


def test_a_log_alone_is_what_the_command_reads(root, capsys):
    path = root / "examples/data/press.csv"
    named = palpate.identify_log(path, time="time_s", position="position_mm:mm", force="force_N:N")
    assert palpate.identify_log(path) == named
    record = palpate.read_log(path)
    assert set(record.columns) == {"time", "position", "force"}
    assert record.meta["facts"] == ["read as --time time_s --position position_mm:mm --force force_N:N"]
    assert main(["identify", str(path)]) == 0
    assert record.meta["facts"][0].capitalize()[:20] in capsys.readouterr().out


def save(path, **columns):
    table = np.column_stack([*columns.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.6g")
    return path


TIME = np.arange(2000) / 500
MOVED = 1e-3 * np.sin(2 * TIME)


def test_a_guess_is_refused_in_python_and_named_first_by_the_command(tmp_path, capsys):
    noise = np.random.default_rng(0).normal(
        scale=0.05, size=len(MOVED)
    )  # an exact line is one quantity twice
    path = save(tmp_path / "a.csv", t=TIME, x=MOVED, f=5e3 * MOVED + noise)
    with pytest.raises(InputError, match="no unit is given for 'x'") as refused:
        palpate.identify_log(path)
    command = f"palpate identify {path} --time t --position x:m --force f:N"
    assert str(refused.value).endswith(
        f"palpate.identify_log('{path}', time='t', position='x:m', force='f:N')"
    )
    with pytest.raises(InputError, match="no unit is given for 'x'"):
        palpate.read_log(path)
    assert main(["identify", str(path), "--figure", str(tmp_path / "a.png")]) == 1
    first, *others = capsys.readouterr().out.splitlines()
    assert first.startswith("! no unit is given for 'x'")
    assert first.endswith(f"If that is right: {command}")
    assert "? in doubt" in " ".join(others)
    assert main(["identify", str(path), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["guessed"]["command"] == command
    assert answer["parameters"]["K"]["verdict"] == "not identifiable"
    assert main([*command.split()[1:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["guessed"] is None


@pytest.mark.parametrize(
    ("position", "force"),
    [
        (0.001 * (np.arange(2000) % 10), 5e3 * MOVED),
        (1e3 * MOVED, np.random.default_rng(0).normal(size=2000)),
        (1e3 * MOVED, np.zeros(2000)),
    ],
    ids=["ten counts", "noise", "nothing"],
)
def test_two_columns_that_do_not_move_together_are_never_proposed(tmp_path, position, force):
    path = save(tmp_path / "a.csv", time_s=TIME, position_mm=position, force_N=force)
    assert list_log(path).proposal.options is None
    with pytest.raises(InputError, match="a position that moves and a force that follows it"):
        palpate.identify_log(path)


def test_an_unknown_option_is_named(root):
    with pytest.raises(InputError, match=r"unknown option 'positon'.*position"):
        palpate.identify_log(root / "examples/data/press.csv", positon="x:mm")
