"""What a log shows before any model, against surfaces whose dynamic stiffness and press are formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.problems import problem
from identification.synthetic_contacts import record
from palpate.identification import Verdict, identify
from palpate.identification.filters import low_passed
from palpate.identification.octaves import PERIODS
from palpate.identification.options import Lag, Options
from palpate.identification.press import find_press, gather_evidence
from palpate.identification.result import DynamicStiffness
from palpate.identification.slope import Loading, upper_slope
from palpate.identification.spectrum import dynamic_stiffness, working_point
from palpate.identification.steady_press import WINDOW, Curve, Slopes, SteadyPress, slopes_at
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.low_pass import LowPass

DT = 1e-3
COUNT = 6000
TIME = np.arange(COUNT) * DT
CUTOFF = 60.0


def kelvin_voigt(s, k=5000.0, b=40.0):
    return k + b * s


def standard_linear_solid(s, k=3000.0, k1=4000.0, tau=0.05):
    return k + k1 * tau * s / (1 + tau * s)


def answering(impedance, frequency, size=1e-3, noise=0.0, seed=0):
    """A steady motion of sines, and the force that answers it: never free, about 10 N."""
    omega = 2 * np.pi * np.asarray(frequency)
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, len(omega))
    turning = size / np.sqrt(len(omega)) * np.exp(1j * (np.outer(TIME, omega) + phase))
    force = 10 + (turning * impedance(1j * omega)).imag.sum(axis=1)
    return record(TIME, turning.imag.sum(axis=1), force + np.random.default_rng(seed).normal(0, noise, COUNT))


def seen(log, lag=0.0, lag_std=0.0, **said):
    asked = problem(log, lag, bonded=True, cutoff=CUTOFF, **said)
    return asked, dynamic_stiffness(asked, lag, lag_std)


def octave_frequencies(up_to):
    """Middles of octaves of a log of that length behind that filter [Hz], one of two.

    A block of four periods fits the longest contact, then half of it. A sine in the octave below would be at the edge
    of the next one, half in it.
    """
    asked, _ = seen(answering(kelvin_voigt, [1.0, 9.0]))
    length, found = len(asked.force), []
    while (f := PERIODS / (length * float(np.median(np.diff(asked.time))))) < up_to:
        found.append(f)
        length //= 2
    return np.array(found[::2])


def near(frequency, found):
    """The octaves that have these frequencies."""
    return [min(found, key=lambda own: abs(np.log(own.frequency / f))) for f in frequency]


@pytest.mark.parametrize("surface", [kelvin_voigt, standard_linear_solid])
def test_storage_and_loss_are_the_surfaces(surface):
    """A sine in the middle of octaves. Hann's window keeps their leakage into each other below a hundredth."""
    frequency = octave_frequencies(30.0)
    _, found = seen(answering(surface, frequency))
    for f, octave in zip(frequency, near(frequency, found), strict=True):
        assert octave.frequency == pytest.approx(f, rel=0.01)  # where the motion is, its neighbours' too
        truth = surface(2j * np.pi * f)
        assert complex(octave.storage, octave.loss) == pytest.approx(truth, rel=0.01)


def test_a_lag_is_taken_out_and_what_is_not_known_of_it_is_in_the_interval():
    """T late turns Z by w T: of K it makes a loss of -K w T."""
    frequency = octave_frequencies(15.0)
    on_time = answering(kelvin_voigt, frequency)
    late = record(TIME, on_time["position"], np.interp(TIME - 0.004, TIME, on_time["force"]))
    _, told = seen(late, 0.004)
    _, untold = seen(late, 0.0)
    _, unsure = seen(late, 0.0, 0.004)
    for f, one, other, wide in zip(
        frequency, *(near(frequency, own) for own in (told, untold, unsure)), strict=True
    ):
        omega = 2 * np.pi * f
        truth = kelvin_voigt(1j * omega)
        assert complex(one.storage, one.loss) == pytest.approx(truth, rel=0.01)
        turned = truth * np.exp(-1j * omega * 0.004)
        assert complex(other.storage, other.loss) == pytest.approx(turned, rel=0.01)
        assert abs(wide.loss - truth.imag) < wide.loss_half
        assert wide.loss_half >= 0.99 * 1.96 * omega * 0.004 * abs(wide.storage)


def test_half_widths_are_those_of_the_noise():
    """Over seeds, an octave with a sine in it holds the truth as often as it says."""
    frequency = octave_frequencies(15.0)
    inside = np.zeros((2, len(frequency)))
    runs = 40
    for seed in range(runs):
        _, found = seen(answering(kelvin_voigt, frequency, noise=1.0, seed=seed))
        for i, (f, octave) in enumerate(zip(frequency, near(frequency, found), strict=True)):
            truth = kelvin_voigt(2j * np.pi * f)
            inside[0, i] += abs(octave.storage - truth.real) < octave.storage_half
            inside[1, i] += abs(octave.loss - truth.imag) < octave.loss_half
    # 38 of 40 expected; four deviations less are 32.
    assert inside.min() >= 32, inside


def test_what_differs_between_blocks_widens_the_interval():
    """A surface that is a quarter stiffer in the second half: the interval holds the mean of both."""
    frequency = octave_frequencies(15.0)
    even = answering(kelvin_voigt, frequency, noise=0.02)
    grows = np.where(TIME[-1] / 2 > TIME, 1.0, 1.25)
    uneven = record(TIME, even["position"], 10 + grows * (even["force"] - 10))
    _, steady = seen(even)
    _, changing = seen(uneven)
    for one, other in zip(near(frequency[1:], steady), near(frequency[1:], changing), strict=True):
        assert other.storage_half > 2 * one.storage_half
        assert abs(other.storage - 1.125 * one.storage) < other.storage_half


def press_path(rise, hold=0.0, depth=2e-3, start=0.5, lead=-0.5e-3):
    """Down at a constant speed, held, and up at the same."""
    time = np.arange(int((2 * start + 2 * rise + hold) / DT)) * DT
    u = np.interp(time, [start, start + rise, start + rise + hold, start + 2 * rise + hold], [0, 1, 1, 0])
    return time, lead + (depth - lead) * u


def press(time, x, force, noise=1e-3, **said):
    asked = problem(record(time, x, force + np.random.default_rng(0).normal(0, noise, len(x))), 0.0, **said)
    return find_press(asked, None)


def test_a_press_in_steps_has_slopes_at_the_forces_of_all_of_them():
    time = np.arange(int(9.0 / DT)) * DT
    x = np.interp(
        time,
        [0.5, 1.0, 3.0, 3.2, 5.0, 5.2, 8.0, 8.5],
        [-0.5e-3, 1e-3, 1e-3, 1.6e-3, 1.6e-3, 2e-3, 2e-3, -0.5e-3],
    )
    depth = np.maximum(x, 0)
    found = press(time, x, 3000 * depth + 8e8 * depth**3)
    reached = np.array([own.force for own in found.tangent])
    at = np.interp(
        reached, 3000 * depth[: np.argmax(x)] + 8e8 * depth[: np.argmax(x)] ** 3, depth[: np.argmax(x)]
    )
    assert reached.min() < 8 < 10 < reached.max()  # the rests are at 3.8 N, at 8.1 N and at 12.4 N
    for own, truth in zip(found.tangent, 3000 + 2.4e9 * at**2, strict=True):
        assert abs(own.stiffness - truth) <= own.half < 0.1 * truth


def test_of_a_spring_the_press_is_one_line_and_nothing_is_lost():
    time, x = press_path(2.0)
    found = press(time, x, 5000 * np.maximum(x, 0))
    assert len(found.tangent) == 4
    for own in found.tangent:
        assert own.stiffness == pytest.approx(5000, rel=0.01)
        assert abs(own.stiffness - 5000) < max(own.half, 10)
    forces = [own.force for own in found.tangent]
    assert forces == sorted(forces)
    assert found.hysteresis_loss == pytest.approx(0.0, abs=0.01)
    assert found.relaxation is None
    np.testing.assert_allclose(found.loading[1], 5000 * (found.loading[0] - found.loading[0][0]), atol=0.8)


def test_of_a_power_law_the_tangent_grows_with_the_force():
    """f = c d^n has the slope n f/d = n c^(1/n) f^(1 - 1/n)."""
    time, x = press_path(2.0)
    c, n = 3e6, 1.5
    found = press(time, x, c * np.maximum(x, 0) ** n)
    for own in found.tangent:
        slope = n * c ** (1 / n) * own.force ** (1 - 1 / n)
        assert own.stiffness == pytest.approx(slope, rel=0.03)


@pytest.mark.parametrize("loss", [0.1, 0.5])
def test_the_work_that_does_not_come_back(loss):
    """On the unloading, every depth has a force that is smaller by one share."""
    time, x = press_path(2.0)
    out = np.arange(len(x)) > np.argmax(x)
    found = press(time, x, 5000 * np.maximum(x, 0) * np.where(out, 1 - loss, 1.0))
    assert found.hysteresis_loss == pytest.approx(loss, abs=0.03)


@pytest.mark.parametrize("tau", [0.1, 0.3])
def test_a_hold_relaxes_by_its_share_in_its_half_time(tau):
    time, x = press_path(0.3, hold=3.0)
    held = np.maximum(time - 0.8, 0)
    force = 5000 * np.maximum(x, 0) * (1 - 0.3 * (1 - np.exp(-held / tau)))
    found = press(time, x, force).relaxation
    # The filter, and the twentieth of the hold that a beginning is the median of, hide the first 0.1 s.
    hidden = 1 - np.exp(-0.1 / tau)
    assert 0.3 * (1 - hidden) < found.share < 0.305
    assert np.log(2) * tau == pytest.approx(found.half_time, abs=0.12)
    assert found.duration == pytest.approx(3.0, abs=0.2)


def octave(frequency, storage, half, share, loss=0.0):
    return DynamicStiffness(
        frequency, Measurement.within(storage, half), Measurement.within(loss, half), 9, share
    )


@pytest.fixture(scope="module")
def steady():
    """Steady contact without a press, and with one."""
    log = answering(kelvin_voigt, [1.0, 3.0, 9.0])
    asked, _ = seen(log)
    return asked


def headline(steady, *spectrum, tolerance=0.25):
    return working_point(steady, spectrum, Options.of(tolerance=tolerance), "N/m", 0.0)


def test_the_headline_is_the_octave_with_most_motion(steady):
    found = headline(steady, octave(1, 5000, 50, 0.3), octave(2, 5100, 50, 0.6), octave(4, 5200, 50, 0.1))
    assert (found.frequency_Hz, found.source) == (2, "octave")
    assert found.stiffness.value == 5100
    assert found.stiffness.ci95 == pytest.approx((5050, 5150), abs=2)  # and the way between two readings
    assert found.stiffness.verdict is Verdict.IDENTIFIED
    assert found.force_N == pytest.approx(10, abs=0.5)


def test_an_octave_that_falls_below_a_lower_one_is_passed_over(steady):
    """An inertia: K - M w^2."""
    found = headline(steady, octave(1, 5000, 50, 0.3), octave(2, 3000, 50, 0.6))
    assert found.frequency_Hz == 1
    within = headline(steady, octave(1, 5000, 1500, 0.3), octave(2, 3000, 700, 0.6))
    assert within.frequency_Hz == 2  # within both half-widths nothing fell


@pytest.mark.parametrize(
    ("half", "verdict"),
    [(1000, Verdict.IDENTIFIED), (2000, Verdict.NOT_IDENTIFIABLE), (6000, Verdict.NOT_IDENTIFIABLE)],
)
def test_the_headlines_verdict_is_its_intervals(steady, half, verdict):
    found = headline(steady, octave(1, 5000, half, 0.9)).stiffness
    assert found.verdict is verdict
    assert found.reason
    assert found.ci95 is None or found.ci95 == pytest.approx((5000 - half, 5000 + half), abs=1)


def test_the_press_is_the_headline_where_no_octave_is_known_well():
    time, x = press_path(2.0)
    force = 5000 * np.maximum(x, 0) + np.random.default_rng(0).normal(0, 0.02, len(x))
    found = identify(record(time, x, force), lag=0.0).working_point
    assert found.stiffness.ci95[0] < 5000 < found.stiffness.ci95[1]
    asked = problem(record(time, x, force), 0.0)
    poor = [octave(0.25, 5000, 4000, 0.9)]
    point = working_point(asked, poor, Options.of(), "N/m", 0.0)
    assert point.source == "press"
    assert point.stiffness.value == pytest.approx(5000, rel=0.02)


def in_steps(k, b, tau=0.1, rest=1.0):
    """Three advances that die out, 1 mm each, on a spring and a damper: the last one, and the whole loading."""
    t = np.arange(0.0, 3 * (5 * tau + rest), DT)
    since = np.mod(t, 5 * tau + rest)
    depth = 1e-3 * (t // (5 * tau + rest) + 1 - np.exp(-since / tau))
    speed = 1e-3 / tau * np.exp(-since / tau)
    columns = depth, speed, k * depth + b * speed, t
    last = (depth > 2e-3) & (since < 5 * tau)
    return Loading(*(own[last] for own in columns), Loading(*columns))


@pytest.mark.parametrize("damping", [0.0, 40.0])
def test_the_rests_of_a_press_in_steps_tell_its_speed_from_its_depth(damping):
    """Within one such advance the force has the slope k - b/tau: the interval reaches both, and no farther."""
    slope = upper_slope([in_steps(2000.0, damping)]).stiffness
    assert slope.value + slope.half >= 2000.0 * (1 - 1e-9)
    assert slope.value - slope.half <= (2000.0 - damping / 0.1) * (1 + 1e-9)
    assert slope.half == pytest.approx(damping / 0.1 / 2, rel=0.02, abs=1e-6)


def test_the_slope_is_of_the_last_rise():
    """A shell that snaps through at a third of its force: its peak is not the upper part, however noisy it is."""
    depth = np.linspace(0.0, 3e-3, 3000)
    force = np.interp(depth, [0, 1e-3, 2e-3, 3e-3], [0.0, 4.2, 2.0, 10.0])
    slope = upper_slope([Loading(depth, np.full(3000, 1e-3), force, np.arange(3000) * DT)])
    assert slope.stiffness.value == pytest.approx(8000.0, rel=1e-6)
    assert slope.force == pytest.approx(7.0, abs=0.1)
    assert slope.depth == pytest.approx(2.625e-3, abs=2e-5)


@pytest.mark.parametrize("play", [pytest.param(0.0, marks=pytest.mark.long), 5e-5])
def test_play_before_the_position_sensor_is_in_the_interval_of_an_octave(play):
    """Steps of 0.6 mm: over 0.55 mm that are read the force is a tenth stiffer, and only its friction says so."""
    rng = np.random.default_rng(3)
    time = np.arange(0, 12, DT)
    target = np.where(time < 0.5, -5e-4, 7e-4 + 3e-4 * np.sign(np.sin(2 * np.pi * 0.7 * time)))
    x, read = np.empty_like(time), np.empty_like(time)
    speed, at = 0.0, target[0]
    back = at
    for i, to in enumerate(target):
        speed += DT * (900 * (to - at) - 60 * speed)
        at += DT * speed
        back = min(max(back, at - play / 2), at + play / 2)
        x[i], read[i] = at, back
    force = 3000 * np.maximum(x, 0) + rng.normal(0, 0.01, len(x))
    found = identify(record(time, read + rng.normal(0, 2e-7, len(x)), force), lag=0.0).working_point
    low, high = found.stiffness.ci95
    assert found.source == "octave"
    assert low < 3000 < high
    assert high - low < (1500 if play else 60)


@pytest.mark.parametrize(("claimed", "half"), [(5000.0, 10.0), (9000.0, 4000.0)])
def test_strokes_at_constant_speed_are_no_more_certain_than_the_other_loadings_agree(claimed, half):
    """A surface that has yielded is stiffer in its second stroke, and that alone may go at constant speed."""
    time, x = press_path(2.0)
    force = 5000 * np.maximum(x, 0) + np.random.default_rng(0).normal(0, 0.02, len(x))
    asked = problem(record(time, x, force), 0.0)
    stroke = Measurement(claimed, {"noise": Contribution.within(10.0), "repetition": Contribution(0.0)})
    press = SteadyPress(Slopes(5.0, 1e-3, stroke, (claimed,), None, 1.0), (), *np.empty((2, 2, 1)))
    asked = replace(asked, contacts=replace(asked.contacts, press=press))
    found = gather_evidence(asked, Options.of(), "N/m")[2].stiffness
    assert found.value == claimed
    assert found.ci95 == pytest.approx((claimed - half, claimed + half), abs=60)


def jumping(rate, seconds, at):
    """A probe that rests, jumps from -1 to 5 mm between two readings, and rests; 1 kN/m from 0 on."""
    time = np.arange(int(rate * seconds)) / rate
    x = np.where(time < at, -1e-3, 5e-3)
    noise = 0.05 * np.random.default_rng(3).standard_normal(len(time))
    return record(time, x, 1000 * np.maximum(x, 0) + noise)


def test_a_jump_between_two_readings_tells_no_stiffness():
    """The touch lies in it: 5 N over 6 mm are 833 N/m, and the surface has 1000."""
    found = identify(jumping(100, 5, 2), lag=0.0).working_point
    assert found is None or found.stiffness.verdict is not Verdict.IDENTIFIED
    assert found is None or found.stiffness.ci95[0] < 1000 < found.stiffness.ci95[1]


def test_a_way_in_as_short_as_the_filter_is_held_against_its_readings():
    """10 rows a second of a press of one second that then relaxes: the filter makes the hold a part of it."""
    time = np.arange(0, 14, 0.1)
    x = np.interp(time, [0, 2, 3, 11, 12, 14], [-1e-3, -1e-3, 5e-3, 5e-3, -1e-3, -1e-3])
    depth = np.maximum(x, 0.0)
    branch = depth - low_passed(depth, LowPass.of_first_order(0.8), 0.1)
    log = record(time, x, np.maximum(1000 * depth + 1500 * branch, 0) + 1e-3 * np.sin(99 * time))
    found = identify(log, lag=0.0)
    rising = (time > 2.6) & (time < 3)
    truth = np.polyfit(depth[rising], log["force"][rising], 1)[0]
    assert found.working_point.source == "press"
    low, high = found.working_point.stiffness.ci95
    assert low < truth < high


def test_rows_between_two_readings_tell_nothing_of_a_press():
    """A spring of 1 kN/m by 50 readings a second in 1000 rows: where rows count, two intervals of five miss it."""
    rng = np.random.default_rng(0)
    fresh, rows = np.linspace(0.0, 1.0, 51), np.linspace(0.0, 1.0, 1001)
    holds = []
    for _ in range(40):
        force = np.interp(rows, fresh, 10.0 * fresh + 0.1 * rng.normal(size=len(fresh)))
        curve = Curve(rows, 0.01 * rows, force, 0.0 * rows, True, 0.05)
        own = slopes_at([curve], WINDOW, Lag()).stiffness
        holds.append(abs(own.value - 1000.0) < own.half)
    assert sum(holds) >= 34
