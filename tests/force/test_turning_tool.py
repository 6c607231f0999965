"""A tool kept perpendicular while it slides: its turning, the centre of its tip, its weight."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.errors import InputError
from palpate.force import SlidingLoop, load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding import slide_state as places
from palpate.force.sliding.slide_law import slide_from
from palpate.force.sliding.turning_tool import MAX_RATE, TurningTool

RADIUS, STIFFNESS, TICK = 0.15, 5e3, 0.002
CENTRE = np.array([0.0, 0.0, -0.02])
WEIGHT = np.array([0.0, 0.0, -12.0])
DOWN = np.diag([1.0, -1.0, -1.0])


def turned(R: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The rotation after a tick of turning."""
    angle = float(np.linalg.norm(w)) * TICK
    k = w / max(float(np.linalg.norm(w)), 1e-12)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return (np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross) @ R


def wiped(centre=CENTRE, weight=WEIGHT, ticks=5000) -> tuple[float, float]:
    """Rms of the force error [share], and the tool's last angle to the normal [rad], in a bowl without friction."""
    gains = replace(
        gains_for(load_arm("ur5e"), 10.0, cap=2e4), slide=Slide(speed=0.03, mu_max=0.9, slope=0.05)
    )
    tool = TurningTool(SlidingLoop(gains), centre=centre, weight=weight, tared=DOWN)
    rng, R, middle = np.random.default_rng(0), DOWN, np.array([0.0, 0.0, RADIUS])
    command = np.array([0.0, 0.0, 0.003]) - R @ CENTRE
    tip, forces = command.copy(), []
    for k in range(ticks):
        away = tip + R @ CENTRE - middle
        depth = max(float(np.linalg.norm(away)) - RADIUS, 0.0)
        n = away / np.linalg.norm(away)
        reading = STIFFNESS * depth * n + WEIGHT - R @ DOWN.T @ WEIGHT + rng.normal(0.0, 0.1, 3)
        way = [np.cos(0.4 * k * TICK), np.sin(0.4 * k * TICK), 0.0]
        twist = tool.update(reading, tip, R, way)
        command = command + TICK * twist[:3]
        tip, R = tip + TICK / 0.04 * (command - tip), turned(R, twist[3:])
        if tool.loop.sliding:
            forces.append(STIFFNESS * depth)
    error = np.array(forces[250:]) / 10.0 - 1.0
    return float(np.sqrt(np.mean(error**2))), float(np.arccos(np.clip(R[:, 2] @ n, -1.0, 1.0)))


@pytest.mark.long
def test_a_tool_turns_into_the_normal_while_the_force_is_held() -> None:
    rms, angle = wiped()
    assert rms < 0.01
    assert angle < np.radians(3.0)


@pytest.mark.long
def test_a_weight_that_is_not_taken_off_is_a_force() -> None:
    assert wiped(weight=np.zeros(3))[0] > 2.0 * wiped()[0]


def test_turning_is_about_the_centre_of_the_tip() -> None:
    gains = replace(gains_for(load_arm("ur5e"), 10.0, cap=2e4), slide=Slide(speed=0.03, mu_max=0.9))
    turning, fixed = TurningTool(SlidingLoop(gains), centre=CENTRE), SlidingLoop(gains)
    R = turned(DOWN, np.array([40.0, 25.0, 0.0]))
    for loop in (turning.loop, fixed):
        state = loop.state
        state[places.PHASE], state[places.BOUND], state[places.TICKS] = places.SLIDE, 2e4, 10.0
        slide_from(loop.law, state, places.Vec3(0.0, 0.0, -1.0), 10.0, 2e4, 0.1, 0.12, 0.35, 0.3)
    for k in range(20):
        tip = np.array([1e-5 * k, 0.0, 0.0])
        twist = turning.update([0.0, 0.0, -10.0], tip - R @ CENTRE, R, [1.0, 0.0, 0.0])
        v = fixed.update([0.0, 0.0, -10.0], tip, [1.0, 0.0, 0.0])
    assert np.linalg.norm(twist[3:]) > 0.05
    assert twist[:3] + np.cross(twist[3:], R @ CENTRE) == pytest.approx(v, abs=1e-12)
    assert twist[3:] @ np.cross(R[:, 2], turning.loop.normal) > 0.0


def test_neither_turning_nor_the_tools_point_passes_its_limit() -> None:
    """On tools long and short, readings and rotations at random, a limit lowered on the way."""
    gains, rng = (
        replace(gains_for(load_arm("ur5e"), 10.0, cap=2e4), slide=Slide(speed=0.03, mu_max=0.9)),
        np.random.default_rng(1),
    )
    fastest = 0.0
    for back in (0.0, 0.02, 0.5):
        tool = TurningTool(SlidingLoop(gains), centre=(0.0, 0.0, -back))
        state = tool.loop.state
        for most in (gains.arm.limits.speed, 0.05):
            tool.loop.limit_speed(most)
            state[places.PHASE], state[places.BOUND], state[places.TICKS] = places.SLIDE, 2e4, 10.0
            slide_from(tool.loop.law, state, places.Vec3(0.0, 0.0, -1.0), 10.0, 2e4, 0.1, 0.12, 0.35, 0.3)
            for k in range(200):
                R = turned(DOWN, np.array([400.0, 0.0, 0.0]) + rng.normal(0.0, 30.0, 3))
                way = np.array([1e-5 * k, 0.0, 0.0]) - R @ np.array([0.0, 0.0, -back])
                twist = tool.update(
                    np.array([0.0, 0.0, -10.0]) + rng.normal(0.0, 0.02, 3), way, R, rng.normal(size=3)
                )
                assert np.linalg.norm(twist[:3]) <= most * (1.0 + 1e-9)
                assert np.linalg.norm(twist[3:]) <= MAX_RATE * (1.0 + 1e-9)
                tip = twist[:3] + np.cross(twist[3:], R @ np.array([0.0, 0.0, -back]))
                assert np.linalg.norm(tip) <= most * (1.0 + 1e-9)
                fastest = max(fastest, float(np.linalg.norm(twist[3:])))
    assert fastest > 0.9 * MAX_RATE


def test_a_tool_whose_loop_missed_ticks_stops_turning() -> None:
    gains = replace(gains_for(load_arm("ur5e"), 10.0, cap=2e4), slide=Slide(speed=0.03, mu_max=0.9))
    tool, R = TurningTool(SlidingLoop(gains)), turned(DOWN, np.array([40.0, 25.0, 0.0]))
    state = tool.loop.state
    state[places.PHASE], state[places.BOUND], state[places.TICKS] = places.SLIDE, 2e4, 10.0
    slide_from(tool.loop.law, state, places.Vec3(0.0, 0.0, -1.0), 10.0, 2e4, 0.1, 0.12, 0.35, 0.3)
    reading = (np.array([0.0, 0.0, -10.0]), np.zeros(3), R, np.array([1.0, 0.0, 0.0]))
    assert tool.update(*reading)[3:].any()
    assert not tool.update(*reading, missed=1e3)[3:].any()
    assert "missed" in tool.loop.trouble


def test_a_tool_that_is_none_is_refused() -> None:
    loop = SlidingLoop(
        replace(gains_for(load_arm("ur5e"), 10.0, cap=2e4), slide=Slide(speed=0.03, mu_max=0.9))
    )
    with pytest.raises(InputError, match="length"):
        TurningTool(loop, axis=(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"shape \(3,\)"):
        TurningTool(loop, centre=(0.0, 0.02))
    with pytest.raises(InputError, match="perpendicular"):
        TurningTool(loop).update(np.zeros(3), np.zeros(3), np.ones((3, 3)), np.zeros(3))
    assert not TurningTool(loop).update(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3))[3:].any()
