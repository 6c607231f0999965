"""Many logs as one: the mean of effects that differ, and where the next one falls."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InputError
from palpate.identification.pooling import pool, random_effects
from palpate.identification.result import Identification, WorkingPoint
from palpate.identification.uncertainty import Parameter, Verdict


def parameter(value, half, unit="N/m", verdict=Verdict.IDENTIFIED):
    return Parameter(value, half / 1.96, (value - half, value + half), unit, verdict, "so it is")


def found(stiffness, half, *, model="kelvin-voigt", verdict=Verdict.IDENTIFIED, force=1.0):
    own = parameter(stiffness, half, verdict=verdict)
    point = WorkingPoint(own, force, 1e-3 * force, 2.0, "octave")
    return Identification(model, {"K": own}, ((0.0, 1.0),), None, 0.99, 0.1, 100, (), working_point=point)


def test_equal_errors_leave_the_sample_variance():
    """With equal errors, Paule and Mandel's variance between effects is the sample variance less the errors'."""
    y = np.array([10.0, 12.0, 9.0, 14.0, 11.0])
    own = random_effects(y, np.full(5, 0.5))
    assert own.between**2 == pytest.approx(y.var(ddof=1) - 0.5, rel=1e-6)
    assert own.value == pytest.approx(y.mean())
    assert own.std == pytest.approx(np.sqrt(y.var(ddof=1) / 5), rel=1e-6)
    assert own.freedom == 4


def test_values_that_agree_have_no_variance_between_them():
    own = random_effects(np.array([1.0, 1.01, 0.99]), np.full(3, 0.04))
    assert own.between == 0
    assert own.std == pytest.approx(np.sqrt(0.04 / 3))
    assert own.share == 0


def test_the_more_exact_value_weighs_more_unless_the_values_differ_anyway():
    alike = random_effects(np.array([1.0, 1.2]), np.array([0.01, 1.0]))
    apart = random_effects(np.array([1.0, 101.0]), np.array([0.01, 1.0]))
    assert alike.value == pytest.approx((1 / 0.01 + 1.2) / (1 / 0.01 + 1), rel=1e-6)
    assert apart.value == pytest.approx(51.0, abs=0.1)


def test_intervals_hold_the_truth_and_the_next_press():
    """300 sets of six presses of a surface that varies: both intervals have their 95 %, to 1.3 % (1 sigma)."""
    rng = np.random.default_rng(5)
    means, nexts = [], []
    for _ in range(300):
        std = rng.uniform(0.5, 3.0, 6)
        truth = 100 + rng.normal(0, 4, 7)
        own = random_effects(truth[:6] + std * rng.normal(0, 1, 6), std**2)
        means.append(abs(own.value - 100) <= own.half)
        nexts.append(abs(own.value - truth[6]) <= own.next_half)
    assert np.mean(means) == pytest.approx(0.95, abs=0.035)
    assert np.mean(nexts) == pytest.approx(0.95, abs=0.035)


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=8),
    st.floats(1e-3, 1e3),
    st.floats(1e-6, 1e6),
    st.floats(-1e3, 1e3),
)
def test_another_unit_or_origin_changes_nothing(values, variance, unit, origin):
    y, v = np.array(values), np.full(len(values), variance)
    one, other = random_effects(y, v), random_effects((y + origin) * unit, v * unit**2)
    size = np.sqrt(variance) + np.ptp(y) + abs(y).max() + abs(origin)
    assert other.value / unit - origin == pytest.approx(one.value, abs=1e-6 * size)
    assert other.std / unit == pytest.approx(one.std, rel=1e-4, abs=1e-6 * size)


def test_logs_are_pooled_with_what_differs_between_them():
    together = pool([found(100, 4, force=1.0), found(130, 4, force=2.0), found(115, 4, force=3.0)])
    own = together.parameters["K"]
    assert own.parameter.value == pytest.approx(115, abs=0.5)
    assert own.between > 10
    assert own.logs == (0, 1, 2)
    assert next(iter(own.parameter.budget)) == "between logs"
    assert np.hypot(*own.parameter.budget.values()) == pytest.approx(1.96 * own.parameter.std)
    low, high = own.prediction95
    assert low < own.parameter.ci95[0]
    assert own.parameter.ci95[1] < high
    point = together.working_point
    assert point.force_N == (1.0, 3.0)
    assert point.stiffness.parameter.value == own.parameter.value


def test_a_log_that_failed_or_was_rejected_is_left_out():
    logs = [found(100, 4), None, found(900, 4, verdict=Verdict.REJECTED), found(101, 4)]
    own = pool(logs).parameters["K"]
    assert own.logs == (0, 3)
    assert "2 of 4 logs" in own.parameter.reason


def test_different_models_are_not_one_quantity():
    logs = [
        found(100, 4),
        found(101, 4, model="kelvin-voigt-mass"),
        found(60, 4, model="standard-linear-solid"),
    ]
    together = pool(logs)
    assert together.parameters["K"].logs == (0, 1)
    assert together.working_point.stiffness.logs == (0, 1, 2)


def test_one_log_is_no_pool():
    own = pool([found(100, 4), None]).parameters["K"]
    assert own.parameter.value is None
    assert own.parameter.verdict is Verdict.NOT_IDENTIFIABLE
    assert own.prediction95 is None
    assert not pool([found(100, 4), None]).identified


def test_nothing_found_is_nothing_pooled():
    none = pool([None, None])
    assert none.parameters == {}
    assert none.working_point is None


def test_wide_differences_leave_no_number():
    own = pool([found(10, 1), found(1000, 1)]).parameters["K"].parameter
    assert own.value is None
    assert "zero is within it" in own.reason


def test_what_all_logs_err_by_alike_does_not_average_out():
    """A lag that nobody calibrated shifts each log the same way: a hundred logs know no more of it than one."""
    p = parameter(100, 10)
    alike = replace(p, budget={"lag": 9.0, "noise": np.sqrt(100 - 81)})
    logs = [replace(found(100, 10), parameters={"K": alike}) for _ in range(100)]
    own = pool(logs).parameters["K"].parameter
    assert (own.ci95[1] - own.ci95[0]) / 2 == pytest.approx(9.0, rel=0.01)
    assert next(iter(own.budget)) == "common to all logs"
    apart = pool([found(100, 10) for _ in range(100)]).parameters["K"].parameter
    assert (apart.ci95[1] - apart.ci95[0]) / 2 < 1.1


def meta_regression(seed, slope, n=8):
    """Values at covariates with errors of their own and a spread about the line; their variances; the covariates."""
    rng = np.random.default_rng(seed)
    temperature, std = rng.uniform(15, 35, n), rng.uniform(0.5, 3.0, n)
    values = 100 + slope * (temperature - 25) + rng.normal(0, 4, n) + std * rng.normal(0, 1, n)
    return values, std**2, temperature[:, None]


def test_of_equal_errors_a_covariate_is_ordinary_least_squares():
    values, _, temperature = meta_regression(1, -2.0)
    own = random_effects(values, np.full(8, 0.5), temperature)
    (slope, std), (expected, at_mean) = (
        own.slopes[0],
        np.polyfit(temperature[:, 0] - temperature.mean(), values, 1),
    )
    rest = values - at_mean - expected * (temperature[:, 0] - temperature.mean())
    assert slope == pytest.approx(expected)
    assert own.value == pytest.approx(at_mean)
    assert own.between**2 == pytest.approx(rest @ rest / 6 - 0.5, rel=1e-6)
    assert std == pytest.approx(np.sqrt(rest @ rest / 6 / 8) / temperature.std(), rel=1e-6)


def test_a_covariate_explains_what_differs_between_logs():
    temperature = [15.0, 20.0, 25.0, 30.0, 35.0]
    logs = [found(100 - 2 * (t - 25), 1) for t in temperature]
    plain, own = (
        pool(logs).parameters["K"],
        pool(logs, covariates={"temperature_C": temperature}).parameters["K"],
    )
    assert plain.between > 15
    assert own.between == 0
    assert own.at == {"temperature_C": 25.0}
    assert own.slopes["temperature_C"].value == pytest.approx(-2)
    assert own.slopes["temperature_C"].unit == "N/m per temperature_C"
    assert np.ptp(own.prediction95) < 0.1 * np.ptp(plain.prediction95)
    assert own.to_json()["covariates"]["temperature_C"]["at"] == 25.0
    few = pool([*logs[:2], None], covariates={"temperature_C": temperature[:3]}).parameters["K"].parameter
    assert few.value is None
    assert "3 in which each of these varies by itself" in few.reason


@pytest.mark.parametrize("values", [[1, 1, 1], [1, 2], [1, 2, np.nan]])
def test_a_covariate_that_tells_nothing_is_refused(values):
    with pytest.raises(InputError, match="covariate humidity"):
        pool([found(k, 4) for k in (100, 104, 103)], covariates={"humidity": values})
