"""F_max: nothing within its assumptions exceeds it, by a simulator of its own; each assumption is needed."""

import math
from functools import partial

import numpy as np
import pytest
import scipy.signal

from palpate.errors import InputError
from palpate.force import ForceLoop, ceiling, load_arm, tune
from palpate.force.ceiling import residual_travel
from palpate.force.gains import gains_for, known_lag

SUBSTEPS = 20
F_D = 20.0


def layers(soft, thickness, hard, spring=5e4):
    """Force over the tip's position of a soft layer on a hard one, unstressed, with the arm's own spring in series."""
    first, second = (k * spring / (k + spring) for k in (soft, hard))
    reached = thickness * (1.0 + soft / spring)
    return lambda x: first * min(max(x, 0.0), reached) + second * max(x - reached, 0.0)


class UR5e:
    """A tip under a position loop of 10 Hz and damping 0.9, 10 ms late, and its sensor.

    The sensor has three poles at 120 Hz, and is read 480 times a second, with a noise of 0.1 N.
    """

    def __init__(self, gap, seed):
        self.noise = np.random.default_rng(seed)
        self.step = 1.0 / (500.0 * SUBSTEPS)
        self.sent = [-gap] * (SUBSTEPS * 5 + 1)
        self.position, self.speed = -gap, 0.0
        self.low_pass, self.reading, self.time = np.zeros(3), 0.0, 0.0

    def tick(self, command, surface, carried=0.0):
        """Peak force of a tick; `carried` is the surface's own speed towards the tip [m/s]."""
        peak, w, corner = 0.0, 2.0 * math.pi * 10.0, 2.0 * math.pi * 120.0
        for _ in range(SUBSTEPS):
            self.sent.append(command)
            due = self.sent[-1 - SUBSTEPS * 5]
            self.speed += self.step * (w * w * (due - self.position) - 1.8 * w * self.speed)
            self.position += self.step * self.speed
            self.time += self.step
            force = surface(self.position + carried * self.time)
            y, rate, change = self.low_pass
            jerk = corner**3 * (force - y) - 2.0 * corner**2 * rate - 2.0 * corner * change
            self.low_pass = self.low_pass + self.step * np.array([rate, change, jerk])
            if int(self.time * 480.0) > int((self.time - self.step) * 480.0):
                self.reading = float(self.low_pass[0]) + 0.1 * self.noise.standard_normal()
            peak = max(peak, force)
        return peak


def peak_of(update, surface, seconds=3.0, gap=0.004, sensor=lambda force: force, carried=0.0, seed=0):
    """Largest true force of a press by a law `update(reading, position) -> speed`."""
    arm, command, peak = UR5e(gap, seed), -gap, 0.0
    for _ in range(int(500 * seconds)):
        command += update(sensor(arm.reading), arm.position) / 500.0
        peak = max(peak, arm.tick(command, surface, carried))
    return peak


def full_speed(speed):
    """The fastest law that the theorem admits: the whole speed until a reading reaches the force."""
    state = {"speed": speed}

    def update(reading, _):
        if reading >= F_D:
            state["speed"] = 0.0
        return state["speed"]

    return update


HARD = layers(500.0, 0.02, 1e6)
WORST = layers(1000.0, 0.019, 1e6)


@pytest.mark.parametrize("force_max", [40.0, 100.0])
@pytest.mark.parametrize("surface", [HARD, WORST], ids=["500 N/m, 20 mm", "1000 N/m, 19 mm"])
def test_the_fastest_admitted_law_stays_below_the_bound_and_comes_near(force_max, surface):
    gains = gains_for(load_arm("ur5e"), F_D, force_max=force_max)
    peak = peak_of(full_speed(gains.speed), surface, seconds=0.04 / gains.speed)
    assert peak <= force_max
    assert peak >= F_D + 0.6 * (force_max - F_D) - 3.0


@pytest.mark.parametrize("seed", range(4))
def test_layers_within_the_cap_stay_below_the_bound(seed):
    rng = np.random.default_rng(seed)
    soft, hard, thickness = (
        10.0 ** rng.uniform(2.0, 3.5),
        10.0 ** rng.uniform(4.5, 6.0),
        rng.uniform(2e-3, 2e-2),
    )
    surface = layers(soft, thickness, hard)
    loop = ForceLoop(gains_for(load_arm("ur5e"), F_D, force_max=100.0))
    assert peak_of(loop.update, surface, seed=seed) <= 100.0


BROKEN = {
    "the speed is not limited": ({}, None),
    "the sensor shows a quarter of the force": ({"sensor": lambda force: 0.25 * force}, 60.0),
    "the surface comes towards the tip": ({"carried": 0.1}, 60.0),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_assumption_is_needed(name):
    options, force_max = BROKEN[name]
    loop = ForceLoop(gains_for(load_arm("ur5e"), F_D, force_max=force_max))
    assert peak_of(loop.update, HARD, **options) > (force_max or 100.0)


def test_residual_travel_is_above_the_lags_of_the_chain():
    """2 z/w + delay of the inner loop, 2/w of the low-pass, the age of a reading; with an interval, of the slowest."""
    arm = load_arm("ur5e")
    lags = 1.8 / (2 * math.pi * 10.0) + 0.01 + 2.0 / (2 * math.pi * 120.0) + 1.0 / 480.0
    assert lags < residual_travel(arm) < lags + 0.02
    assert residual_travel(arm) > known_lag(arm)


@pytest.mark.parametrize(("name", "coarse"), [("_TIMES", 4), ("_DECAYS", 3.0), ("_STEPS", 1), ("_PHASES", 2)])
def test_what_lies_between_and_beyond_the_samples_is_bounded(monkeypatch, name, coarse):
    """A bound of fewer times, cells, phases or decay times is no smaller: what is left out is added."""
    arm = load_arm("ur5e")
    fine = residual_travel(arm), ceiling._tip_speed(arm), ceiling._low_pass(arm)[1].sum()
    monkeypatch.setattr(ceiling, name, coarse)
    ceiling._low_pass.cache_clear()
    _, weights, rest = ceiling._low_pass(arm)
    rough = residual_travel(arm), ceiling._tip_speed(arm), weights.sum() + rest
    ceiling._low_pass.cache_clear()
    assert all(a >= 0.9985 * b for a, b in zip(rough, fine, strict=True)), (rough, fine)
    assert rough != fine


@pytest.mark.parametrize("damping", [0.2, 0.7, 1.0, 3.0])
@pytest.mark.parametrize("tick", [0.002, 0.05])
def test_the_bounds_of_a_step_response(damping, tick):
    """Against its exact discretisation, by phases and times of its own."""
    w, fine = 30.0, np.linspace(0.0, 6.0, 600_001)
    bound = ceiling._Response(w * w, 2 * damping * w)
    plant = scipy.signal.lti([w * w], [1.0, 2 * damping * w, w * w])
    _, answer = scipy.signal.step(plant, T=fine)
    every = round(tick / 1e-5)
    speed = np.abs(np.gradient(answer, 1e-5))
    assert bound.step(fine) == pytest.approx(answer, abs=1e-6)
    shown = max(tick * speed[k::every].sum() for k in range(0, every, max(every // 97, 1)))
    assert shown <= bound.speed(tick) < (1.05 if tick * w < 0.1 else 4.0) * shown
    late = round(ceiling._DECAYS / bound.decay * 1e5)
    left = max(tick * np.abs(1.0 - answer[late + k :: every]).sum() for k in range(0, every, 37))
    assert left <= bound.tail(tick) + 1e-12
    bend = np.abs(np.gradient(np.gradient(answer, 1e-5), 1e-5))[2:]
    assert max(tick * bend[k::every].sum() for k in range(0, every, 37)) <= bound.summed_acceleration(tick)


def test_a_higher_desired_force_lowers_the_speed():
    loop = ForceLoop(gains_for(load_arm("ur5e"), F_D, force_max=100.0))
    assert loop.gains.speed_at(60.0) < 0.6 * loop.gains.speed
    loop.desired = 60.0
    assert peak_of(loop.update, HARD, seconds=6.0) <= 100.0
    with pytest.raises(InputError, match="leaves no speed that keeps F_max = 100 N"):
        loop.desired = 99.0


def test_gains_keep_their_bound_and_their_certificate(tmp_path):
    plain = gains_for(load_arm("fr3"), F_D)
    gains = gains_for(load_arm("fr3"), F_D, force_max=100.0)
    ForceLoop(gains).save(tmp_path / "gains.toml")
    assert ForceLoop.load(tmp_path / "gains.toml").gains == gains
    assert plain.speed == 0.25 > gains.speed > gains.approach


@pytest.mark.parametrize(
    ("force_max", "reason"),
    [(15.0, "must be above 22.4 N"), (22.4, "must be above"), (200.0, "full scale of 100 N")],
)
def test_a_bound_that_cannot_be_kept_is_refused(force_max, reason):
    with pytest.raises(InputError, match=reason):
        gains_for(load_arm("ur5e"), F_D, force_max=force_max)


def test_the_price_of_the_bound_is_the_time_of_the_travel():
    prove = partial(tune, load_arm("ur5e"), F_D, prove_adapting=False)
    tuning = prove(force_max=100.0)
    seconds, stiffness = tuning.price
    assert seconds == pytest.approx(F_D / stiffness * (1.0 / tuning.gains.speed - 1.0 / 0.25))
    assert tuning.to_json()["force_max"] == 100.0
    assert type(tuning.to_json()["speed_m_s"]) is float  # NumPy's numbers are no JSON
    assert tuning.to_json()["price_s"] == seconds
    assert prove().price is None
