"""The figures of least squares: what they measure against cases with known answers, and that each figure stands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.identifiers import RecursiveLeastSquares
from palpate.instruments import analog_filter_190
from palpate.records import Record
from palpate_thesis.explanations import e1_why_negative_mass as bias
from palpate_thesis.figures import fig_3_05, fig_3_07
from palpate_thesis.figures import fig_6_02_05 as steady_state
from palpate_thesis.least_squares import press_runs
from palpate_thesis.runs import Runs

TICK = 1e-3
M, B, K = 0.4, 150.0, 6000.0


@pytest.fixture(scope="module")
def foam() -> Record:
    """One run on the plain foam."""
    return Runs((3,)).record(press_runs.PLAIN)


@pytest.fixture(scope="module")
def press(foam) -> Record:
    return press_runs.contact(foam)


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
        "sensor": (120.0, 480.0),
        "cutoffs": (120.0, 35.0),
        "matched": np.zeros(3),
    }
    return bias.RegressionWindow(**{**values, **changes})


def test_the_running_batch_solution_is_the_benchs_recursion(press):
    phi, force = press_runs.thesis_signals(press)
    theta = press_runs.trajectory(phi, force, (0.0, 0.0, 2e5), (1e10,) * 3)
    for i, key in enumerate("MBK"):
        np.testing.assert_allclose(theta[50:, i], press[f"{key}_thesis"][50:], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("covariance", [(1e2,) * 3, (1e6,) * 3, (1e2, 1e6, 1e10)])
def test_the_running_batch_solution_is_the_recursion_for_any_start(press, covariance):
    phi, force = (values[:400] for values in press_runs.thesis_signals(press))
    start = (0.1, 20.0, 2e4)
    recursion = RecursiveLeastSquares(start, np.diag(covariance))
    recursion.update_many(phi, force)
    theta = press_runs.trajectory(phi, force, start, covariance)
    np.testing.assert_allclose(theta[-1], recursion.theta, rtol=1e-6)


@given(st.floats(0.05, 0.8), st.floats(0.02, 0.3))
def test_time_to_settle_of_an_exponential(constant, band):
    t = np.arange(4000) * TICK
    values = 1.0 + np.exp(-t / constant)
    end = values[-1]
    expected = -constant * np.log((1.0 + band) * end - 1.0)
    assert press_runs.settled_after(values, band=band) == pytest.approx(expected, abs=1.5 * TICK)


def test_the_ratios_find_a_surface_without_noise_that_is_measured_from_its_face():
    light = steady_state.by_ratios(as_press(pushed(mass=0.0)))
    np.testing.assert_allclose(light["K"], K, rtol=1e-6)
    np.testing.assert_allclose(light["B"], B, rtol=1e-6)
    np.testing.assert_allclose(light["M"], 0.0, atol=1e-6)
    heavy = steady_state.by_ratios(as_press(pushed()))
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

    r1, r2, c1, c2 = fig_3_07.PARAMETERS.values()
    square = 1.0 / (r1 * r2 * c1 * c2)
    w = 2.0 * np.pi * fig_3_07.FREQUENCY
    _, printed = freqs([square], [1.0, (r1 + r2) / (r1 * r2 * c1), square], w)
    data = fig_3_07.run(Runs((0,)))
    np.testing.assert_allclose(data.gain, 20.0 * np.log10(np.abs(printed)), atol=1e-9)
    assert np.interp(data.cutoff, fig_3_07.FREQUENCY, data.gain) == pytest.approx(-3.01, abs=0.02)
    part = analog_filter_190(200000.0)
    b, a = (part.b0, part.b1, part.b2), (1.0, part.a1, part.a2)
    _, stepped = freqz(b, a, worN=fig_3_07.FREQUENCY, fs=200000.0)
    np.testing.assert_allclose(data.gain, 20.0 * np.log10(np.abs(stepped)), atol=0.01)
    assert (data.low <= data.gain).all()
    assert (data.gain <= data.high).all()


def test_where_the_sampling_puts_a_tone():
    bins, lines = fig_3_05.tones_sampled()
    at = {name: float(bins[int(np.argmax(line))]) for name, line in lines.items()}
    assert at == {"480 Hz": 480.0, "480 Hz, filtered": 480.0, "960 Hz": 40.0, "960 Hz, filtered": 40.0}
    assert lines["960 Hz"].max() == pytest.approx(fig_3_05.AMPLITUDE, rel=1e-3)
    assert 0.0 < lines["960 Hz, filtered"].max() < 0.1 * fig_3_05.AMPLITUDE
