"""Uncertainty budgets: the worked examples of JCGM 100 (annex H), Monte Carlo, and the sums of each result's own."""

from __future__ import annotations

import json
from math import floor, inf

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, shaken
from palpate.identification import identify
from palpate.identification.budget import FittedParameters, Spread, white_level
from palpate.identification.uncertainty import (
    Contribution,
    Measurement,
    correlations,
    effective_freedom,
    student,
)


def answer(names, theta, cov):
    """Parameters with a covariance alone."""
    budget = {"noise": Spread(np.diag(cov))}
    return FittedParameters(
        names, np.asarray(theta), cov, budget, None, 1.0, 0.0, 0.0, 0.0, np.empty((0, 0)), None
    )


def test_the_end_gauge_of_annex_h1():
    """Length of an end gauge [nm]: standard, comparison, difference of expansion, difference of temperature."""
    parts = {
        "standard": Contribution(25.0, 18.0),
        "comparison": Contribution(9.7, 25.6),
        "expansion": Contribution(2.9, 50.0),
        "temperature": Contribution(16.6, 2.0),
    }
    found = Measurement(900.0, parts)
    assert round(found.combined) == 32
    assert found.freedom == pytest.approx(16.7, abs=0.1)
    coverage = student(floor(found.freedom), 0.99)
    assert round(coverage, 2) == 2.92
    assert round(coverage * 32) == 93
    assert found.half / found.combined == pytest.approx(student(found.freedom), rel=1e-12)


def test_the_resistance_and_reactance_of_annex_h2():
    """Five simultaneous readings of voltage, current and phase; R, X and Z are functions of their means."""
    readings = np.array(
        [
            [5.007, 4.994, 5.005, 4.990, 4.999],
            [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
            [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
        ]
    )
    (v, i, phi), cov = readings.mean(axis=1), np.cov(readings) / 5
    assert correlations(("V", "I", "phi"), cov) == pytest.approx(
        {"V,I": -0.36, "V,phi": 0.86, "I,phi": -0.65}, abs=0.01
    )
    c, s, z = np.cos(phi), np.sin(phi), v / i
    jacobian = np.array([[c / i, -z * c / i, -z * s], [s / i, -z * s / i, z * c], [1 / i, -z / i, 0.0]])
    found = answer(("V", "I", "phi"), [v, i, phi], cov).through(jacobian, np.array([z * c, z * s, z]))
    np.testing.assert_allclose(found.theta, [127.732, 219.847, 254.260], atol=6e-4)
    np.testing.assert_allclose(np.sqrt(np.diag(found.cov)), [0.071, 0.295, 0.236], atol=6e-4)
    assert correlations(("R", "X", "Z"), found.cov) == pytest.approx(
        {"R,X": -0.588, "R,Z": -0.485, "X,Z": 0.993}, abs=6e-4
    )


def test_the_thermometer_of_annex_h3():
    """A straight line through eleven corrections by temperature, and the correction that it predicts at 30 degrees."""
    t = np.array([21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511])
    b = -np.array([0.171, 0.169, 0.166, 0.159, 0.164, 0.165, 0.156, 0.157, 0.159, 0.161, 0.160])
    columns = np.column_stack([np.ones(11), t - 20.0])
    theta, rss, *_ = np.linalg.lstsq(columns, b, rcond=None)
    cov = rss[0] / 9 * np.linalg.inv(columns.T @ columns)
    found = answer(("intercept", "slope"), theta, cov)
    np.testing.assert_allclose(found.theta, [-0.1712, 0.00218], atol=6e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(found.cov)), [0.0029, 0.00067], atol=6e-5)
    assert correlations(found.names, cov)["intercept,slope"] == pytest.approx(-0.930, abs=6e-4)
    at_30 = found.through(np.array([[1.0, 10.0], [0.0, 1.0]]), np.array([theta @ [1.0, 10.0], theta[1]]))
    assert at_30["intercept"] == pytest.approx(-0.1494, abs=6e-5)
    assert np.sqrt(at_30.cov[0, 0]) == pytest.approx(0.0041, abs=6e-5)


def test_effective_degrees_of_freedom():
    assert effective_freedom([[1.0], [1.0]], [[4.0], [4.0]]) == pytest.approx([8.0])
    assert effective_freedom([[1.0], [0.0]], [[4.0], [1.0]]) == pytest.approx([4.0])
    assert Measurement(1.0, {"lag": Contribution(2.0)}).freedom == inf
    assert student(1e9) == pytest.approx(1.96, abs=1e-4)


@pytest.fixture(scope="module")
def logs():
    """A shaken contact with everything that an input can be, and a press."""
    arm = {"series_stiffness": 40e3, "series_std": 1500.0, "series_mass": (0.2, 0.02)}
    return [
        identify(shaken(n=2000), lag=0.001, lag_std=2e-4, calibration=0.02, bonded=True, **arm),
        identify(shaken(n=2000)),
        identify(pressed(), calibration=0.02),
    ]


def test_the_expanded_uncertainty_is_the_half_width(logs):
    for found in logs:
        point = [found.working_point.stiffness] if found.working_point else []
        numbers = [p for p in (*point, *found.parameters.values()) if p.value is not None]
        assert numbers
        for p in numbers:
            own = p.measurement
            coverage = own.half / own.combined
            assert own.half == pytest.approx((p.ci95[1] - p.ci95[0]) / 2)
            assert coverage >= student(own.freedom) * (1 - 1e-4)
            listed = [coverage * part.std for part in own.contributions.values()]
            assert np.hypot.reduce(listed) == pytest.approx(own.half)
        for name in found.parameters.keys() & {"K", "B", "M"}:
            p = found.parameters[name]
            if p.value is not None and p is not found.working_point.stiffness:
                coverage = p.measurement.half / p.measurement.combined
                assert coverage == pytest.approx(student(p.measurement.freedom), rel=1e-4)


def test_an_input_times_its_sensitivity_is_its_contribution(logs):
    said = logs[0].uncertainty_json()
    inputs = {"lag", "calibration", "series stiffness", "tip's mass"}
    assert {own["source"] for own in said["parameters"]["M"]["sources"] if own["input"]} == inputs
    for budget in (said["working_point"], *said["parameters"].values()):
        sources = budget["sources"]
        assert sum(own["share"] for own in sources) == pytest.approx(1.0)
        for own in sources:
            if own["input"]:
                product = own["sensitivity"] * own["input"]["std"]
                assert product == pytest.approx(own["standard_uncertainty"])
            else:
                assert own["sensitivity"] == 1.0
    K = said["parameters"]["K"]
    by_scale = next(own for own in K["sources"] if own["source"] == "calibration")
    assert by_scale["sensitivity"] == pytest.approx(abs(K["value"]))
    assert json.loads(json.dumps(said)) == said


def test_the_calibration_is_a_cause_of_the_working_point_too(logs):
    found = logs[2]
    part = found.working_point.stiffness.contributions["calibration"]
    assert part.std == pytest.approx(0.02 * abs(found.working_point.stiffness.value))


def test_octaves_without_lines_have_no_level_of_noise():
    assert white_level(np.ones(3), np.zeros(3)) == 0.0
    assert white_level(np.array([1.0, 9.0]), np.array([0.0, 5.0])) == 9.0


def test_a_half_width_is_a_fraction_of_the_size_of_its_value():
    found = Measurement(-4.0, {"lag": Contribution(1.0)})
    assert found.relative_half == pytest.approx(1.96 / 4.0, rel=1e-3)
    assert found.known_to(found.relative_half * (1.0 + 1e-12))
    assert not found.known_to(found.relative_half * (1.0 - 1e-12))
    assert np.isfinite(Measurement(0.0, found.contributions).relative_half)
    certain = Measurement(-4.0, found.contributions | {"noise": Contribution(1.0, 1e5)})
    assert certain.freedom == pytest.approx(4e5, rel=1e-3)
