"""A log in which nothing is touched says so, whatever the sensor shows in free motion; and gives no number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.synthetic_contacts import Array, pressed, record
from palpate.identification import identify

TIME = np.arange(5000) / 1000
MOTIONS = {
    "chirp": 3e-3 * np.sin(2 * np.pi * (0.5 * TIME + 4 * TIME**2)),
    "sines": sum(2e-3 * np.sin(2 * np.pi * f * TIME + f) for f in (0.3, 1.7, 6.1)),
    "steps": 5e-3 * np.floor(TIME),
}


def white(seed: int = 0) -> Array:
    return np.random.default_rng(seed).normal(0, 0.1, len(TIME))


FORCES = {
    "noise": white(),
    "noise of another seed": white(1),
    "a bias": white() - 8,
    "held": np.repeat(white()[:1250], 4),
    "held at 480 Hz": white()[(TIME * 480).astype(int)],
    "coarse": np.round(white() / 0.1) * 0.1,
    "coarser than its noise": np.round(white() / 0.25) * 0.25,
    "slow noise": lfilter([0.3], [1, -0.95], white()),
    "a hum": white() + 0.3 * np.sin(2 * np.pi * 50 * TIME),
    "spikes": white()
    + 20 * (np.arange(5000) % 613 == 1),  # not in step with the steps, whose speed they would follow
}


EACH = [
    pytest.param(force, motion, marks=pytest.mark.long if (i + j) % 3 else ())
    for i, force in enumerate(FORCES)
    for j, motion in enumerate(MOTIONS)
]
"""Each force and each motion stands in a test of its own of each run; all their pairs in the long ones."""


@pytest.mark.parametrize(("force", "motion"), EACH)
def test_nothing_is_touched(motion, force):
    found = identify(record(TIME, MOTIONS[motion], FORCES[force]))
    assert all(p.value is None for p in found.parameters.values())
    assert found.working_point is None or found.working_point.stiffness.verdict != "identified"
    if "no-contact" in found.codes:
        assert found.working_point is None
        assert not found.contacts
        assert not {"force-sign-reversed", "position-sign-reversed", "low-excitation"} & set(found.codes)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("filtered", [None, "butterworth3:120"])
def test_a_force_that_drifts_shows_no_parameter(motion, filtered):
    if motion == "steps":
        pytest.skip("a force that rises with every step is that of a spring")
    found = identify(record(TIME, MOTIONS[motion], white() + TIME / 5), force_filter=filtered)
    assert all(p.verdict != "identified" for p in found.parameters.values()), found.parameters


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2, 3))])
def test_a_noisy_press_is_no_bonded_one(seed):
    """A few samples at the noise's lower end lie close together, and are no contact whose position stands still."""
    found = identify(pressed(noise=0.2, seed=seed))
    start, end = max(found.contacts, key=lambda span: span[1] - span[0])
    assert start == pytest.approx(0.52, abs=0.02)
    assert end == pytest.approx(2.03, abs=0.05)
