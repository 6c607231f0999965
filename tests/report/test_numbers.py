"""Numbers as people read them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.units import between, plain, with_half


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (5195.28, 15.4, "5195 ± 15"),
        (5195.28, 1.54, "5195.3 ± 1.5"),
        (0.0251, 0.282, "0.03 ± 0.28"),
        (5195.28, 1540.0, "5200 ± 1500"),
        (9.99, 0.0996, "9.99 ± 0.10"),
        (-0.0004, 0.00012, "-0.00040 ± 0.00012"),
        (5.37549e-6, 3.1e-9, "(5.3755 ± 0.0031)·10⁻⁶"),
        (62345678.0, 12345.0, "(62.346 ± 0.012)·10⁶"),
        (5195.28, 0.0, "5195 ± ?"),
        (5195.28, math.nan, "5195 ± ?"),
    ],
)
def test_an_interval_has_two_digits_of_its_half_width(value, half, text):
    assert with_half(value, half) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(5195.28, "5195"), (62345.6, "62346"), (0.0251, "0.0251"), (None, "-"), (math.nan, "-"), (-0.5, "-0.5")],
)
def test_a_number_has_four_digits_where_they_mean_something(value, text):
    assert plain(value) == text


def test_the_ends_of_an_interval_differ_in_what_is_written():
    assert between(5172.9, 5210.2) == "5173 to 5210"
    assert between(0.00022572, 0.00022583) == "0.000225720 to 0.000225830"
    assert between(-1.0, 1.0) == "-1.0 to 1.0"


@given(st.floats(1e-9, 1e9), st.floats(1e-6, 10.0))
def test_what_is_written_is_the_number_to_a_tenth_of_its_half_width(value, share):
    """Two digits of the half-width: so the value is off by at most half a unit of the second, a twentieth."""
    half = share * value
    text = with_half(value, half)
    written, power = text, 0
    if "·10" in text:
        written, raised = text.strip("(").split(")·10")
        power = int(raised.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    shown, shown_half = (float(part) * 10.0**power for part in written.split(" ± "))
    assert shown == pytest.approx(value, abs=0.0501 * half)
    assert shown_half == pytest.approx(half, rel=0.0501)
