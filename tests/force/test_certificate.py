"""What is proved holds, what is not is refused, and a certificate that was touched does not pass."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from force.gained import gains_of
from palpate.errors import InputError
from palpate.force.boundary import radius
from palpate.force.cells import Box, Prover
from palpate.force.certificate import (
    FORM,
    Certificate,
    adapting_claim,
    certify,
    exact_interval,
    held_claim,
    proved_claim,
)
from palpate.force.lyapunov import common, single
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
    assert [c.kind for c in proof.claims] == ["held", "adapting"]
    assert 1.0 - verdict.contraction > 0.0
    assert verdict.rounding < 1e-3 * (1.0 - verdict.contraction)  # arithmetic decides nothing


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
    assert (
        proved_claim(gains, held_claim(gains, 0.9 * high, high, 0.0), [Box(0.98 * high, high, 0.0, 0.0)])
        is None
    )


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
        (msgspec.structs.replace(gains, cap=2e6), "cap"),
    ):
        with pytest.raises(InputError, match=f"another {says}"):
            proof.check_of(other)


def test_its_file_says_the_same(proof, tmp_path):
    proof.save(tmp_path / "c.json")
    assert Certificate.load(tmp_path / "c.json") == proof


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"form": "palpate force certificate 2"}', "\x00", "nan"])
def test_what_is_no_certificate_is_refused(tmp_path, text):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(InputError, match="no certificate"):
        Certificate.load(path)


def test_a_gain_that_goes_anywhere_inside_makes_nothing_grow(proof):
    gains, claim = proof.gains, proof.claims[1]
    loop, rng = SampledLoop(gains.arm).later(claim.jitter), np.random.default_rng(0)
    unit = gains.alpha / gains.theta / gains.arm.series
    corners = [
        [loop.phi(gains.arm.series, 0.0, Law(s * unit), loss) for loss in range(claim.jitter + 1)]
        for s in claim.shares
    ]
    for _ in range(20):
        x = rng.normal(size=loop.size)
        before = np.linalg.norm(x)
        for _ in range(600):
            s, loss = rng.uniform(), rng.integers(claim.jitter + 1)
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
        L = cell.cell.L
        inside = np.linalg.norm(L.T @ prover.loop.phi(middle, 0.0, Law(gains.gain)) @ np.linalg.inv(L.T), 2)
        assert inside <= prover.contraction(cell.cell.box, L)[0]


def test_the_curvature_bound_is_one():
    gains = gains_of("fr3")
    prover = Prover(SampledLoop(gains.arm), gains.theta, (gains.gain, gains.gain))
    box = Box(4e5, 5e5, 0.0, 0.0)
    L = single(prover.loop.phi(4.5e5, 0.0, Law(gains.gain)))
    back = np.linalg.inv(L.T)
    ends = [prover.loop.phi(k, 0.0, Law(gains.gain)) for k in (4e5, 5e5)]
    for share in (0.25, 0.5, 0.75):
        straight = (1.0 - share) * ends[0] + share * ends[1]
        own = prover.loop.phi(4e5 + share * 1e5, 0.0, Law(gains.gain))
        assert np.linalg.norm(L.T @ (own - straight) @ back, 2) <= prover.curvature(box, L, back)


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
    claim = proved_claim(gains, adapting_claim(gains, 1.0, 0.0))
    other = msgspec.structs.replace(gains, cap=3e4)
    again = msgspec.structs.replace(claim, low=other.seen_cap, high=other.seen_cap)
    assert claim.low == claim.high
    # The same matrices but for the unit of force: found anew, it is proved too.
    assert proved_claim(other, msgspec.structs.replace(again, cells=())) is not None


def test_a_soft_cap_is_proved_as_well():
    gains = gains_of(cap=50.0)
    claim = proved_claim(gains, held_claim(gains, 0.5 * gains.seen_cap, gains.seen_cap, 0.0))
    assert claim is not None
    assert Certificate(form=FORM, gains=gains, claims=(claim,)).check().holds
