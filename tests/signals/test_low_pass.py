"""A sensor's low-pass against scipy's analog Butterworth, its stated lag against its own phase, and its text."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from palpate.errors import InputError
from palpate.signals.low_pass import LowPass

TWO = LowPass(((3, 120.0), (2, 45.0)))
sections = st.lists(
    st.tuples(st.integers(1, 10), st.floats(1e-3, 1e6, allow_subnormal=False)), max_size=3
).map(tuple)


def scipys(order, cutoff):
    """Zeros, poles and gain of the analog filter."""
    return signal.butter(order, 2 * np.pi * cutoff, analog=True, output="zpk")


@pytest.mark.parametrize("order", range(1, 11))
def test_it_is_the_butterworth_of_scipy(order):
    omega = 2 * np.pi * np.geomspace(0.1, 1e4, 200)
    _, theirs = signal.freqs_zpk(*scipys(order, 120.0), worN=omega)
    # Relative: ten poles multiplied, some rounding each; far beyond the cut-off the gain itself is 1e-20.
    np.testing.assert_allclose(LowPass(((order, 120.0),)).at(omega), theirs, rtol=1e-12)


def test_sections_stand_one_after_the_other():
    omega = 2 * np.pi * np.linspace(0, 400, 41)
    one, other = (LowPass((section,)) for section in TWO.sections)
    np.testing.assert_allclose(TWO.at(omega), one.at(omega) * other.at(omega), rtol=1e-14)
    assert TWO.lag == pytest.approx(one.lag + other.lag, rel=1e-14)
    assert TWO.roll_off == 5
    assert TWO.cutoff == 45.0
    assert TWO.decay == min(one.decay, other.decay)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_the_gain_has_the_shape_of_the_frequencies_and_is_one_at_rest(shape):
    gain = TWO.at(np.zeros(shape))
    assert np.shape(gain) == shape
    np.testing.assert_allclose(gain, 1.0, rtol=1e-14)


@given(sections)
def test_the_lag_is_the_slope_of_the_phase_at_rest(chain):
    low_pass = LowPass(chain)
    # Against the lowest cut-off w is so small that the phase is straight: its bend is of the order of (w/cutoff)^2.
    w = 1e-4 * 2 * math.pi * min(low_pass.cutoff, 1e6)
    slope = -np.angle(low_pass.at(np.array(w))) / w
    assert slope == pytest.approx(low_pass.lag, rel=1e-6, abs=1e-300)


@given(sections.filter(bool))
def test_the_decay_is_that_of_the_slowest_pole(chain):
    poles = np.concatenate([scipys(*section)[1] for section in chain])
    assert LowPass(chain).decay == pytest.approx(-poles.real.max(), rel=1e-9)


def test_none_passes_everything_at_once():
    nothing = LowPass.parse("none")
    assert nothing == LowPass()
    assert nothing.lag == 0.0
    assert nothing.roll_off == 0
    assert nothing.cutoff == nothing.decay == math.inf
    np.testing.assert_array_equal(nothing.at(np.array([0.0, 1e5])), 1.0)


@given(sections)
def test_its_text_reads_back_to_nine_digits(chain):
    back = LowPass.parse(str(LowPass(chain)))
    assert [order for order, _ in back.sections] == [order for order, _ in chain]
    # The bench names its own sensor's filter with nine digits.
    np.testing.assert_allclose([c for _, c in back.sections], [c for _, c in chain], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "chain"),
    [
        ("butterworth3:120", ((3, 120.0),)),
        ("  Butterworth3 : 120 Hz ", ((3, 120.0),)),
        ("butterworth3:1.2e+2+butterworth2:45", ((3, 120.0), (2, 45.0))),
        ("butterworth2:4.5e1hz+butterworth1:10", ((2, 45.0), (1, 10.0))),
        ("NONE", ()),
    ],
)
def test_texts(text, chain):
    assert LowPass.parse(text).sections == chain


@pytest.mark.parametrize(
    "text",
    [
        "", "butterworth", "butterworth3", "butterworth3:", "butterworth:120", "bessel3:120", "3:120", "120",
        "butterworth3:120+", "butterworth3:120+none", "butterworth3:120,butterworth2:120", "butterworth3:1.2.3",
        "butterworth3:e", "butterworth-3:120", "butterworth3.5:120", "butterworth3:120rad", "none+none",
    ],
)  # fmt: skip
def test_another_text_is_refused_with_the_form_it_should_have(text):
    with pytest.raises(InputError, match=r"butterworth3:120 \(order and cut-off in Hz\).*got '") as refused:
        LowPass.parse(text)
    assert repr(text) in str(refused.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("butterworth11:120", "order of 1 to 10, got 11"),
        ("butterworth0:120", "order of 1 to 10, got 0"),
        ("butterworth3:0", "cut-off above 0 Hz, got 0"),
        ("butterworth3:-120", "cut-off above 0 Hz, got -120"),
        ("butterworth3:1e999", "cut-off above 0 Hz, got inf"),
    ],
)
def test_a_number_out_of_range_is_named(text, says):
    with pytest.raises(InputError, match=says):
        LowPass.parse(text)
