"""The output of `palpate identify --json`, read back: numbers of any length."""

import pytest

from palpate.cli.options.common import read_found
from palpate.errors import InputError
from palpate.export.contact import contact_from


@pytest.mark.parametrize("digits", [18, 19, 400, 5000])
def test_a_whole_number_of_any_length_is_a_number(digits, tmp_path):
    path = tmp_path / "found.json"
    path.write_text(f'{{"n": {"9" * digits}, "m": -{"9" * digits}}}')
    found = read_found(path)
    assert float(found["n"]) == float("9" * digits)
    assert float(found["m"]) == -float("9" * digits)
    assert isinstance(found["n"], int) == (digits <= 18)


def test_what_is_no_object_is_a_line(tmp_path):
    path = tmp_path / "found.json"
    for text in ("[" * 100_000, "[]", "nonsense", '{"a": 1'):
        path.write_text(text)
        with pytest.raises(InputError, match=r"found\.json"):
            read_found(path)


@pytest.mark.parametrize("unit", [[], {}, ["N/m"], 3, True])
def test_a_unit_that_is_no_text_is_a_line(unit):
    K = {"value": 5e3, "ci95": [4900.0, 5100.0], "unit": unit, "verdict": "identified", "reason": ""}
    with pytest.raises(InputError, match="K is in"):
        contact_from({"model": "kelvin-voigt", "parameters": {"K": K}}, "found.json", damping=50.0)
