"""The proof of a slide whose normal is off while friction pulls, both changing from tick to tick."""

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.certify.force_certificate import RefusedError, check, check_slide
from palpate.force.arm import load_arm
from palpate.force.certifying import certify
from palpate.force.gains import gains_for
from palpate.force.sampled_loop import Law
from palpate.force.slide_table import Slide
from palpate.force.sliding.slide_proof import MAX_MISALIGNMENT, gain_factors, slide_proof

MU_MAX = 0.9


@pytest.fixture(scope="module", params=["ur5e", "fr3"])
def proved(request, tmp_path_factory):
    """A certificate of gains with a slide, its file, and what it proves of the slide."""
    gains = replace(gains_for(load_arm(request.param), 15.0, cap=4e4), slide=Slide(speed=0.03, mu_max=MU_MAX))
    certificate = certify(gains, adapting=False)
    path = tmp_path_factory.mktemp("proof") / "certificate.json"
    certificate.save(path)
    return certificate, path.read_bytes(), slide_proof(certificate)


def test_the_factor_of_the_gain_is_between_its_ends():
    least, most = gain_factors(MU_MAX)
    phi, mu = np.meshgrid(np.linspace(-MAX_MISALIGNMENT, MAX_MISALIGNMENT, 201), np.linspace(0.0, MU_MAX, 51))
    m = np.cos(phi) * (np.cos(phi) + mu * np.sin(phi))
    assert m.min() == pytest.approx(least)
    assert m.max() == pytest.approx(most, rel=1e-4)
    assert m.max() <= most


def test_a_slide_is_proved_over_two_decades_up_to_the_cap_over_the_largest_factor(proved):
    certificate, _, slide = proved
    low, high = slide["felt_stiffness"]
    assert low < high / 100.0
    assert 0.9 * certificate.gains.seen_cap / gain_factors(MU_MAX)[1] < high


def test_the_independent_check_proves_the_same_slide_and_no_wider_one(proved):
    _, file, slide = proved
    low, high = slide["felt_stiffness"]
    assert check(file) > 0
    check_slide(file, low, high)
    for wider in ((0.99 * low, high), (low, 1.01 * high)):
        with pytest.raises(RefusedError, match="a slide is not proved"):
            check_slide(file, *wider)


def test_no_changing_angle_grows_in_the_norm_of_a_cell(proved):
    """One cell holds all of m K, and its norm contracts whatever m is at each tick."""
    certificate, _, slide = proved
    rng, (low, high), (least, most) = np.random.default_rng(0), slide["felt_stiffness"], gain_factors(MU_MAX)
    claims = [claim for claim in certificate.claims if claim.kind != "adapting"]
    for K in np.exp(rng.uniform(np.log(low), np.log(high), 20)):
        claim, cell = next(
            (claim, c)
            for claim in claims
            for c in claim.cells
            if c.least == 0.0 and c.low <= least * K and most * K <= c.high
        )
        loop, L = claim.prover(certificate.gains).loop, np.array(cell.norm)
        for m in rng.uniform(least, most, 20):
            phi = loop.phi(m * K, 0.0, Law(certificate.gains.gain))
            assert np.linalg.norm(L.T @ phi @ np.linalg.inv(L.T), 2) < 1.0
