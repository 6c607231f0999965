"""How fast a probe moved: what a verdict says to a user who asks why a mass does not show."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import Array
from palpate.identification.filters import Chain
from palpate.identification.models import Motion
from palpate.identification.problem import highest_motion

DT = 1e-3
TIME = np.arange(20_000) * DT


def moved(position: Array, rows: Array | None = None) -> float:
    rows = np.arange(0, len(position), 2) if rows is None else rows
    return highest_motion(Motion(Chain(100.0, DT), position, rows, bonded=True))


def chirp(top: float) -> Array:
    """A third of a millimetre, from 0.5 Hz to `top` in 20 s."""
    return 3e-4 * np.sin(2 * np.pi * (0.5 * TIME + (top - 0.5) / 40 * TIME**2))


@pytest.mark.parametrize("top", [10, 40, 80])
@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-5])
def test_of_a_chirp_it_is_the_end(top, noise):
    """Within 5 %: a taper of 5 % of the log at either end takes the chirp's last half hertz in ten."""
    assert moved(chirp(top) + noise * np.random.default_rng(0).normal(0, 1, len(TIME))) == pytest.approx(
        top, rel=0.05
    )


def test_what_is_between_two_contacts_does_not_count():
    position = np.where((TIME > 8) & (TIME < 12), np.sin(2 * np.pi * 60 * TIME), np.sin(2 * np.pi * 5 * TIME))
    rows = np.r_[0:7900:2, 12100:20000:2]
    assert moved(position, rows) == pytest.approx(
        5, rel=0.2
    )  # a stretch that starts in motion spreads its line
    assert moved(position) == pytest.approx(60, rel=0.05)


def test_noise_alone_is_no_motion_and_a_glimpse_tells_nothing():
    assert moved(np.random.default_rng(0).normal(0, 1, 5000)) < 1.0
    assert moved(np.sin(TIME[:60])) == np.inf
