"""A servo that yields: its model, its lead, what is proved, and a press."""

from __future__ import annotations

import json

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace
from scipy.integrate import solve_ivp

from force.gained import servo_gains
from palpate.certify.force_certificate import RefusedError, check
from palpate.errors import InputError
from palpate.force.arm import load_arm
from palpate.force.boundary import radius
from palpate.force.certificate import FORM, Certificate
from palpate.force.certifying import certify, proved_claim
from palpate.force.claims import adapting_claims
from palpate.force.gains import gains_for
from palpate.force.guard import Guarded
from palpate.force.inner_loop import identify_inner_loop
from palpate.force.known_surface import Known
from palpate.force.law import lead_speed
from palpate.force.sampled_loop import SampledLoop, law_for
from palpate.force.simulated_press import pressed, surface, world_of
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.slide.ground import ground_of
from palpate.slide.world import figures_of, simulate


@pytest.fixture(scope="module")
def gains():
    return servo_gains()


def test_a_tick_is_what_the_differential_equation_makes_of_it(gains):
    loop, inner, K, B = SampledLoop(gains.arm), gains.arm.inner, 8e3, 90.0
    law = law_for(gains.arm, 1e-4, K)
    z = np.random.default_rng(0).normal(size=loop.size)
    w, first = loop.rate_unit, loop.state.index("c0")
    held = z[first + loop.delay - 1]

    def motion(t, y):
        pull = inner.stiffness * (held - y[0]) - inner.damping * y[1] - K * y[0] - B * y[1]
        return [y[1], pull / inner.mass]

    after = loop.phi(K, B, law) @ z
    flow = solve_ivp(motion, (0.0, gains.arm.tick), [z[0], w * z[1]], rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose([after[0], w * after[1]], flow, rtol=1e-8)


def test_the_matrix_and_the_law_have_the_same_lead(gains):
    loop, numbers, K = SampledLoop(gains.arm), gains.cautious(), 3e3
    Phi = loop.phi(K, 0.0, law_for(gains.arm, 1e-4, K))
    z = np.random.default_rng(1).normal(size=loop.size) * 1e-3
    pace, command = loop.state.index("u"), loop.state.index("c0")
    speed = -1e-4 * loop.force_unit * z[pace - 1]
    sent, after = lead_speed(numbers, z[pace], speed, K, np.inf)
    assert (Phi @ z)[command] == pytest.approx(z[command] + gains.arm.tick * sent, rel=1e-9)
    assert (Phi @ z)[pace] == pytest.approx(after, rel=1e-9)


def test_it_is_proved_up_to_the_cap_by_both_checks_and_a_forgery_is_refused(gains, tmp_path):
    proof = certify(gains, adapting=False)
    claim = proof.claims[0]
    assert (claim.kind, claim.high) == ("held", gains.cap)
    assert proof.check().holds
    proof.save(tmp_path / "proof.json")
    text = (tmp_path / "proof.json").read_text()
    assert check(text) == len(claim.cells)
    with pytest.raises(RefusedError):
        check(
            text.replace('"damping": 480.0', '"damping": 48.0').replace('"damping":480.0', '"damping":48.0')
        )


def test_no_surface_inside_grows(gains):
    loop, rng = SampledLoop(gains.arm), np.random.default_rng(2)
    law = law_for(gains.arm, gains.gain, gains.cap)
    for _ in range(200):
        total, time = np.exp(rng.uniform(np.log(200.0), np.log(2e5))), rng.uniform(0.0, gains.theta)
        K = total / (1.0 + time / gains.theta)
        assert radius(loop.phi(K, time * K, law)) < 1.0


def adapting(gains, low, high):
    """A certificate of the adapting law on some surfaces."""
    asked = msgspec.structs.replace(adapting_claims(gains, low, 0.0)[0][0], high=high)
    return Certificate(form=FORM, gains=gains, claims=(proved_claim(gains, asked),))


def test_gain_and_lead_are_proved_to_adapt_by_both_checks_and_forgeries_are_refused(gains):
    proof = adapting(gains, 1e5, 2e5)
    assert proof.check().holds
    file = json.loads(msgspec.json.encode(proof, enc_hook=float))
    (claim,) = file["claims"]
    assert claim["shares"] == [0.5, 1.5]
    assert check(json.dumps(file)) == len(claim["cells"])
    for key, value in (("shares", [0.5, 9.0]), ("ages", [0, 1]), ("low", 5e4)):
        with pytest.raises(RefusedError):
            check(json.dumps(file | {"claims": [claim | {key: value}]}))


@pytest.mark.parametrize("K", [300.0, 3e3, 3e4, 2e5])
def test_nothing_grows_while_gain_lead_and_age_go_anywhere_inside(gains, K):
    """Words of a few letters, each repeated: what switching does at worst is the radius of their product."""
    claim, rng = adapting_claims(gains, K, 0.0)[0][0], np.random.default_rng(4)
    loop = SampledLoop(gains.arm)
    bounds = np.geomspace(K / claim.shares[1], K / claim.shares[0], 7)
    laws = [law_for(gains.arm, gains.gain_at(bound), bound) for bound in bounds]
    letters = [loop.phi(K, 0.0, law, loss) for law in laws for loss in range(claim.ages[1] + 1)]
    for _ in range(300):
        word = np.eye(loop.size)
        for i in rng.integers(len(letters), size=rng.integers(1, 5)):
            word = np.linalg.matrix_power(letters[i], int(rng.integers(1, 80))) @ word
        assert radius(word) < 1.0


def test_between_the_cap_and_the_stiffness_of_a_soft_surface_a_switching_estimator_makes_the_loop_grow():
    """Why the proof ends at twice K: the lead of a stiff surface and that of a soft one in turn, by a UR5e's servos."""
    gains = servo_gains(mass=3.6681, stiffness=4951.5, damping=990.3)
    arm, loop = gains.arm, SampledLoop(gains.arm)
    soft, stiff = (loop.phi(300.0, 0.0, law_for(arm, gains.gain_at(k), k)) for k in (200.0, 2e5))
    word = np.linalg.matrix_power(soft, 26) @ np.linalg.matrix_power(stiff, 140)
    assert max(radius(soft), radius(stiff)) < 1.0 < radius(word)


@pytest.mark.long
def test_the_adapting_law_is_proved_on_all_surfaces(gains):
    proof = certify(gains)
    assert [claim.kind for claim in proof.claims] == ["held", "adapting"]
    assert proof.check().holds


@pytest.mark.parametrize("K", [1e3, 5e3, 4e4, 2e5])
def test_a_press_settles_with_little_overshoot(gains, K):
    world = world_of(gains.arm, noise=0.1)
    force = pressed(world, surface(K), gains.cautious(), 0.003, np.full(2000, 15.0), 0)[:, 0]
    touch = int(np.argmax(force > 0.0))
    assert force.max() < 1.1 * 15.0
    assert np.abs(force[touch + 250 :] - 15.0).max() < 0.05 * 15.0


@pytest.mark.parametrize("error", [0.5, -0.5, 1.2])
def test_a_bias_while_the_tip_gathers_speed_is_no_surface(gains, error):
    """A tip that has not been at its approach yet is slow without a surface."""
    world, n = world_of(gains.arm, noise=0.1), 1500
    for seed in range(10):
        control, desired = Guarded(gains.cautious()), np.full(n, 15.0)
        rows = pressed(world, surface(1e5), control, 10.0, desired, seed, error=np.full(n, error))
        assert rows[:, 3].max() <= gains.approach * (1.0 + 1e-12)


def pushed_log(inner, seed=0, noise=1e-5, push=15.0):
    """Steps in free motion, then a push, of one mass on its servo, integrated here; 500 Hz."""
    rng, n, h = np.random.default_rng(seed), 3000, 1e-4
    command = np.repeat(rng.uniform(-0.005, 0.005, 12), 250)
    command[2000:] = command[1999]
    force = push * np.clip(np.minimum(np.arange(n) - 2150, 2850 - np.arange(n)) / 250.0, 0.0, 1.0)
    x = v = 0.0
    position, late = np.empty(n), round(inner.delay / h)
    for k in range(n):
        position[k] = x
        for j in range(20):
            held = command[max(20 * k + j - late, 0) // 20]
            a = (inner.stiffness * (held - x) - inner.damping * v - force[k]) / inner.mass
            x, v = x + h * v + 0.5 * h * h * a, v + h * a
    noisy = force + 0.1 * rng.standard_normal(n)
    return 0.002 * np.arange(n), command, position + noise * rng.standard_normal(n), noisy


def test_a_log_with_a_push_identifies_it_and_its_lag(gains):
    inner = gains.arm.inner
    time, command, position, force = pushed_log(inner)
    found = identify_inner_loop(time, command, position, force=force)
    arm = found.of(gains.arm, "log.csv")
    theta = found.theta(arm)
    truth = {"lag": inner.lag, "stiffness": inner.stiffness, "delay": inner.delay}
    for name, true in truth.items():
        assert getattr(found, name).low < true < getattr(found, name).high
        assert found.stiffness.half < 0.05 * inner.stiffness
    assert theta.low < gains.theta < theta.high < 1.2 * gains.theta
    assert arm.inner.mass == pytest.approx(inner.mass, rel=0.1)
    turned = identify_inner_loop(time, command, position, force=-force)
    assert turned.stiffness.value == pytest.approx(found.stiffness.value, rel=1e-9)


def test_a_push_that_tells_nothing_is_refused(gains):
    log = pushed_log(gains.arm.inner, push=0.0)
    with pytest.raises(InputError, match=r"mine.csv: its push does not tell"):
        identify_inner_loop(*log[:3], where="mine.csv", force=log[3])
    with pytest.raises(InputError, match="the force does not change"):
        identify_inner_loop(*log[:3], force=0.0 * log[3])


@pytest.mark.parametrize(("theta", "lag"), [(0.5, 1.0), (2.0, 1.0), (1.0, 0.5), (1.0, 2.0)])
def test_wrong_numbers_keep_the_approach_and_end_in_a_press(gains, theta, lag):
    """theta, or the lag that the lead is for, off by two."""
    inner = replace(gains.arm.inner, damping=lag * gains.arm.inner.damping)
    wrong = gains_for(replace(gains.arm, inner=inner), 15.0, theta=theta * gains.theta)
    world = world_of(gains.arm, noise=0.1)
    for K in (1e3, 2e4, 2e5):
        rows = pressed(world, surface(K), Guarded(wrong.cautious()), 0.003, np.full(2500, 15.0), 0)
        force, speed = rows[:, 0], rows[:, 3]
        touch = int(np.argmax(force > 0.0))
        assert speed[:touch].max() <= wrong.approach * (1.0 + 1e-12)
        assert force.max() < 1.15 * 15.0
        assert np.abs(force[touch + 1000 :] - 15.0).max() < 0.05 * 15.0


def test_its_encoders_show_the_surface_so_that_no_compliance_is_taken_off(gains):
    """A position arm that gave way behind its encoders has its own spring in the estimate; a servo has not."""
    known = Known(stiffness=(9e3, 1e4), value=9.5e3, in_series=True)
    assert known.beyond(gains.arm) is known
    assert known.beyond(load_arm("ur5e")).stiffness[1] > 1e4


def test_the_approach_is_what_its_touch_bears(gains):
    """On the stiffest surface the force within theta of the touch is at most F_d, the command going on."""
    inner, K, v = gains.arm.inner, gains.cap, gains.approach

    def motion(t, y):
        return [
            y[1],
            (inner.stiffness * (inner.lag * v + v * t - y[0]) - inner.damping * y[1] - K * y[0]) / inner.mass,
        ]

    flow = solve_ivp(motion, (0.0, gains.theta), [0.0, v], rtol=1e-10, atol=1e-14, max_step=1e-4)
    assert K * flow.y[0].max() == pytest.approx(gains.force, rel=1e-3)


def test_its_command_leads_only_where_a_test_has_borne_the_surface_out(gains):
    """A speed above three approaches is that of a tip whose surface was sure, and then rose as was foretold."""
    rows = pressed(
        world_of(gains.arm, noise=0.1), surface(400.0), gains.cautious(), 0.003, np.full(1500, 15.0), 0
    )
    force, speed, position = rows[:, 0], rows[:, 3], rows[:, 2]
    first, full = (int(np.argmax(speed > n * gains.approach * 1.001)) for n in (1.0, 3.0))
    assert force[first] > 2.0 * gains.level
    assert full > first
    assert force[full] - force[first] > 0.5 * 400.0 * (position[full] - position[first])
    assert speed[full : full + 50].max() > 5.0 * gains.approach


@pytest.mark.long
@pytest.mark.parametrize(("K", "speed", "R"), [(18e3, 0.09, 0.09), (6e3, 0.08, -0.09)])
def test_a_slide_leads_by_the_lag_of_free_motion_where_the_surface_bends(gains, K, speed, R):
    """With the lead of a press there, for K_u, it lifts off or digs in by the lag that is left, up to 20 % of F_d."""
    slow = gains_for(gains.arm, 20.0, cap=2.0 * K)
    curved = replace(slow, slide=Slide(speed=speed, mu_max=0.9, slope=0.04, radius=abs(R)))
    ground = ground_of("sphere" if R > 0.0 else "bowl", abs(R), K, friction=0.4)
    ways = directions("circle", 2.0, gains.arm.rate, speed, 0.03)
    found = figures_of(simulate(curved, ground, ways, into=[0.03, 0.02, -1.0]), curved, ground)
    assert found.obeys
    assert found.most < 0.06
    assert min(found.cone, found.friction, found.stiffness) > 0.9
