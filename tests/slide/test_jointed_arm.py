"""Slides of arms with joints, which MuJoCo or palpate's own laws move."""

from __future__ import annotations

import json

import numpy as np
import pytest
from msgspec.structs import replace

from palpate._vector import Vec3
from palpate.cli import main
from palpate.errors import InputError
from palpate.force import Gains
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.slide.ground import ground_of
from palpate.slide.jointed_arm import HeldTip, JointedArm, jointed_arm
from palpate.slide.world import COLUMNS, GAP, SlideFigures, figures_of

pytest.importorskip("mujoco", reason="the extra `arms` is not installed")


@pytest.fixture(scope="module")
def fr3() -> JointedArm:
    return jointed_arm("fr3")


def tuned(arm: JointedArm) -> Gains:
    return replace(gains_for(arm.inner, 15.0, cap=4e4), slide=Slide(speed=0.03, mu_max=0.9, slope=0.04))


@pytest.mark.long
def test_the_force_is_held_by_an_arm_with_joints(fr3: JointedArm) -> None:
    gains, ground = tuned(fr3), ground_of("bowl", 0.12, 2e4, friction=0.4)
    ways = directions("circle", 1.5, gains.arm.rate, 0.03, 0.04)
    rows = fr3.slide(gains, ground, ways, into=[0.05, 0.05, -1.0])
    found = figures_of(rows, gains, ground)
    assert found.obeys
    assert found.worst < 1.15
    assert found.normal < np.radians(0.5)
    assert min(found.cone, found.friction, found.stiffness) > 0.9
    assert rows[0, 3] == pytest.approx(GAP, abs=1e-4)
    on = rows[rows[:, 13] == 1.0]
    assert np.hypot(on[:, 1], on[:, 2]).max() > 0.02  # it went along the bowl,
    height = on[:, 3] - (0.12 - np.sqrt(0.12**2 - on[:, 1] ** 2 - on[:, 2] ** 2))
    assert np.abs(height + gains.force / 2e4).max() < 2e-4  # as deep in it as the force asks for


@pytest.mark.long
def test_the_force_on_the_joints_is_that_of_the_contact(fr3: JointedArm) -> None:
    """Without friction and with a held force the arm's own spring carries F_d: the tip lags its goal by F_d / K."""
    gains, ground = tuned(fr3), ground_of("plane", 0.2, 2e4)
    rows = fr3.slide(gains, ground, directions("line", 0.5, gains.arm.rate, 0.03, 0.1))
    assert rows[-1, 3] == pytest.approx(-gains.force / 2e4, rel=0.02)
    assert rows[-200:, 16:18] == pytest.approx(0.0, abs=6.0 * gains.arm.sensor.noise)
    assert rows[-200:, 18].mean() == pytest.approx(-gains.force, rel=0.01)


def test_a_joint_at_the_end_of_its_range_is_one_line(fr3: JointedArm) -> None:
    short = replace_upper(fr3)
    with pytest.raises(InputError, match=r"reached the end of its range at .* make --length smaller"):
        short.slide(tuned(fr3), ground_of("plane", 0.2, 2e4), directions("line", 0.5, 1000.0, 0.03, 0.1))


def replace_upper(arm: JointedArm) -> JointedArm:
    from dataclasses import replace as changed

    return changed(arm, arm=changed(arm.arm, upper=arm.arm.home + 1e-4))


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--arm", "gains.toml"], "whose joints are known"), (["--physics", "bullet"], "physics")],
)
def test_wrong_words_are_one_line(words: list[str], said: str, tmp_path, capsys) -> None:
    assert main(["slide", "--physics", "mujoco", "--out", str(tmp_path / "out"), *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


@pytest.mark.long
@pytest.mark.parametrize("name", ["ur5e", "fr3"])
def test_a_tool_is_kept_perpendicular_by_palpates_own_physics(name: str) -> None:
    """With its payload's weight the force is held as before, and the tool follows a normal that turns by 30 degrees."""
    arm = jointed_arm(name)
    gains, ground = tuned(arm), ground_of("bowl", 0.12, 2e4, friction=0.4)
    ways = directions("circle", 4.0, gains.arm.rate, 0.03, 0.03)
    weight = Vec3(0.0, 0.0, 12.0)

    def slid(tool: HeldTip | None) -> tuple[SlideFigures, float]:
        rows = arm.slide(gains, ground, ways, into=[0.05, 0.05, -1.0], physics="own", tool=tool)
        late = rows[-round(2.0 * gains.arm.rate) :, COLUMNS.index("tool")]
        return figures_of(rows, gains, ground), float(np.degrees(late.max()))

    fixed, stood = slid(None)
    turned, angle = slid(HeldTip(0.02, weight))
    assert stood > 20.0
    assert angle < 6.0
    assert turned.obeys
    assert turned.rms < fixed.rms + 0.005


@pytest.mark.long
def test_the_command_says_how_far_the_tool_was_off(tmp_path, capsys) -> None:
    quick = [
        "--seconds",
        "1",
        "--touches",
        "0:mm",
        "--tilt",
        "3",
        "--shape",
        "bowl:150:mm",
        "--turn",
        "20:mm",
    ]
    assert main(["slide", *quick, "--out", str(tmp_path / "out")]) == 0
    assert "of the normal for 95 % of the time" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert 0.0 < summary["tool"]["median_angle_deg"] <= summary["tool"]["angle95_deg"] < 20.0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "of the normal for 95 % of the time" in page
    assert "flat tool's moment is not covered" in page.replace("&#39;", "'")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--turn", "-3:mm"], "--turn must be from 0 to 500 mm"),
        (["--turn", "nan:mm"], "--turn"),
        (["--turn", "20"], "--turn"),
        (["--turn", "20:mm", "--dither", "0.1"], "an arm without joints"),
        (["--payload", "tool.toml"], "add --turn"),
        (["--turn", "20:mm", "--payload", "missing.toml"], "missing.toml"),
        (["--turn", "20:mm", "--arm", "arm.toml"], "arm.toml"),
    ],
)
def test_a_turning_that_is_none_is_one_line(words: list[str], said: str, tmp_path, capsys) -> None:
    assert main(["slide", "--out", str(tmp_path / "out"), *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
