"""Every public value in a line and for a notebook."""

from pathlib import Path

import pytest

import palpate

LOG = Path(__file__).parents[2] / "examples/data/press.csv"


@pytest.fixture(scope="module")
def found():
    return palpate.identify(LOG, time="time_s", position="position_mm:mm", force="force_N:N")


def test_a_parameter_says_number_interval_and_verdict(found):
    half = (found.K.ci95[1] - found.K.ci95[0]) / 2
    assert repr(found.K) == f"<Parameter: {found.K.value:.0f} ± {half:.0f} N/m, identified>"
    low, high = (f"{end:.2g}" for end in found.M.ci95)
    assert repr(found.M) == f"<Parameter: {low} to {high} kg, not identifiable>"
    assert "5236 ± 61 N/m" in repr(found.working_point)


def test_text_has_no_codes_of_a_terminal(found, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as a notebook's kernel does
    assert "x1b" not in str(found)


def test_text_is_titled_by_the_file(found):
    assert str(found).splitlines()[0].endswith("press.csv")


def test_advice_in_python_names_the_keyword(found):
    assert "lag=" in found._repr_html_()
    assert "lag=(0, STD)" in str(found)
    for view in (found._repr_html_(), str(found), repr(found)):
        assert "--lag" not in view
        assert "--robot-stiffness" not in view


def test_a_strangers_name_stays_text(found):
    from dataclasses import replace

    bad = replace(found.K, unit="N\x1b[31m", reason="<script>alert(1)</script>\x1b[31m")
    assert "N" in repr(bad)
    assert "\x1b" not in repr(bad)
