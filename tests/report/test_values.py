"""Every public value in a line and for a notebook."""

from pathlib import Path

import numpy as np
import pytest

import palpate
from force.gained import gains_of
from palpate.bench import build, load
from palpate.force import ForceLoop
from palpate.identifiers import RecursiveLeastSquares, RestartingLeastSquares
from palpate.robots import Planar3R, SerialArm
from palpate.signals import Estimate

LOG = Path(__file__).parents[2] / "examples/data/press.csv"


@pytest.fixture(scope="module")
def found():
    return palpate.identify(LOG, time="time_s", position="position_mm:mm", force="force_N:N")


def fed(estimator):
    for k in range(50):
        estimator.update([np.sin(k), np.cos(k), 1e-3 * k], 2.0 * np.sin(k) + 5.0 * k)
    return estimator


def test_a_force_loop_says_its_phase_its_trouble_and_its_gains():
    loop = ForceLoop(gains_of())
    loop.update(float("nan"), 0.0)
    text = repr(loop)
    assert text.startswith(
        f"<ForceLoop: {loop.phase}, trouble {loop.trouble}, force 20 N, arm position at 500 Hz"
    )
    assert loop.trouble in text


def test_a_parameter_says_number_interval_and_verdict(found):
    half = (found.K.ci95[1] - found.K.ci95[0]) / 2
    assert repr(found.K) == f"<Parameter: {found.K.value:.0f} ± {half:.0f} N/m, identified>"
    low, high = (f"{end:.2g}" for end in found.M.ci95)
    assert repr(found.M) == f"<Parameter: {low} to {high} kg, not identifiable>"
    assert "5236 ± 61 N/m" in repr(found.working_point)


def test_advice_in_python_names_the_keyword(found):
    assert "lag=" in found._repr_html_()
    for view in (found._repr_html_(), str(found), repr(found)):
        assert "--lag" not in view
        assert "--robot-stiffness" not in view


VALUES = {
    "arm": (lambda: SerialArm.named("ur5e"), "Universal Robots UR5e"),
    "planar": (Planar3R, "0.2207 + 0.1603 + 0.1508 m"),
    "experiment": (
        lambda: load("foam-hybrid"),
        "Foam, 20 N under hybrid control, surface kelvin-voigt stiffness 5200",
    ),
    "controller": (lambda: load("rubber-hybrid").controller, "hybrid, kf 0.25, ki 0.0015"),
    "bench": (lambda: build(load("foam-hybrid")), "controller Hybrid, surface K 5200 N/m"),
    "estimate": (
        lambda: Estimate(("K", "p"), np.array([5e3, 2.0]), np.eye(2), 9.0),
        "K 5000.0 ± 2.0 N/m, p 2.0 ± 2.0",
    ),
    "least squares": (
        lambda: fed(RecursiveLeastSquares(np.zeros(3), 1e4 * np.eye(3), names=("M", "B", "K"))),
        "K 4990 ± 610 N/m",
    ),
    "restarting": (lambda: fed(RestartingLeastSquares(np.zeros(3), 1e4 * np.eye(3))), "samples 50"),
}


@pytest.mark.parametrize(("make", "told"), VALUES.values(), ids=VALUES)
def test_a_value_is_one_short_line(make, told):
    value = make()
    assert told in repr(value)
    assert "\n" not in repr(value)
    assert len(repr(value)) < 200
    assert "array(" not in repr(value)


def test_a_strangers_name_stays_text(found):
    from dataclasses import replace

    bad = replace(found.K, unit="N\x1b[31m", reason="<script>alert(1)</script>\x1b[31m")
    assert "N" in repr(bad)
    assert "\x1b" not in repr(bad)
