from __future__ import annotations

import pytest

from palpate.errors import InputError
from palpate.units import UNITS, impedance_units, split_spec, unit, unit_in_name


@pytest.mark.parametrize(
    ("symbol", "factor", "si"),
    [
        ("mm", 1e-3, "m"),
        ("g", 9.80665e-3, "N"),
        ("lbf", 4.4482216, "N"),
        ("ms", 1e-3, "s"),
        ("1", 1.0, "1"),
        ("µm", 1e-6, "m"),
    ],
)
def test_units_lead_to_si(symbol, factor, si):
    assert unit(symbol).factor == pytest.approx(factor)
    assert unit(symbol).si == si


def test_si_units_have_factor_one():
    for symbol, own in UNITS.items():
        if symbol == own.si:
            assert own.factor == 1.0


def test_an_unknown_unit_is_refused_with_a_list():
    with pytest.raises(InputError, match=r"unknown unit 'furlong'.*mm"):
        unit("furlong")


@pytest.mark.parametrize(
    ("spec", "parts"),
    [("x", ("x", None)), ("x:mm", ("x", "mm")), ("a:b:mm", ("a:b", "mm")), ("3:1", ("3", "1"))],
)
def test_a_spec_is_a_name_and_a_unit(spec, parts):
    assert split_spec(spec) == parts


def test_a_spec_without_a_name_is_refused():
    with pytest.raises(InputError, match="has no name"):
        split_spec(":mm")


def test_a_unit_in_a_name_must_fit():
    assert unit_in_name("position_mm", "length") == "mm"
    assert unit_in_name("pos [um]", "length") == "um"
    assert unit_in_name("Fz, gf", "force") == "gf"
    assert [unit_in_name(name, "time") for name in ("Millis", "elapsedMicros", "ms")] == ["ms", "us", "ms"]
    assert unit_in_name("force_mN", "length") is None
    assert unit_in_name("position", "length") is None


def test_plain_numbers_have_results_without_units():
    assert set(impedance_units("1", "1").values()) == {"1"}
    assert impedance_units("N", "m") == {"K": "N/m", "B": "N s/m", "M": "kg"}
