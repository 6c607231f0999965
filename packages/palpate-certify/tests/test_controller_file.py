"""Force controllers of others: edges by formulas, what is proved, corrected files, and files that are refused."""

from __future__ import annotations

from math import atan, cos, pi, sin, sqrt

import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate_certify.controller_file import certify_controller
from palpate_certify.delayed_contact import DelayedContact

ADMITTANCE = """\
test_admittance_controller:
  ros__parameters:
    admittance:
      selected_axes: [true, true, true, true, true, true]
      mass: [5.5, 6.6, 7.7, 8.8, 9.9, 10.10]
      damping_ratio: # D / (2 * sqrt( M * S ))
        - 2.828427 # x
        - 2.828427
        - 2.828427
        - 2.828427
        - 2.828427
        - 2.828427
      stiffness: [214.1, 214.2, 214.3, 214.4, 214.5, 214.6]
"""
FZI = """\
controller_manager: {ros__parameters: {update_rate: 500}}
force:
  ros__parameters:
    command_interfaces: [velocity]
    solver: {error_scale: 0.5}
    pd_gains: {trans_x: {p: 0.5}, trans_y: {p: 0.4, d: 0.01}}
"""
CRISP = "a: {ros__parameters: {task: {k_pos_x: 500.0, d_pos_x: 60.0}}}\n"


def certify(folder, text, *words, **numbers):
    path = folder / "a.yaml"
    path.write_text(text)
    return certify_controller(path, *words, **numbers)[:2]


@pytest.mark.parametrize(("delay", "edge"), [(0.010, 20.5e3), (0.024, 9.1e3), (0.036, 6.3e3)])
def test_the_settings_of_the_makers_own_test_are_caught(tmp_path, delay, edge):
    told, _ = certify(tmp_path, ADMITTANCE, "ros2-admittance", delay)
    assert told["first_unstable"]["stiffness"] == pytest.approx(edge, rel=0.005)
    assert told["first_unstable"]["axis"] == "test_admittance_controller.x"
    assert told["proved"]["stiffness"][1] == pytest.approx(0.99 * told["exact"]["stiffness"][1])


def test_corrected_numbers_are_stable_and_the_file_keeps_its_comments(tmp_path):
    told, text = certify(tmp_path, ADMITTANCE, "ros2-admittance", 0.036, stiffest=2e4)
    assert told["corrected"]["changed"] == [f"test_admittance_controller.{axis}" for axis in "xyz"]
    assert "# D / (2 * sqrt( M * S ))" in text
    assert text.count("- 2.828427") == 3  # of the turning axes
    again, same = certify(tmp_path, text, "ros2-admittance", 0.036, stiffest=2e4)
    assert again["proved"]["stiffness"][1] > 2e4
    assert again["corrected"]["changed"] == []
    assert same == text


def test_an_integrator_with_a_delay_ends_at_half_of_pi(tmp_path):
    told, _ = certify(tmp_path, FZI.replace(", trans_y: {p: 0.4, d: 0.01}", ""), "fzi", 0.02)
    assert told["exact"]["stiffness"][1] == pytest.approx(pi / 2 / (0.01 * 0.5 * 0.5 * 0.02), rel=1e-9)
    told, text = certify(tmp_path, FZI, "fzi", 0.02)
    assert told["corrected"]["exact"][1] > 5e4
    assert "trans_y: {p: 0.08" not in text or told["corrected"]["changed"]


def test_an_impedance_ends_where_its_delayed_torque_pushes_with_the_motion(tmp_path):
    """-k sin wT + d w cos wT = 0, and m w^2 = K + k cos wT + d w sin wT there."""
    k, d, m, T = 500.0, 60.0, 3.0, 0.002
    told, _ = certify(tmp_path, CRISP, "crisp", T, m)
    w = pi / 2 / T
    for _ in range(50):
        w = atan(d * w / k) / T
    K = m * w**2 - k * cos(w * T) - d * w * sin(w * T)
    assert told["exact"]["stiffness"][1] == pytest.approx(K, rel=1e-9)
    told, _ = certify(tmp_path, CRISP.replace("60.0", "1.0"), "crisp", 0.01, 3.0)
    assert told["proved"]["stiffness"] is None  # its damping leads by d/k = 2 ms, less than the delay
    assert told["exact"]["stiffness"] == [0.0, 0.0]


@pytest.mark.parametrize("time", [0.002, 0.01])
def test_a_damped_surface_leads_until_its_damping_alone_is_too_much(time):
    """v = g e and K + B s behind a delay: wT - atan(w time) = pi/2, and never beyond K B = 1/g."""
    T, g = 0.02, 1e-3
    loop = DelayedContact(T, (0.0, 1.0), late_surface=(g,)).on_damped(time)
    w = pi / 2 / T
    for _ in range(200):
        w = (pi / 2 + atan(w * time)) / T
    edge = min(w / g / sqrt(1.0 + (w * time) ** 2), 1.0 / g / time)
    assert loop.first_unstable() == pytest.approx(edge, rel=1e-6)
    assert loop.proves(1e-4 * edge, 0.99 * edge)


def test_what_is_not_stable_is_not_proved():
    loop = DelayedContact(0.02, (200.0, 200.0, 5.0), late_surface=(1.0,))
    edge = loop.first_unstable()
    assert loop.proves(1e-4 * edge, 0.999 * edge)
    assert not loop.proves(1e-4 * edge, 1.001 * edge)
    assert not loop.proves(1.001 * edge, 1.5 * edge)


@pytest.mark.parametrize(
    ("text", "controller", "says"),
    [
        (ADMITTANCE, "ur", "not published"),
        (ADMITTANCE, "fzi", "no settings of fzi"),
        (ADMITTANCE, "other", "unknown controller"),
        (ADMITTANCE.replace("5.5", "-5.5"), "ros2-admittance", "mass: 0 must be a number"),
        (ADMITTANCE.replace("5.5", "true"), "ros2-admittance", "must be a number"),
        (
            ADMITTANCE.replace("[214.1, 214.2, 214.3, 214.4, 214.5, 214.6]", "[]"),
            "ros2-admittance",
            "is missing",
        ),
        (FZI.replace("velocity", "position"), "fzi", "servo"),
        (FZI.replace("update_rate: 500", ""), "fzi", "update_rate is missing"),
        (CRISP, "crisp", "--mass"),
        ("a: [1", "crisp", "no YAML"),
        ("- 1", "crisp", "no parameter file"),
        ("", "crisp", "no parameter file"),
        ("a: &a [*a]", "crisp", "no settings"),
    ],
)
def test_files_that_say_too_little_are_refused_in_one_line(tmp_path, text, controller, says):
    with pytest.raises(InputError, match=says) as error:
        certify(tmp_path, text, controller, 0.02)
    assert "\n" not in str(error.value)


def test_as_a_user_types_it(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text(ADMITTANCE)
    words = [
        "certify",
        "a.yaml",
        "--controller",
        "ros2-admittance",
        "--delay",
        "36:ms",
        "--stiffness",
        "100:2e4",
    ]
    assert main([*words, "--out", "b.yaml"]) == 1
    assert "Unstable from 6306 N/m (test_admittance_controller.x)" in capsys.readouterr().out
    assert main([words[0], "b.yaml", *words[2:], "--json"]) == 0
    assert '"first_unstable"' in capsys.readouterr().out
    assert main(["certify", "a.yaml", "--controller", "ros2-admittance"]) == 2
    assert "--delay" in capsys.readouterr().err
    assert main([*words, "--damping-time", "0:0.01", "--report", "page.html"]) == 1
    assert "written: page.html" in capsys.readouterr().out
    page = (tmp_path / "page.html").read_text()
    assert (
        page.index("Unstable from 6306 N/m") < page.index("Where it is stable") < page.index("damping_ratio:")
    )
    assert "B/K of 0 to 10 ms, in 9 steps" in page
    assert main(["certify", "a.yaml", "--report", "other.html"]) == 2
    assert "--report is of --controller" in capsys.readouterr().err
