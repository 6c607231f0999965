"""Logs as laboratories make them: a probe that bounces, a surface that moves, mains in the force, a lag far off."""

from __future__ import annotations

import numpy as np
import pytest
from foreign.cases import outcome, wrong_payload
from scipy.signal import butter, sosfilt

import palpate
from palpate.identification import Verdict
from palpate.records import Record
from palpate.report.identification.words import sentence

UNITS = {"time": "s", "position": "m", "force": "N"}
K, B = 4000.0, 5.0
YIELD = 1.2e-3  # depth [m]


def identified(t, x, f, **options):
    return palpate.identify(Record({"time": t, "position": x, "force": f}, UNITS), **options)


def in_range(number, low, high):
    return number.ci95[0] <= high and number.ci95[1] >= low


def risen(t, begin, seconds):
    """From 0 to 1 without a jump of speed or acceleration."""
    s = np.clip((t - begin) / seconds, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


@pytest.mark.parametrize(
    ("frequency", "rate"), [(12, 250), (20, 500), pytest.param(12, 1000, marks=pytest.mark.long)]
)
def test_a_probe_that_bounces_is_seen_to_leave_the_surface(frequency, rate):
    """A filter joins the touches; the readings before it do not."""
    t = np.arange(0, 8, 1 / rate)
    omega = 2 * np.pi * frequency
    x = -4e-3 + 5.2e-3 * np.clip((t - 0.3) / 0.6, 0, 1) + np.where(t > 1, 2e-3 * np.sin(omega * (t - 1)), 0.0)
    f = np.where(x > 0, np.maximum(K * x + B * np.gradient(x, t), 0), 0)
    found = identified(
        t, x, f + 0.01 * np.random.default_rng(0).standard_normal(len(t)), lag=0.0, lag_std=1e-4
    )
    assert in_range(found.working_point.stiffness, K, K)
    assert in_range(found.parameters["K"], K, K)


def test_the_stiffness_of_what_holds_the_probe_is_not_called_the_surfaces():
    """An arm of 1 kN/m slides over an uneven surface of 17 kN/m: force over position is the arm's, the sign turned."""
    rng = np.random.default_rng(0)
    t = np.arange(0, 20, 0.01)
    lines = np.fft.rfft(rng.standard_normal(len(t))) * np.exp(-((np.fft.rfftfreq(len(t), 0.01) / 0.4) ** 2))
    height = np.fft.irfft(lines, len(t))
    height *= 1e-3 / np.abs(height).max()
    asked = -0.01 + (0.01 + 20 / 1000 + 20 / 17e3) * np.clip((t - 1) / 1.5, 0, 1)
    x = np.where(asked <= height, asked, (1000 * asked + 17e3 * height) / 18e3)
    f = np.where(asked <= height, 0.0, 17e3 * (x - height)) + 0.02 * rng.standard_normal(len(t))
    found = identified(t, x, f, force_sign=1)
    own = found.working_point.stiffness
    assert own.verdict is not Verdict.IDENTIFIED
    assert in_range(own, -1000, -1000)
    assert "what holds the probe" in own.reason
    assert sentence(found).startswith("The force falls by ")


@pytest.mark.parametrize("tone", [0.06, *(pytest.param(t, marks=pytest.mark.long) for t in (0.0, 0.03))])
def test_mains_in_the_force_are_no_tool(tone):
    """At 49 rows a second, 50 Hz are 1 Hz, about as slow as the loading."""
    t = np.arange(0, 14, 1 / 49)
    x = -8e-3 + 11.4e-3 * (risen(t, 1, 1.2) - risen(t, 12.5, 1.0))
    x = x + np.where((t > 3) & (t < 12), 0.6e-3 * np.sin(2 * np.pi * 2.5 * t), 0.0)
    f = np.where(x > 0, np.maximum(1200 * x + 10 * np.gradient(x, t), 0), 0) + tone * np.sin(
        2 * np.pi * t + 0.5
    )
    found = identified(
        t, x, f + 0.003 * np.random.default_rng(1).standard_normal(len(t)), lag=0.0, lag_std=1e-4
    )
    assert "tool-inertia" not in found.codes
    assert in_range(found.working_point.stiffness, 1200, 1200)


def test_the_ways_in_know_of_a_lag_and_of_few_readings():
    t = np.arange(0, 3.2, 1 / 65)

    def depth(at):
        return -1e-3 + 2.5e-3 * (risen(at, 0.5, 1.0) - risen(at, 1.7, 1.0))

    f = np.maximum(20e3 * depth(t - 0.012), 0) + 0.02 * np.random.default_rng(1).standard_normal(len(t))
    found = identified(t, depth(t), f)
    assert found.press.tangent
    for slope in found.press.tangent:
        assert abs(slope.stiffness - 20e3) < slope.half


@pytest.mark.long  # the foreign simulator is compiled
def test_an_inertia_taken_off_twice_is_no_mass_behind_a_lag():
    """Two lags fit such a log, one of them with a mass of its own: the likelier one is found."""
    for trial in list(wrong_payload(None))[:2]:
        said, faults = outcome(trial)
        assert not faults, said


@pytest.mark.parametrize(
    ("rate", "frequency", "seed"),
    [(250, 2.3, 2), (250, 1.2, 0), pytest.param(1000, 2.3, 1, marks=pytest.mark.long)],
)
def test_a_spring_that_is_tapped_is_no_branch_that_relaxes_behind_a_lag(rate, frequency, seed):
    """Nobody told the lag: a branch whose time is a tap's does to a force what a lag does.

    In contact a tap is one sine, of which the position's last digit seems to tell K from M.
    """
    t = np.arange(0, 8, 1 / rate)
    x = 3.9e-3 * np.clip(np.sin(2 * np.pi * frequency * (t - 1)), 0, 1) ** 2 * ((t > 1) & (t < 7)) - 0.9e-3
    f = K * np.clip(x, 0, None) + 2e-3 * np.random.default_rng(seed).standard_normal(len(t))
    found = identified(t, np.round(x, 6), f)
    assert found.model != "standard-linear-solid"
    assert in_range(found.parameters["K"], K, K)
    assert in_range(found.working_point.stiffness, K, K)
    assert found.working_point.stiffness.budget["lag"] > 0


@pytest.mark.parametrize("damping", [200, pytest.param(400, marks=pytest.mark.long)])
def test_steps_that_a_damper_ends_are_not_the_air(damping):
    """At the deep end the force falls while the position still rises; the air is where the force hardly goes at all."""
    t = np.arange(0, 9, 1e-3)
    steps = np.repeat(np.random.default_rng(0).integers(0, 2, 302) * 2.0 - 1, 30)[: len(t)]
    steps = sosfilt(butter(2, 60, fs=1000, output="sos"), steps) * ((t > 1.5) & (t < 7.4))
    pressed = np.clip((t - 1) / 0.3, 0, 1) * np.clip((8 - t) / 0.4, 0, 1)
    x = 1.25e-3 * (-0.2 + 0.85 * pressed + 0.2 * steps)
    f = np.where(x > 0, np.maximum(1e4 * x + damping * np.gradient(x, t), 0), 0)
    found = identified(t, x, f + 0.006 * np.random.default_rng(1).standard_normal(len(t)))
    assert not {"force-sign-reversed", "position-sign-reversed"} & set(found.codes)
    assert in_range(found.working_point.stiffness, 1e4, 1e4)


def test_a_shaken_contact_gives_back_no_more_than_it_takes():
    """The share is of all work put in, and a spring beside a damper loses what the damper does in all cycles."""
    t = np.arange(0, 10, 1e-3)
    on = np.clip((t - 1) / 0.5, 0, 1) * np.clip((9.5 - t) / 0.5, 0, 1)
    x = -5e-4 + 2.5e-3 * on + np.where((t > 2) & (t < 8), 5e-4 * np.sin(16 * np.pi * t), 0.0)
    v = np.gradient(x, t)
    f = np.where(x > 0, np.maximum(K * x + 30 * v, 0), 0)
    work, inside = f * v, x > 0
    share = 1 + work[inside & (v < 0)].sum() / work[inside & (v > 0)].sum()
    found = identified(t, x, f + 0.01 * np.random.default_rng(0).standard_normal(len(t)), lag=0.0)
    assert found.press.hysteresis_loss == pytest.approx(share, rel=0.1)


def test_a_lag_that_was_told_is_said_again_with_the_filter_in_it():
    t = np.arange(0, 4, 1e-3)
    x = 2e-3 + 1e-3 * np.sin(2 * np.pi * (0.5 + 2 * t) * t)
    low_pass = butter(1, 40, fs=1000, output="sos")
    f = sosfilt(low_pass, K * x) + 0.01 * np.random.default_rng(0).standard_normal(len(t))
    found = identified(t, x, f, lag=4e-3, lag_std=1e-4, force_filter="butterworth1:40", bonded=True)
    assert (found.lag.value, found.lag.kind) == (pytest.approx(4e-3), "told")


def swept(*low_passes, mass=0.0, noise=0.01):
    """A spring with a mass, swept from 0.5 to 6.5 Hz, behind low-passes (order, cut-off in Hz), or 20 ms late."""
    fine = np.arange(0, 10, 1e-4)
    x = 1e-3 * np.sin(2 * np.pi * (0.5 + 0.3 * fine) * fine)
    force = K * x + mass * np.gradient(np.gradient(x, fine), fine)
    for order, cutoff in low_passes:
        force = sosfilt(butter(order, cutoff, fs=1e4, output="sos"), force)
    read = (force if low_passes else np.roll(force, 200))[::10]
    return fine[::10], x[::10], read + noise * np.random.default_rng(0).standard_normal(len(read))


def test_a_low_pass_that_only_its_lag_was_told_of_is_no_mass():
    """A spring behind 16 Hz of first order follows like one with a mass of K lag^2/2, a delay like none."""
    log, told = swept((1, 16)), {"lag": 1 / (2 * np.pi * 16), "bonded": True, "model": "kelvin-voigt-mass"}
    alone = identified(*log, **told).parameters["M"]
    assert in_range(alone, 0, 0)
    assert (*alone.budget,)[0] == "low-pass"
    both = identified(*log, **told, force_filter="butterworth1:16")
    assert "low-pass" not in both.parameters["M"].budget


_OF_20_MS = 1 / (2 * np.pi * 0.02)


@pytest.mark.parametrize(
    "low_passes",
    [
        [(1, _OF_20_MS)],
        [(1, 4 * _OF_20_MS)] * 4,
        *([(n, _OF_20_MS / np.sin(np.pi / 2 / n))] for n in (2, 3, 4)),
    ],
    ids=["first order", "four of it", "Butterworth 2", "3", "4"],
)
@pytest.mark.parametrize("noise", [0.001, 0.03])
def test_a_low_pass_is_not_taken_for_a_delay(low_passes, noise):
    """Each delays by 20 ms, and none with 0.1 kg shows that mass."""
    found = identified(*swept(*low_passes, mass=0.1, noise=noise), lag=0.02, bonded=True).parameters["M"]
    assert found.verdict is Verdict.NOT_IDENTIFIABLE
    assert in_range(found, 0.1, 0.1)


def test_a_lag_that_is_told_to_be_no_low_pass_leaves_the_mass_its_own_interval():
    """Where the noise hides what a low-pass would do, it costs most of the mass' interval, unless there is none."""
    told = {"lag": 0.02, "bonded": True, "model": "kelvin-voigt-mass"}
    log = swept(mass=0.1, noise=0.03)
    alone, none = (identified(*log, **told, force_filter=own).parameters["M"] for own in (None, "none"))
    assert (*alone.budget,)[0] == "low-pass"
    assert alone.verdict is not Verdict.IDENTIFIED
    assert "low-pass" not in none.budget
    assert in_range(none, 0.1, 0.1)
    assert none.verdict is Verdict.IDENTIFIED


@pytest.mark.parametrize("mass", [-0.1, pytest.param(-0.3, marks=pytest.mark.long)])
def test_a_low_pass_that_nobody_gave_excuses_no_mass_below_zero(mass):
    """It adds up to K lag^2/2 = 0.2 kg to what is seen of a mass, and takes nothing from it."""
    fine = np.arange(0, 10, 1e-4)
    x = 1e-3 * np.sin(2 * np.pi * (0.5 + 0.3 * fine) * fine)
    v = np.gradient(x, fine)
    read = np.roll(1000 * x + 5 * v + mass * np.gradient(v, fine), 200)[::10]
    noise = 0.001 * np.random.default_rng(0).standard_normal(len(read))
    found = identified(fine[::10], x[::10], read + noise, lag=0.02, lag_std=1e-4, bonded=True)
    assert found.parameters["M"].verdict is Verdict.REJECTED
    assert found.parameters["B"].verdict is not Verdict.IDENTIFIED


@pytest.mark.parametrize(
    ("model", "name", "least"), [("standard-linear-solid", "tau", 1e-9), ("hunt-crossley", "n", 0.5)]
)
@pytest.mark.parametrize("seed", [1, 2, 7])
def test_an_estimate_is_within_the_limits_of_its_model(model, name, least, seed):
    t = np.arange(0, 1.5, 4e-3)
    x = 1e-3 * np.sin(2 * np.pi * t) - 2e-4
    noise = 0.5 * np.random.default_rng(seed).standard_normal(len(t))
    value = identified(t, x, 2000 * np.maximum(x, 0) + noise, lag=0.0, model=model).parameters[name].value
    assert value is None or value >= least


def presses(*stiffness, back=2.0, soft=0.0):
    """One press of 4 mm after another, each on a surface of its own, with 2 mm of free motion before."""
    ends = np.cumsum([0.5, *(s for _ in stiffness for s in (3.0, back, 0.5))])
    x = np.interp(t := np.arange(0, ends[-1], 0.004), ends, [-2e-3, *(4e-3, -2e-3, -2e-3) * len(stiffness)])
    if soft:
        window = np.ones(int(soft / 0.004)) / int(soft / 0.004)
        x = np.convolve(np.pad(x, len(window), mode="edge"), window, "same")[len(window) : -len(window)]
    which = np.minimum((t / (3.5 + back)).astype(int), len(stiffness) - 1)
    f = np.array(stiffness)[which] * np.maximum(x, 0)
    return t, x, f + 0.02 * np.random.default_rng(0).standard_normal(len(t))


def test_presses_on_two_surfaces_are_not_one_stiffness():
    """The softer press reaches less than half of the other's force, and was left out without a word."""
    found = identified(*presses(4000.0, 1200.0))
    assert found.parameters["K"].verdict is not Verdict.IDENTIFIED
    assert found.working_point.each == pytest.approx([4000, 1200], rel=0.03)
    assert sentence(found).startswith("2 presses differ, 3981 N/m, 1201 N/m at ")
    assert "--start" in sentence(found)
    assert identified(*presses(4000.0, 4000.0)).parameters["K"].value == pytest.approx(4000, rel=0.01)


def test_a_return_may_be_at_any_speed():
    """A fast return that speeds up and slows down all the way took the press' own loading with it."""
    found = identified(*presses(2500.0, back=0.8, soft=0.35))
    assert found.working_point.source == "press"
    assert in_range(found.working_point.stiffness, 2500, 2500)
    assert found.parameters["K"].verdict is Verdict.IDENTIFIED


def test_a_tangent_beside_a_yield_is_that_of_its_own_side():
    """A curve of degree eight over both sides rings beside the corner, by more than its own noise."""
    t, x, f = presses(20e3)
    top = int(np.argmax(x))
    yielded = np.where(x > YIELD, 20e3 * YIELD + 3e3 * (x - YIELD), f)[:top]
    found = identified(t[:top], x[:top], yielded + 0.02 * np.random.default_rng(1).standard_normal(top))
    own = found.working_point
    assert own.force_N > 20e3 * YIELD
    assert in_range(own.stiffness, 3e3, 3e3)


def test_touches_that_are_too_short_are_touches():
    t = np.arange(0, 4, 0.02)
    x = -2e-3 + 5e-3 * np.exp(-(((t - 2) / 0.15) ** 2))
    f = 3000 * np.maximum(x, 0) + 0.01 * np.random.default_rng(0).standard_normal(len(t))
    assert sentence(identified(t, x, f)).startswith("The contacts in this log are too short: the longest")


def test_a_lag_that_nobody_knows_does_not_widen_a_stiffness_that_rests_on_slow_motion():
    """The most excited octave is known to 700 N/m behind a lag of 5 ± 15 ms, and the model's K to 10 N/m."""
    rng, t = np.random.default_rng(0), np.arange(0, 14, 0.004)
    tones = sum(np.sin(2 * np.pi * w * t + rng.uniform(0, 6)) for w in np.linspace(0.3, 8, 20))
    x = (
        -2e-3
        + 3.6e-3 * (risen(t, 0.5, 1) - risen(t, 13, 0.7))
        + 1.5e-4 * tones * (risen(t, 1.5, 0.5) - risen(t, 12.4, 0.5))
    )
    f = np.where(x > 0, np.maximum(5200 * x + 40 * np.gradient(x, t), 0), 0)
    found = identified(t, x, f + 0.05 * rng.standard_normal(len(t)))
    assert sentence(found).startswith("By the model kelvin-voigt the stiffness is 5")
    assert in_range(found.parameters["K"], 5200, 5200)
    assert found.parameters["K"].std < 30
