"""What recursive least squares is fed with: an exact intercept, and channels that share every lag."""

import numpy as np
import pytest

from palpate._vector import Mat3, Vec3
from palpate.bench.estimators import Centring, Matched
from palpate.identifiers.least_squares import LeastSquares
from palpate.instruments import force_sensor
from palpate.signals.filters import butterworth3, delay, state_variable

TICK, PHYSICS = 1000.0, 20000
TRUTH = np.array([0.4, 60.0, 5200.0])  # M [kg], B [N s/m], K [N/m]


PRIOR = 100.0  # covariance before the first sample, times the identity


def with_intercept(phi, y, forgetting=1.0, prior=PRIOR):
    """The weighted least-squares slopes of y against phi with a free offset, by NumPy.

    The slopes have a prior at zero, the offset has none.
    """
    root = np.sqrt(forgetting ** np.arange(len(y) - 1, -1, -1.0))
    design = root[:, None] * np.column_stack([phi, np.ones(len(y))])
    known = np.sqrt(forgetting ** len(y) / prior) * np.eye(3, 4)
    return np.linalg.lstsq(np.vstack([design, known]), np.append(root * y, np.zeros(3)), rcond=None)[0][:3]


def start_of_covariance():
    return Mat3(Vec3(PRIOR, 0.0, 0.0), Vec3(0.0, PRIOR, 0.0), Vec3(0.0, 0.0, PRIOR))


@pytest.mark.parametrize("forgetting", [1.0, 0.99])
def test_least_squares_on_what_is_centred_is_least_squares_with_an_intercept(forgetting):
    random = np.random.default_rng(2)
    phi = random.standard_normal((2500, 3)) + np.array([5.0, -20.0, 3.0])
    y = phi @ [1.5, -0.3, 2.0] + 7.0 + 0.1 * random.standard_normal(2500)
    # With forgetting, when the prior is: the bound on P keeps it for a few samples more.
    checked = {50, 300, 2500} if forgetting == 1.0 else {2500}
    centring, estimator = (
        Centring(forgetting),
        LeastSquares(Vec3(0.0, 0.0, 0.0), start_of_covariance(), forgetting),
    )
    mean, state = centring.start(), estimator.start()
    for k, (regressor, force) in enumerate(zip(phi, y, strict=True), 1):
        (dphi, dy), mean = centring.step(mean, Vec3(*map(float, regressor)), float(force))
        theta, state = estimator.step(state, dphi, dy)
        if k in checked:
            slopes = with_intercept(phi[:k], y[:k], forgetting)
            np.testing.assert_allclose(np.array(theta), slopes, rtol=1e-10)
    weights = forgetting ** np.arange(2499, -1, -1.0)
    np.testing.assert_allclose(np.array(mean.mean), weights @ phi / weights.sum(), rtol=1e-12)
    assert mean.force == pytest.approx(weights @ y / weights.sum(), rel=1e-12)
    assert mean.weight == pytest.approx(weights.sum(), rel=1e-12)


def matched(sensor):
    """The front-end for a sensor: its filter in two sections at the tick's rate, the rest as a delay."""
    model = butterworth3(120.0, TICK)
    return Matched(model.second, model.first, delay(sensor.lag - model.lag, TICK), state_variable(35.0, TICK))


def sampled_contact(sensor, seconds=3.0):
    """Position and sampled force at each tick of a surface of known M, B, K that moves in many sines."""
    time = np.arange(int(seconds * PHYSICS)) / PHYSICS
    omega = 2 * np.pi * np.array([0.7, 3.1, 7.3, 13.7])[:, None]
    amplitude = np.array([1e-3, 3e-4, 1e-4, 5e-5])[:, None]
    x = 3e-3 + (amplitude * np.sin(omega * time)).sum(axis=0)
    v = (amplitude * omega * np.cos(omega * time)).sum(axis=0)
    a = -(amplitude * omega**2 * np.sin(omega * time)).sum(axis=0)
    force = np.column_stack([a, v, x]) @ TRUTH
    state, held, out = sensor.start(), 0.0, []
    for k, f in enumerate(force):
        if k % 20 == 0:
            out.append(held)
        held, state = sensor.sample(state, f, k, 0.0)
    return x[::20], np.array(out)


def identified(front, position, force):
    state, phi, y = front.start_at(position[0]), [], []
    for x, f in zip(position, force, strict=True):
        (regressor, matched_force), state = front.step(state, float(x), float(f))
        phi.append(regressor)
        y.append(matched_force)
    return with_intercept(np.array(phi)[500:], np.array(y)[500:], prior=1e12)


def test_channels_that_share_the_sensors_lag_give_the_truth():
    """Without noise the chain's model is the only error; a naive fit has the lag in B and M."""
    sensor = force_sensor(bits=30, noise=0.0)
    position, force = sampled_contact(sensor)
    M, B, K = identified(matched(sensor), position, force)
    assert pytest.approx(TRUTH[2], rel=2e-3) == K
    assert pytest.approx(TRUTH[1], abs=0.0002 * TRUTH[2]) == B  # 0.2 ms of lag
    assert pytest.approx(TRUTH[0], abs=0.1) == M
    bare = matched(sensor)._replace(delay=delay(0.0, TICK))
    _, biased, _ = identified(bare, position, force)
    assert biased < B - 0.8 * TRUTH[2] * (sensor.lag - butterworth3(120.0, TICK).lag)


def test_position_and_force_leave_with_the_same_filter():
    """A step on either channel that has passed the sensor's model comes out alike."""
    sensor = force_sensor()
    front, model = matched(sensor), butterworth3(120.0, TICK)
    through_position, through_force = front.start_at(0.0), front.start_at(0.0)
    chain, late = model.start(), front.delay.start()
    for _ in range(200):
        (phi, _), through_position = front.step(through_position, 1.0, 0.0)
        filtered, chain = model.step(chain, 1.0)
        arrived, late = front.delay.step(late, filtered)
        (_, y), through_force = front.step(through_force, 0.0, arrived)
        assert phi.z == pytest.approx(y, abs=1e-12)
