"""The figures of least squares: what they measure against cases with known answers, and that each figure stands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.instruments import analog_filter_190
from palpate.records import Record
from palpate_thesis.explanations import e1_why_negative_mass as bias
from palpate_thesis.figures import fig_3_05_07, fig_4_02_04
from palpate_thesis.figures.fig_6_01_05 import round_to
from palpate_thesis.least_squares import press_runs
from palpate_thesis.runs import Runs

TICK = 1e-3
M, B, K = 0.4, 150.0, 6000.0


def pushed(mass: float = M, seconds: float = 8.0) -> dict[str, np.ndarray]:
    """A push with a wobble and what a surface of M, B, K answers, without noise."""
    t = np.arange(round(seconds / TICK)) * TICK
    w = 2.0 * np.pi * 6.0
    decay = np.exp(-t / 0.1)
    x = 3e-3 * (1.0 - decay * np.cos(w * t))
    v = 3e-3 * decay * (np.cos(w * t) / 0.1 + w * np.sin(w * t))
    a = 3e-3 * decay * (np.cos(w * t) * (w * w - 100.0) - 20.0 * w * np.sin(w * t))
    return {"t": t, "x": x, "v": v, "a": a, "f": mass * a + B * v + K * x}


def as_press(s: dict[str, np.ndarray]) -> Record:
    columns = {name: np.zeros(len(s["t"])) for name in press_runs.COLUMNS}
    columns |= {"t": s["t"], "displacement": s["x"], "vx_raw": s["v"], "ax_measured": s["a"]}
    columns["force_measured"] = s["f"]
    return Record(columns, dict.fromkeys(columns, "1"))


def as_window(s: dict[str, np.ndarray], **changes) -> bias.RegressionWindow:
    values = {
        "x": s["x"],
        "counts": s["x"],
        "force": s["f"],
        "sampled": s["f"],
        "x0": 0.0,
        "wall": 0.0,
        "first": 5,
        "matched": np.zeros(3),
    }
    return bias.RegressionWindow(**{**values, **changes})


def test_a_press_begins_at_the_change_over_and_ends_where_contact_is_lost():
    phase = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0])
    columns = {name: np.arange(7.0) for name in press_runs.COLUMNS} | {"phase": phase}
    record = Record(columns, dict.fromkeys(columns, "1"))
    assert list(press_runs.contact(record)["t"]) == [0.0, 1.0, 2.0]
    assert list(press_runs.contact(record)["force"]) == [2.0, 3.0, 4.0]


@given(st.floats(0.05, 0.8), st.floats(0.02, 0.3))
def test_time_to_settle_of_an_exponential(constant, band):
    t = np.arange(4000) * TICK
    values = 1.0 + np.exp(-t / constant)
    end = values[-1]
    expected = -constant * np.log((1.0 + band) * end - 1.0)
    assert press_runs.settled_after(values, band=band) == pytest.approx(expected, abs=1.5 * TICK)


def test_time_to_settle_counts_the_last_leaving():
    values = np.ones(4000)
    assert press_runs.settled_after(values) == 0.0
    values[1500] = 2.0
    assert press_runs.settled_after(values) == pytest.approx(1.501)
    values[1500] = np.nan
    assert press_runs.settled_after(values) == 0.0


def test_a_mass_that_ends_near_zero_settles_on_the_scale_of_its_panel():
    t = np.arange(4000) * TICK
    mass = -30.0 * np.exp(-t / 0.02) - 0.5 - 0.1 * t
    assert press_runs.settled_after(mass) > 3.0
    assert press_runs.mass_settled_after(mass) == pytest.approx(0.051, abs=0.01)
    mass[:9] = 1e4  # before the signals' lag the estimate is arbitrary
    assert press_runs.mass_settled_after(mass) == pytest.approx(0.051, abs=0.01)


def test_printed_values_stand_for_all_that_rounds_to_them():
    least, most = round_to(7.2, 6.8, 0.05)
    assert least < 7.2 / 6.8 - 1.0 < most
    assert (round(6.8 * (1.0 + least + 1e-3), 1), round(6.8 * (1.0 + most - 1e-3), 1)) == (7.1, 7.3)
    least, most = round_to(44.0, 44.0, 0.5)
    assert least < 0.0 < most


def test_the_ratios_find_a_surface_without_noise_that_is_measured_from_its_face():
    light = press_runs.by_ratios(as_press(pushed(mass=0.0)))
    np.testing.assert_allclose(light["K"], K, rtol=1e-6)
    np.testing.assert_allclose(light["B"], B, rtol=1e-6)
    np.testing.assert_allclose(light["M"], 0.0, atol=1e-6)
    heavy = press_runs.by_ratios(as_press(pushed()))
    assert heavy["B"][1] == pytest.approx(B, rel=0.05)
    assert heavy["M"][1] == pytest.approx(M, rel=0.05)


def test_perfect_signals_find_the_surface_however_late_the_filters_are():
    found = bias.estimate(as_window(pushed()), ())
    np.testing.assert_allclose(found, (M, B, K), rtol=5e-3)


def test_a_late_force_shifts_mass_and_damping_as_the_formula_says():
    lag = 2e-3
    mass, damping, _ = bias.estimate(as_window(pushed()), (), lag)
    expected = bias.delayed_fit(M, B, K, lag)
    assert mass - M == pytest.approx(expected[0] - M, rel=0.15)
    assert damping - B == pytest.approx(expected[1] - B, rel=0.1)  # of third order is left
    assert mass < M < expected[0] + B * lag


def test_the_filters_gain_is_that_of_the_printed_transfer_function():
    from scipy.signal import freqs, freqz

    r1, r2, c1, c2 = fig_3_05_07.PARAMETERS.values()
    square = 1.0 / (r1 * r2 * c1 * c2)
    w = 2.0 * np.pi * fig_3_05_07.FREQUENCY
    _, printed = freqs([square], [1.0, (r1 + r2) / (r1 * r2 * c1), square], w)
    data = fig_3_05_07.Components().run(Runs((0,)))
    np.testing.assert_allclose(data.gain, 20.0 * np.log10(np.abs(printed)), atol=1e-9)
    assert np.interp(data.cutoff, fig_3_05_07.FREQUENCY, data.gain) == pytest.approx(-3.01, abs=0.02)
    part = analog_filter_190(200000.0)
    b, a = (part.b0, part.b1, part.b2), (1.0, part.a1, part.a2)
    _, stepped = freqz(b, a, worN=fig_3_05_07.FREQUENCY, fs=200000.0)
    np.testing.assert_allclose(data.gain, 20.0 * np.log10(np.abs(stepped)), atol=0.01)
    assert (data.low <= data.gain).all()
    assert (data.gain <= data.high).all()


@pytest.mark.parametrize("tone", [480.0, 960.0, 1010.0, 520.0])
def test_where_the_sampling_puts_a_tone(tone):
    sampled = np.sin(2.0 * np.pi * tone * TICK * np.arange(1000) + 0.3)
    assert fig_3_05_07.sampled_at(tone) == np.argmax(np.abs(np.fft.rfft(sampled)))
    assert fig_3_05_07.gain_at(960.0) == pytest.approx(-28.0, abs=0.5)


def test_a_clean_switch_keeps_contact_and_reaches_the_force():
    good = fig_4_02_04.Switch(true_force=4.6, lost=False, last=20.3, most=22.0)
    assert good.clean
    for change in ({"true_force": 0.0}, {"lost": True}, {"last": 17.5}, {"most": 26.0}):
        assert not good._replace(**change).clean
