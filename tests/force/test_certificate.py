"""What is proved holds, what is not is refused, and a certificate that was touched does not pass."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from force.gained import gains_of
from palpate.errors import InputError
from palpate.force.boundary import radius
from palpate.force.cells import Box, Prover, curvature_bound
from palpate.force.certificate import Certificate
from palpate.force.certifying import certify, exact_interval, proved_claim
from palpate.force.claims import Claim, adapting_claims, held_claim
from palpate.force.describe import bounds, claim_scope
from palpate.force.gains import approach_speed
from palpate.force.lag import lag_of
from palpate.force.lyapunov import common
from palpate.force.sampled_loop import Law, SampledLoop


@pytest.fixture(scope="module")
def proof():
    return certify(gains_of())


@pytest.fixture(scope="module")
def held(proof):
    return proof.claims[0]


def test_it_proves_what_it_says_and_holds(proof):
    verdict = proof.check()
    assert verdict.holds
    assert [c.kind for c in proof.claims] == ["held", "one-sided", "adapting", "adapting"]
    assert 1.0 - verdict.contraction > 0.0
    # Arithmetic decides nothing. The least contraction is that of a gain of a ten-thousandth: 1e-6 a tick.
    assert verdict.rounding < 1e-2 * (1.0 - verdict.contraction)


def test_the_proved_interval_is_nearly_all_there_is(proof, held):
    assert held.high >= 0.98 * min(exact_interval(proof.gains, t)[1] for t in (0.0, held.most))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_surface_inside_is_unstable(proof, held, place, time):
    gains = proof.gains
    bound = held.low * (held.high / held.low) ** place
    t = time * held.most
    K = bound / (1.0 + t / gains.theta)
    assert radius(SampledLoop(gains.arm).phi(K, t * K, Law(gains.gain))) < 1.0


def test_just_outside_is_unstable(proof):
    gains = proof.gains
    K = 1.001 * exact_interval(gains)[1]
    assert radius(SampledLoop(gains.arm).phi(K, 0.0, Law(gains.gain))) > 1.0


def test_what_is_not_stable_is_not_proved():
    gains = gains_of()
    high = 1.01 * exact_interval(gains)[1]
    assert proved_claim(gains, held_claim(gains, 0.98 * high, high, 0.0)) is None


@pytest.mark.parametrize(
    "spoil",
    [
        lambda c: {"high": 1.2 * c.high},  # the cells no longer reach
        lambda c: {"cells": c.cells[1:]},  # a gap
        lambda c: {"cells": ()},
        lambda c: {"most": 2.0 * c.most},
        lambda c: {"shares": (1.0, 3.0)},  # gains of which the norms prove nothing
        lambda c: {"cells": (msgspec.structs.replace(c.cells[0], norm=c.cells[0].norm[:-1]), *c.cells[1:])},
        lambda c: {
            "cells": (
                msgspec.structs.replace(c.cells[0], norm=(c.cells[0].norm[0][1:], *c.cells[0].norm[1:])),
                *c.cells[1:],
            )
        },
        lambda c: {
            "cells": (
                msgspec.structs.replace(c.cells[0], norm=tuple((0.0,) * len(r) for r in c.cells[0].norm)),
                *c.cells[1:],
            )
        },
    ],
)
def test_a_spoiled_certificate_does_not_hold(proof, held, spoil):
    claim = msgspec.structs.replace(held, **spoil(held))
    assert not msgspec.structs.replace(proof, claims=(claim,)).check().holds


def test_it_is_refused_for_other_gains(proof):
    gains = proof.gains
    proof.check_of(gains)
    proof.check_of(msgspec.structs.replace(gains, force=25.0))  # the force is no part of the loop
    arm = gains.arm
    for other, says in (
        (msgspec.structs.replace(gains, arm=msgspec.structs.replace(arm, rate=400.0)), "rate"),
        (gains_of("fr3"), "rate"),
        (msgspec.structs.replace(gains, arm=msgspec.structs.replace(arm, title="mine")), "arm"),
        (msgspec.structs.replace(gains, theta=0.05), "theta"),
        (msgspec.structs.replace(gains, relief=0.1), "relief"),
        (msgspec.structs.replace(gains, cap=2e6), "cap"),
    ):
        with pytest.raises(InputError, match=f"another {says}"):
            proof.check_of(other)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"form": "palpate force certificate 1"}', "\x00", "nan"])
def test_what_is_no_certificate_is_refused(tmp_path, text):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(InputError, match="no certificate"):
        Certificate.load(path)


def test_a_gain_that_goes_anywhere_inside_makes_nothing_grow(proof):
    gains, claim = proof.gains, proof.claims[2]
    loop, rng = claim.prover(gains).loop, np.random.default_rng(0)
    losses = range(claim.ages[1] - claim.ages[0] + 1)
    unit = gains.alpha / gains.theta / gains.arm.series
    corners = [
        [loop.phi(gains.arm.series, 0.0, Law(s * unit), loss) for loss in losses] for s in claim.shares
    ]
    for _ in range(20):
        x = rng.normal(size=loop.size)
        before = np.linalg.norm(x)
        for _ in range(600):
            s, loss = rng.uniform(), rng.integers(len(losses))
            x = (1.0 - s) * (corners[0][loss] @ x) + s * (corners[1][loss] @ x)
        assert np.linalg.norm(x) < before


def test_a_torque_arm_is_proved_through_its_exponential():
    gains = gains_of("fr3")
    claim = proved_claim(gains, held_claim(gains, 1e4, 2e4, 0.0))
    assert claim is not None
    assert len(claim.cells) > 1  # the hull of two corners alone would not do
    prover = claim.prover(gains)
    for cell in claim.cells:
        middle = float(np.sqrt(cell.low * cell.high))
        L = cell.L
        inside = np.linalg.norm(L.T @ prover.loop.phi(middle, 0.0, Law(gains.gain)) @ np.linalg.inv(L.T), 2)
        assert inside <= prover.contraction(cell.box, L)[0]


def test_the_curvature_bound_is_one():
    """Element by element, of a torque arm's surface and of a position arm's inner loop."""
    gains = gains_of("fr3")
    prover = Prover(SampledLoop(gains.arm), gains.theta, (gains.gain, gains.gain))
    box = Box(4e5, 5e5, 1e-3, 2e-3)
    shares = [1.0 / (1.0 + t / gains.theta) for t in (box.least, box.most)]

    def surface(i, j):
        bound, share = box.low + i * (box.high - box.low), shares[0] + j * (shares[1] - shares[0])
        return stepped(prover.loop, bound * share, gains.theta * bound * (1.0 - share))

    outside(surface, curvature_bound(prover, box))
    unsure = Prover(SampledLoop(measured(0.1).arm), gains.theta, (1.0, 1.0))
    ends = np.array(unsure.inner(0))

    def inner(i, j):
        own = tuple(ends.min(axis=0) + np.array([i, j]) * np.ptp(ends, axis=0))
        return stepped(replace(unsure.loop, inner=own), 4e4, 0.0)

    outside(inner, curvature_bound(unsure, Box(4e4, 4e4, 0.0, 0.0)))


def stepped(loop, K, B):
    """exp(T A), what acts on the input last; a position arm's first number counts from the input."""
    A, b = loop.rates(K, B)
    M = np.zeros((len(b) + 1, len(b) + 1))
    M[:-1, :-1], M[:-1, -1] = A, b + (A[:, 0] if loop.arm.kind == "position" else 0.0)
    return expm(loop.arm.tick * M)[:-1]


def outside(at, bound):
    """Nowhere in the square further from the bilinear function than the bound; no hundred times too large."""
    worst = np.zeros_like(bound)
    for i in (0.2, 0.5, 0.8):
        for j in (0.2, 0.5, 0.8):
            straight = sum(
                (i if a else 1.0 - i) * (j if b else 1.0 - j) * at(a, b) for a in (0, 1) for b in (0, 1)
            )
            worst = np.maximum(worst, np.abs(at(i, j) - straight))
    assert (worst <= bound + 1e-13).all()
    assert np.linalg.norm(bound) < 100.0 * np.linalg.norm(worst)


def test_a_torque_arm_is_proved_on_surfaces_with_damping_too():
    gains = gains_of("fr3")
    claim = proved_claim(gains, held_claim(gains, 1e4, 2e4, gains.theta))
    assert claim is not None
    prover, rng = claim.prover(gains), np.random.default_rng(0)
    for cell in claim.cells:
        L = cell.L
        bound, time = rng.uniform(cell.low, cell.high), rng.uniform(cell.least, cell.most)
        K = bound / (1.0 + time / gains.theta)
        Phi = prover.loop.phi(K, time * K, Law(gains.gain))
        inside = np.linalg.norm(L.T @ Phi @ np.linalg.inv(L.T), 2)
        assert inside <= prover.contraction(cell.box, L)[0]


@pytest.mark.long
def test_contact_lost_and_found_makes_nothing_grow(proof):
    """A spring and a damper that only push, from one tick to the next; the tip starts away from the surface."""
    gains, claim = proof.gains, proof.claims[1]
    assert (claim.kind, len(claim.cells)) == ("one-sided", 1)
    loop = claim.prover(gains).loop
    L, force = claim.cells[0].L, gains.force
    for bound, time in ((claim.high, 0.0), (0.3 * claim.high, 0.0), (0.5 * claim.high, claim.most)):
        K = bound / (1.0 + time / gains.theta)
        rest = force / K
        x = np.zeros(loop.size)
        p, first = len(loop.rates(1.0, 0.0)[1]), len(loop.rates(1.0, 0.0)[1]) + loop.lines[0] + 1
        x[0], x[first:] = -rest - 1e-3, -rest - 1e-3  # 1 mm in free motion
        x[2 : first - 1] = -force / loop.force_unit
        if p > 3:
            x[3:p] = 0.0
        lost = 0
        for _ in range(4000):
            pressed = K * (x[0] + time * loop.rate_unit * x[1])  # beside rest: -force is no contact
            share = 1.0 if pressed > -force else force / -pressed
            lost += share < 1.0
            before = np.linalg.norm(L.T @ x)
            x = loop.phi(share * K, time * share * K, Law(gains.gain)) @ x
            assert np.linalg.norm(L.T @ x) < before
        assert lost > 10
        assert abs(x[0]) < 0.05 * rest


def test_a_gain_of_next_to_nothing_is_proved_with_more_jitter(proof):
    claim = proof.claims[3]
    assert claim.shares[0] == 1e-4
    assert claim.jitter(proof.gains) == 2


def test_the_window_of_ages_holds_those_of_the_sensor(proof):
    arm = proof.gains.arm
    for claim in proof.claims[2:]:
        assert claim.ages[0] == 0
        assert claim.ages[1] >= arm.rate / arm.sensor.sampling


def test_the_bounds_of_K_u_are_those_at_which_the_shares_are_left():
    for name, least in (("ur5e", 0.5), ("fr3", 0.577)):
        gains = gains_of(name)
        high = gains.seen_cap
        ages = (0, gains.arm.sensor_ticks)
        claim = Claim(kind="adapting", low=1e3, high=high, least=0.0, most=0.0, shares=(0.05, 2.0), ages=ages)
        low = bounds(claim, gains)[0]
        assert low == pytest.approx(least, rel=2e-3)
        shares = [
            gains.theta * (gains.arm.seen(K) if name == "fr3" else K) * gains.gain_at(low * K) / gains.alpha
            for K in np.geomspace(1e3, high, 50)
        ]
        assert 1.99 < max(shares) <= 2.0 + 1e-9
        assert f"K_u {low:.3g}" in claim_scope(claim, gains)


def test_a_claim_for_one_sided_contact_is_of_one_norm(proof):
    """Two cells that share the range are not one: contact lost goes from the one into the other."""
    claim = proof.claims[1]
    (cell,) = claim.cells
    middle = (cell.low * cell.high) ** 0.5
    two = tuple(msgspec.structs.replace(cell, **{k: middle}) for k in ("high", "low"))
    assert (
        not msgspec.structs.replace(proof, claims=(msgspec.structs.replace(claim, cells=two),)).check().holds
    )


def measured(half, late=0.0):
    """The UR5e's gains where w, z and the delay are known to this share, and to this time [s]."""
    gains = gains_of()
    inner = gains.arm.inner
    ends = {
        f"{n}_interval": (getattr(inner, n) * (1 - half), getattr(inner, n) * (1 + half))
        for n in ("bandwidth", "damping")
    }
    if late:
        ends["delay_interval"] = (inner.delay - late, inner.delay + late)
    arm = msgspec.structs.replace(gains.arm, inner=msgspec.structs.replace(inner, **ends))
    theta = lag_of(arm)
    return msgspec.structs.replace(
        gains, arm=arm, theta=theta, approach=approach_speed(arm, 20.0, theta, gains.cap)
    )


@pytest.mark.long
def test_an_inner_loop_known_to_intervals_is_proved_for_all_that_it_may_be():
    gains = measured(0.01, 0.001)
    assert gains.theta > lag_of(gains_of().arm)
    proof = certify(gains, adapting=False)
    (claim,) = proof.claims
    assert claim.kind == "one-sided"
    assert proof.check().holds
    assert {cell.loss for cell in claim.cells} == {0, 1, 2}
    rng, inner = np.random.default_rng(0), gains.arm.inner
    for _ in range(50):
        f, z = rng.uniform(*inner.bandwidth_interval), rng.uniform(*inner.damping_interval)
        w = 2.0 * np.pi * f
        time, bound, late = rng.uniform(0.0, claim.most), rng.uniform(claim.low, claim.high), rng.integers(3)
        cell = next(c for c in claim.cells if c.loss == late and c.least <= time <= c.most)
        loop, L = replace(claim.prover(gains).loop, inner=(w * w, 2.0 * z * w)), cell.L
        K = bound / (1.0 + time / gains.theta)
        Phi = loop.phi(K, time * K, Law(gains.gain), late)
        assert np.linalg.norm(L.T @ Phi @ np.linalg.inv(L.T), 2) < 1.0
    few = msgspec.structs.replace(claim, cells=tuple(c for c in claim.cells if c.loss != 1))
    assert not msgspec.structs.replace(proof, claims=(few,)).check().holds


def test_a_common_norm_is_found_and_none_where_there_is_none():
    rng = np.random.default_rng(1)
    T = rng.normal(size=(4, 4))
    contracting = []
    for _ in range(3):
        M = rng.normal(size=(4, 4))
        contracting.append(np.linalg.inv(T) @ (0.95 * M / np.linalg.norm(M, 2)) @ T)
    L = common(contracting, sum(contracting) / 3.0)
    assert max(np.linalg.norm(L.T @ M @ np.linalg.inv(L.T), 2) for M in contracting) < 1.0
    swing = np.array([[0.0, 2.0], [0.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0]])  # their product grows
    assert common(swing, 0.1 * (swing[0] + swing[1])) is None


def test_an_adapting_claim_of_a_position_arm_speaks_of_every_stiffness():
    gains = gains_of()
    claim = proved_claim(gains, adapting_claims(gains, 1.0, 0.0)[0][0])
    other = msgspec.structs.replace(gains, cap=3e4)
    again = msgspec.structs.replace(claim, low=other.seen_cap, high=other.seen_cap)
    assert claim.low == claim.high
    # The same matrices but for the unit of force: found anew, it is proved too.
    assert proved_claim(other, msgspec.structs.replace(again, cells=())) is not None
