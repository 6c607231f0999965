"""The sliding law: held forces, its floor, its guards, and what its filter says."""

from __future__ import annotations

import json

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.cli import main
from palpate.errors import InputError
from palpate.force import Gains, SlidingLoop, load_arm, load_gains
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding import slide_state as places
from palpate.force.sliding.paths import directions
from palpate.force.sliding.slide_domain import edge_speed, slide_domain, slide_terms, start_time
from palpate.force.sliding.slide_law import slide_from, stiffness_in
from palpate.force.sliding.tangent_filter import (
    COVARIANCE,
    STATES,
    Observation,
    begin,
    confine,
    correct,
    predict,
)
from palpate.slide.ground import ground_of
from palpate.slide.world import figures_of, simulate

DOWN = np.array([0.0, 0.0, -1.0])


def tuned(arm: str = "ur5e", force: float = 15.0, speed: float = 0.03, **others: float) -> Gains:
    gains = gains_for(load_arm(arm), force, cap=4e4)
    return replace(gains, slide=Slide(speed=speed, mu_max=0.9, **others))


@pytest.fixture(scope="module")
def loop() -> SlidingLoop:
    return SlidingLoop(tuned())


@pytest.fixture(scope="module", params=[0.0, 0.01])
def any_loop(request) -> SlidingLoop:
    """Without touches and with them."""
    return SlidingLoop(tuned(touches=request.param))


def in_a_slide(loop: SlidingLoop, normal: np.ndarray) -> None:
    """The loop in a slide with this normal and F_d held, as `press_tick` leaves it."""
    loop.reset()
    state = loop._state
    state[places.PHASE], state[places.BOUND], state[places.TICKS] = places.SLIDE, 2e4, 10.0
    slide_from(loop.law, state, places.Vec3(*normal), loop.desired, 2e4, 0.1, 0.12, 0.35, 0.3)


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
@pytest.mark.parametrize("shape", ["sphere", "bowl", "saddle"])
def test_a_force_is_held_along_surfaces_with_friction(arm: str, shape: str) -> None:
    gains, ground = tuned(arm), ground_of(shape, 0.12, 2e4, friction=0.4)
    ways = directions("circle", 3.0, gains.arm.rate, 0.03, 0.04)
    found = figures_of(simulate(gains, ground, ways, into=[0.1, 0.05, -1.0]), gains, ground)
    assert found.obeys
    assert found.worst < 1.15
    assert found.normal < np.radians(0.5)
    assert min(found.cone, found.friction) > 0.9


def test_no_normal_presses_harder_than_the_floor(loop: SlidingLoop) -> None:
    """At F_m = F_d, N <= F_d sqrt(1 + mu_max^2), right or wrong normal: beyond it the command withdraws."""
    rng, most = np.random.default_rng(1), loop.desired * np.sqrt(1.0 + loop.law.mu_max**2)
    for _ in range(300):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        in_a_slide(loop, n)
        true = n + rng.uniform(0.0, 0.5) * rng.normal(size=3)
        true /= np.linalg.norm(true)
        t = np.cross(true, rng.normal(size=3))
        f = 1.001 * most * (true + rng.uniform(0.0, 0.9) * t / np.linalg.norm(t))
        assert loop.update(f, np.zeros(3), np.zeros(3)) @ loop.normal <= 1e-12


def test_misalignment_and_friction_scale_the_gain_within_the_certificates_shares() -> None:
    """m = cos phi (cos phi -+ mu sin phi), at most (1 + sqrt(1 + mu^2))/2; the proof takes 0.05 to 2."""
    rng = np.random.default_rng(0)
    phi, mu = rng.uniform(-0.5 * np.pi, 0.5 * np.pi, 1_000_000), rng.uniform(0.0, 0.9, 1_000_000)
    m = np.cos(phi) * (np.cos(phi) - mu * np.sin(phi))
    assert (m <= 0.5 * (1.0 + np.sqrt(1.0 + mu**2)) + 1e-12).all()
    near = np.abs(phi) < np.radians(10.0)
    assert m[near].min() > 0.81
    assert m[near].max() < 1.13


def test_no_command_is_faster_than_the_approach_before_a_force_was_felt(any_loop: SlidingLoop) -> None:
    loop, rng = any_loop, np.random.default_rng(3)
    loop.reset()
    for k in range(3000):
        v = loop.update(rng.normal(0.0, 0.05, 3), k * 1e-5 * DOWN, rng.normal(size=3))
        assert np.linalg.norm(v) <= loop.gains.approach * (1.0 + 1e-12)


def test_hostile_streams_leave_only_finite_velocities_within_the_limit(any_loop: SlidingLoop) -> None:
    loop, rng = any_loop, np.random.default_rng(4)
    odd = [np.nan, np.inf, -np.inf, 0.0, 1e300, -1e300, 99.9, 1e-300]
    for start in range(20):
        loop.reset() if start % 2 else in_a_slide(loop, DOWN)
        if start % 4 == 1:
            loop._state[places.PHASE], loop._state[places.TOUCHES] = places.MOVE, 1.0 + start % 3
        for _ in range(300):
            f, p, d = (rng.normal(0.0, size, 3) for size in (20.0, 1e-3, 1.0))
            for v in (f, p, d):
                if rng.random() < 0.2:
                    v[rng.integers(3)] = odd[rng.integers(len(odd))]
            out = loop.update(f, p, d, float(rng.choice([0.0, 1.0, 50.0, np.nan])))
            assert np.isfinite(out).all()
            assert np.linalg.norm(out) <= loop.gains.arm.limits.speed * (1.0 + 1e-12)
            assert np.isfinite(loop.normal).all()
            assert abs(np.linalg.norm(loop.normal) - 1.0) < 1e-9


@pytest.mark.parametrize("height", [1e-3, -1e-3])
def test_a_step_halts_the_slide_and_leaves_stiffness_and_normal(height: float) -> None:
    gains = tuned(speed=0.05, slope=0.04, step=1e-3)
    ground = ground_of("step", 0.2, 2e4, friction=0.3, height=height, period=0.03)
    ways = directions("line", 8.0, gains.arm.rate, 0.05, 0.1)
    rows = simulate(gains, ground, ways)
    found = figures_of(rows, gains, ground)
    codes, speed = rows[:, 14], rows[:, 15]
    halted = (codes == places.STEPPED) | (codes == places.REFUTED)
    assert halted.any()
    assert speed[halted].max() < 1e-12
    assert found.said
    assert found.worst < 1.5
    assert not found.lost
    assert found.stiffness > 0.95
    assert rows[-100:, 7].max() < np.radians(1.0)
    assert abs(rows[-100:, 0] / gains.force - 1.0).max() < 0.05


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
@pytest.mark.parametrize("shape", ["plane", "bowl", "eggs"])
def test_three_touches_measure_the_normal_before_the_slide(arm: str, shape: str) -> None:
    gains = tuned(arm, touches=0.01)
    ground = ground_of(shape, 0.12, 1e4, friction=0.5)
    rows = simulate(
        gains, ground, directions("circle", 1.0, gains.arm.rate, 0.03, 0.04), into=[0.3, 0.2, -1.0]
    )
    first = int(np.flatnonzero(rows[:, 13])[0])
    assert rows[first, 7] < 3.0 * rows[first, 8]
    assert rows[first, 8] < np.radians(0.7)
    assert rows[:, 0].max() < 1.1 * gains.force
    touches = np.flatnonzero((rows[1:first, 0] > 0.0) & (rows[: first - 1, 0] == 0.0))
    assert len(touches) == 4
    assert rows[:first, 0].max() < 1.1 * gains.force
    assert rows[: touches[3], 0].max() < 0.5 * gains.force
    assert 0.3 < (first - touches[0]) * gains.arm.tick / start_time(gains) < 1.0
    lateral = np.linalg.norm(np.diff(rows[:first, 1:4], axis=0), axis=1) / gains.arm.tick
    assert lateral.max() > 2.0 * gains.approach


def test_a_sensor_that_is_not_tared_holds_the_tip_between_touches() -> None:
    loop = SlidingLoop(tuned(touches=0.01))
    state = loop._state
    state[places.PHASE], state[places.TOUCHES], state[places.TICKS] = places.MOVE, 1.0, 10.0
    tip = np.array([0.0, 0.0, 0.1])
    v = loop.update([0.3, 0.1, -9.0], tip, [1.0, 0.0, 0.0])
    assert loop.trouble.startswith("the sensor shows a force")
    assert not v.any()


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
def test_a_step_that_is_not_expected_costs_half_the_force_at_the_speed_that_is_printed(arm: str) -> None:
    gains = tuned(arm)
    gains = replace(gains, slide=Slide(speed=edge_speed(gains, 2e4), mu_max=0.9, slope=0.04))
    ground = ground_of("step", 0.2, 2e4, friction=0.1, height=1e-3, period=0.01)
    ways = directions("line", 2.5, gains.arm.rate, gains.slide.speed, 0.1)
    found = figures_of(simulate(gains, ground, ways), gains, ground)
    assert 1.1 < found.worst < 1.5
    assert found.said


def test_a_slide_without_friction_is_held_on_a_soft_surface() -> None:
    """Taken for a contact that sticks, it turned the normal by 40 degrees and pressed with 1.45 F again and again."""
    gains, ground = tuned("fr3", 22.0, 0.02), ground_of("cylinder", 0.2, 1.3e3, friction=0.0)
    ways = directions("circle", 2.0, gains.arm.rate, 0.02, 0.07)
    for seed in range(8):
        angle = 0.785 * seed
        into = [0.2 * np.cos(angle), 0.2 * np.sin(angle), -1.0]
        assert figures_of(simulate(gains, ground, ways, into=into, seed=seed), gains, ground).worst < 1.15


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
def test_friction_above_the_bound_is_said_and_costs_a_quarter_of_the_force(arm: str) -> None:
    """A refuted normal that was taken from the force, off by all of the friction, pressed with 1.7 F."""
    gains, ground = tuned(arm, slope=0.04), ground_of("waves", 0.2, 2e4, friction=1.05)
    rows = simulate(gains, ground, directions("back", 3.0, gains.arm.rate, 0.03, 0.03))
    refuted = np.flatnonzero(rows[:, 14] == places.REFUTED)
    assert len(refuted)
    assert rows[:, 0].max() < 1.25 * gains.force
    assert rows[refuted, 7].max() < np.radians(20.0) < np.arctan(1.15)


def test_a_confined_state_moves_the_others_as_their_covariance_says() -> None:
    s = np.zeros(COVARIANCE + STATES * STATES + 1)
    begin(s, 15.0, 0.1, 10.0, 5e3, 0.1, 0.35, 0.3, 0.1)
    s[7], s[8] = -0.2, 0.1
    P = s[COVARIANCE : COVARIANCE + STATES**2].reshape(STATES, STATES)
    P[7, 8] = P[8, 7] = 0.5 * P[7, 7]
    confine(s, 7, 0.0, 0.9)
    assert s[7] == pytest.approx(0.0, abs=1e-15)
    assert s[8] == pytest.approx(0.2)
    assert s[0] == 15.0


def test_a_press_without_an_estimate_leaves_stiffness_uncertain(loop: SlidingLoop) -> None:
    """Taken for a surface of 4 N/m, known to 1 %, the slide turned the normal by 25 degrees."""
    press = loop.law.press.start()
    press = press._replace(bound=press.bound._replace(used=2e4))
    assert stiffness_in(loop.law.press, press) == pytest.approx((1e4, 5.8e3))


def test_a_held_force_says_nothing_of_stiffness() -> None:
    """An extended filter in (K, g, H) came to 0.78 K on this plane after 8 s."""
    gains, ground = tuned(speed=0.05, slope=0.04), ground_of("plane", 0.2, 1.5e4, friction=0.3)
    rows = simulate(gains, ground, directions("circle", 8.0, gains.arm.rate, 0.05, 0.07))
    assert rows[-1, 11] == pytest.approx(gains.arm.seen(1.5e4), rel=0.05)
    assert figures_of(rows, gains, ground).stiffness > 0.95


@pytest.mark.parametrize(
    ("force", "direction", "said"),
    [
        ([np.nan, 0.0, -15.0], [1.0, 0.0, 0.0], "no number"),
        ([0.0, 0.0, -15.0], [0.0, 0.0, 1.0], "along the normal"),
        ([0.0, 0.0, -15.0], [np.nan, 0.0, 0.0], "direction is no number"),
        ([-30.0, 0.0, -15.0], [1.0, 0.0, 0.0], "friction cone"),
        ([0.0, 0.0, -99.5], [1.0, 0.0, 0.0], "end of its scale"),
        ([1.0, 0.0, -40.0], [1.0, 0.0, 0.0], "jumped"),
    ],
)
def test_each_fault_is_said(loop: SlidingLoop, force: list[float], direction: list[float], said: str) -> None:
    in_a_slide(loop, DOWN)
    loop.update([0.0, 0.0, -15.0], np.zeros(3), np.zeros(3))
    v = loop.update(force, np.zeros(3), direction)
    assert said in loop.trouble
    assert np.linalg.norm(v - (v @ loop.normal) * loop.normal) < 1e-3


def test_the_filter_agrees_with_its_model_by_finite_differences() -> None:
    """The covariance after a motion is F P F^T, F the derivative of the predicted state, beside the process noise."""
    rng, base = np.random.default_rng(5), np.zeros(COVARIANCE + STATES * STATES + 1)
    begin(base, 15.0, 0.1, 10.0, 5e3, 0.2, 0.4, 0.2, 0.1)
    base[:STATES] += [0.0, 0.02, -0.03, 4.0, 1.0, -3.0, 0.1, 0.05, 0.1, -0.05]
    root = rng.normal(0.0, 0.1, (STATES, STATES))
    P = root @ root.T
    motion = (1e-4, -2e-4, 3e-5)

    def after(x: np.ndarray, P: np.ndarray) -> np.ndarray:
        s = base.copy()
        s[:STATES], s[COVARIANCE : COVARIANCE + STATES**2] = x, P.ravel()
        predict(s, *motion, 0.85, 0.0, 0.0)
        return s

    x0 = base[:STATES]
    step = 1e-6 * np.maximum(np.abs(x0), 1.0)
    up, down = (
        np.array([after(x0 + sign * np.diag(step)[i], P)[:STATES] for i in range(STATES)]) for sign in (1, -1)
    )
    F = ((up - down) / (2.0 * step[:, None])).T
    F[8:, :7] = 0.0  # the length of friction's relaxation is taken as known but for mu
    noise = after(x0, np.zeros((STATES, STATES)))[COVARIANCE : COVARIANCE + STATES**2].reshape(STATES, STATES)
    got = after(x0, P)[COVARIANCE : COVARIANCE + STATES**2].reshape(STATES, STATES) - noise
    assert got == pytest.approx(F @ P @ F.T, rel=1e-5, abs=1e-6 * np.abs(F @ P @ F.T).max())


def test_a_contact_that_sticks_tells_nothing_of_friction() -> None:
    s, work = np.zeros(COVARIANCE + STATES * STATES + 1), np.zeros(STATES)
    begin(s, 15.0, 0.1, 10.0, 5e3, 0.1, 0.35, 0.3, 0.1)
    before = s[COVARIANCE + 7 * (STATES + 1)]
    correct(s, Observation(1, 1.0, 8, 1.0, 9, 0.0), 0.0, 4e-5, 1e9, work)
    for _ in range(10):  # 0.1 mm, a fortieth of the way on which it sticks
        predict(s, 1e-5, 0.0, 0.0, 0.85, 1e3, 0.0)
        correct(s, Observation(1, 1.0, 8, 1.0, 9, 0.0), 0.0, 4e-5, 1e9, work)
    assert s[COVARIANCE + 7 * (STATES + 1)] > 0.9 * before


def test_a_slide_is_in_the_file_and_in_no_digest(tmp_path) -> None:
    gains, path = tuned(), tmp_path / "gains.toml"
    path.write_text(gains.to_toml())
    assert load_gains(path) == gains
    assert replace(gains, slide=None).digest == gains.digest
    with pytest.raises(InputError, match="--slide"):
        SlidingLoop(replace(gains, slide=None))
    with pytest.raises(InputError, match="not all 0"):
        SlidingLoop.load(path, into=(0.0, 0.0, 0.0))


def test_the_domain_shrinks_with_speed_and_ends_where_its_terms_say() -> None:
    slow, fast = slide_domain(tuned(speed=0.02, slope=0.05)), slide_domain(tuned(speed=0.1, slope=0.05))
    assert slow is not None
    assert fast is None or fast[1] <= slow[1]
    terms = slide_terms(tuned(speed=0.02), 2e4, 0.5, 0.1)
    assert terms["sticking"] == pytest.approx(0.5 * 15.0 / (0.85 * load_arm("ur5e").seen(2e4) * 0.1))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (["--mu-max", "0"], "--mu-max"),
        (["--speed", "0"], "--speed"),
        (["--speed", "9"], "0.25 m/s"),
        (["--radius", "-1"], "--radius"),
        (["--tilt", "60"], "--tilt"),
        (["--step", "-1"], "--step"),
        (["--touches", "1"], "--touches"),
    ],
)
def test_wrong_numbers_of_a_slide_are_one_line(wrong: list[str], said: str, capsys, tmp_path) -> None:
    out = tmp_path / "gains.toml"
    words = f"tune --stiffness 1e3:4e4 --arm ur5e --force 15 --slide --out {out}".split() + wrong
    assert main(words) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not out.exists()


def test_the_command_writes_its_answer(tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = f"slide --seconds 1 --normal 0.2,0.1,-1 --step 1:mm --out {out} --json".split()
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["end"] == "held"
    assert answer["stiffness"]["ci95"][0] < answer["truth"]["stiffness"] < answer["stiffness"]["ci95"][1]
    assert {p.name for p in out.iterdir()} >= {"record.parquet", "summary.json", "slide.png", "report.html"}
