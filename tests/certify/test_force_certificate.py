"""The independent check of a certificate: its arithmetic, its matrices, and forgeries that it refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from force.gained import gains_of, servo_gains
from palpate.certify import force_certificate as independent
from palpate.certify.force_certificate import (
    ONE,
    Ball,
    Cell,
    ExactClaim,
    check,
    exponential,
    is_positive,
)
from palpate.force.certificate import FORM, Certificate
from palpate.force.certifying import proved_claim
from palpate.force.claims import adapting_claims, held_claim, one_sided_claim

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "force"))

from forgeries import certificate, forged, forgery, is_true, verdicts


@pytest.fixture(scope="module")
def proof():
    gains = gains_of()
    wanted = [
        held_claim(gains, 1e3, 2e4, 0.01),
        one_sided_claim(gains, gains.theta),
        *(tries[0] for tries in adapting_claims(gains, 1e3, gains.theta)),
    ]
    claims = tuple(c for c in (proved_claim(gains, claim) for claim in wanted) if c is not None)
    assert len(claims) == 4
    return Certificate(form=FORM, gains=gains, claims=claims)


@pytest.fixture(scope="module")
def file(proof):
    return json.loads(msgspec.json.encode(proof))


def floats(ball):
    return np.array([[v / ONE for v in row] for row in ball.middle])


@given(st.integers(1, 5), st.floats(0.01, 30.0), st.integers(0, 99))
@settings(max_examples=20)
def test_an_exponential_is_within_its_bound(n, size, seed):
    A = np.random.default_rng(seed).normal(size=(n, n))
    A *= size / np.linalg.norm(A)
    made = exponential(Ball.of([[Fraction(v) for v in row] for row in A.tolist()], 1))
    assert floats(made) == pytest.approx(expm(A), rel=1e-9, abs=1e-9 * np.abs(expm(A)).max())
    assert made.error / ONE < 1e-25


def test_what_is_barely_positive_is_and_what_is_barely_not_is_not():
    for rest, says in ((1e-20, True), (-1e-20, False), (0.0, False)):
        rows = [[Fraction(1), Fraction(1)], [Fraction(1), 1 + Fraction(rest)]]
        assert is_positive(Ball.of(rows, 0)) is says
    unsure = Ball.of([[Fraction(1), Fraction(1)], [Fraction(1), 1 + Fraction(1e-20)]], int(1e-20 * ONE))
    assert not is_positive(unsure)


@pytest.mark.parametrize("name", ["ur5e", "fr3", "servo"])
def test_both_have_the_same_matrices(name):
    """Checker and prover compute equal matrices of a tick at all corners."""
    gains = servo_gains() if name == "servo" else gains_of(name)
    claim = held_claim(gains, 1e4, 2e4, 0.01)
    adapting = adapting_claims(gains, 1e4, 0.01)[0][0]
    for wanted in (claim, adapting):
        prover = wanted.prover(gains)
        asked = msgspec.structs.replace(wanted, state=prover.loop.state, units=prover.loop.units)
        exact = ExactClaim(
            json.loads(msgspec.json.encode(gains)), None, json.loads(msgspec.json.encode(asked))
        )
        (box,) = asked.boxes(gains)
        cell = Cell(*map(Fraction, (box.low, box.high, box.least, box.most)), 0, 0)
        expected = prover.matrices(box)
        matrices = [floats(exact.phi(*corner)[0]) for corner in exact.corners(cell)]
        assert len(matrices) == len(expected)
        for Phi in matrices:
            assert min(np.abs(Phi - other).max() for other in expected) < 1e-12


def test_it_holds_by_both(proof, file):
    assert proof.check().holds
    assert check(json.dumps(file)) == sum(len(claim.cells) for claim in proof.claims)


def test_it_runs_by_itself(proof, tmp_path):
    """One file, without palpate."""
    proof.save(tmp_path / "c.json")
    (tmp_path / "alone.py").write_text(Path(independent.__file__).read_text(encoding="utf-8"))
    told = subprocess.run(
        [sys.executable, "-I", "alone.py", "c.json"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stderr
    assert told.stdout.startswith("holds: ")


FORGERIES = [
    (("claims", 0, "shares"), [0.1, 0.1]),  # the gain of an eighth as stiff a surface
    (("claims", 0, "shares"), [1.0, 4.0]),
    (("claims", 1, "shares"), [0.5, 0.5]),
    (("claims", 2, "shares"), [0.05, 3.0]),
    (("claims", 0, "high"), lambda v: 2.0 * v),
    (("claims", 0, "low"), lambda v: 0.5 * v),
    (("claims", 0, "most"), lambda v: 2.0 * v),
    (("claims", 1, "low"), lambda v: 0.1 * v),
    (("claims", 0, "ages"), [0, 2]),
    (("claims", 0, "ages"), [1, 1]),
    (("claims", 2, "ages"), [0, 3]),
    (("claims", 2, "ages"), [0, 1]),
    (("claims", 2, "kind"), "held"),
    (("claims", 0, "cells"), []),
    (("claims",), []),
    (("claims", 0, "state"), lambda v: [v[1], v[0], *v[2:]]),
    (("claims", 0, "units", "k0"), lambda v: 1.5 * v),
    (("gains", "theta"), lambda v: 0.3 * v),
    (("gains", "cap"), lambda v: 0.01 * v),
    (("gains", "alpha"), 0.99),
    (("gains", "law"), "cautious adaptive control 6"),
    (("gains", "arm", "inner", "delay"), 0.03),
    (("gains", "arm", "inner", "stiffness"), lambda v: 0.1 * v),
    (("gains", "arm", "rate"), 100),
    (("gains", "arm", "sensor", "low_pass"), "butterworth3:20"),
    (("form",), "palpate force certificate 1"),
    (("form",), "palpate force certificate 3"),
]


@pytest.mark.parametrize(
    ("path", "value"), FORGERIES, ids=lambda v: ".".join(map(str, v)) if isinstance(v, tuple) else ""
)
def test_a_forged_certificate_is_refused_by_both(file, path, value):
    made = forged(file, path, value)
    if path[0] == "claims" and len(path) > 1:
        made["claims"] = [made["claims"][path[1]]]
    assert verdicts(made) == (False, False)


def test_forgeries_of_random_certificates_are_refused_or_true():
    """Which benchmarks/force/forgeries.py does by the thousand."""
    rng, found = np.random.default_rng(1), []
    while len(found) < 48:
        file = certificate(rng)
        for _, made in [] if file is None else [("", file), *(forgery(rng, file) for _ in range(7))]:
            own, other = verdicts(made)
            assert other or not own  # the first also refuses units that are not its own
            assert is_true(made, rng) or not other
            found.append(other)
    assert 6 < sum(found) < 36
