"""What an identification says in words: the sentence by cases made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.identification.causes import Code, Warn
from palpate.identification.result import DynamicStiffness, Identification, Traces, WorkingPoint
from palpate.identification.uncertainty import Measurement, Parameter, Verdict
from palpate.report.identification.words import sentence
from palpate.units import quantity

NONE = np.empty(0)


def parameter(value, half, verdict=Verdict.IDENTIFIED, unit="N/m", **budget):
    ends = None if value is None else (value - half, value + half)
    return Parameter(value, half / 1.96, ends, unit, verdict, "95 %: -1 to 2 N/m", budget)


def made(
    stiffness,
    *,
    K=Verdict.NOT_IDENTIFIABLE,
    source="octave",
    depth=0.00236,
    frequency=0.5726,
    octaves=(),
    **more,
):
    point = WorkingPoint(stiffness, 13.35, depth, frequency, source)
    traces = Traces(NONE, NONE, NONE, NONE, NONE, NONE)
    own = {"K": parameter(5200, 50, K), "B": parameter(None, 9, Verdict.NOT_IDENTIFIABLE, "N s/m")}
    fields = {"working_point": point, "dynamic_stiffness": octaves, "traces": traces} | more
    return Identification("kelvin-voigt", own, ((1.0, 2.0),), None, 0.99, 0.1, 100, (), **fields)


def test_what_is_known_where_what_limits_it_and_what_to_do():
    found = made(parameter(5243.7, 104.6, lag=100.0, noise=20.0))
    assert sentence(found) == (
        "The stiffness is 5240 ± 100 N/m at 13.3 N, 2.36 mm deep and 0.57 Hz; its uncertainty is mostly due to the"
        " uncalibrated lag of the force: calibrate the lag and give it with --lag."
    )


def test_a_wide_interval_is_said_to_be_one():
    found = made(parameter(5400, 1900, Verdict.NOT_IDENTIFIABLE), source="press")
    assert "5400 ± 1900 N/m, known to 35 % only, at 13.3 N" in sentence(found)
    assert "the change of the slope over the press" in sentence(found)


def test_a_model_that_knows_the_stiffness_better_is_heard_first():
    found = made(parameter(5400, 1900, Verdict.NOT_IDENTIFIABLE), K=Verdict.IDENTIFIED, source="press")
    assert sentence(found) == (
        "By the model kelvin-voigt the stiffness is 5200 ± 50 N/m; its uncertainty is mostly due to noise: press"
        " deeper, longer or more often; try palpate excite. Without a model it is 5400 ± 1900 N/m at 13.3 N, 2.36 mm"
        " deep and 0.57 Hz."
    )
    bare = made(parameter(None, 3, Verdict.NOT_IDENTIFIABLE), K=Verdict.IDENTIFIED)
    assert sentence(bare).startswith("By the model")
    assert "Without" not in sentence(bare)


def test_a_damper_leaves_with_its_loss():
    own = DynamicStiffness(1.1, Measurement.within(400.0, 2700.0), Measurement.within(15670.0, 330.0), 7, 0.9)
    found = made(parameter(None, 2700, Verdict.NOT_IDENTIFIABLE), frequency=1.1, octaves=(own,), depth=-1e-6)
    assert sentence(found).startswith("The log shows a loss of 15.67 ± 0.33 kN/m, but no stiffness at 13.3 N")
    assert "from the middle of the motion" in sentence(found)


def test_a_log_without_contact_says_why():
    warns = (
        Warn(
            Code.NO_CONTACT, "the force (rms 2 N) does not follow the position: there seems to be no contact"
        ),
    )
    found = replace(made(parameter(1, 1)), contacts=(), working_point=None, warnings=warns)
    assert sentence(found) == (
        "Nothing is touched in this log: the force (rms 2 N) does not follow the position."
    )


def test_a_log_in_volts_has_no_units():
    found = made(parameter(2.5, 0.1, unit="1"))
    found = replace(found, traces=replace(found.traces, force_unit="1", position_unit="1"))
    assert "2.50 ± 0.10 at 13.3, 0.00236 deep and 0.57 Hz" in sentence(found)


@pytest.mark.parametrize(
    ("value", "unit", "half", "text"),
    [
        (46560.0, "N/m", 120.0, "46.56 ± 0.12 kN/m"),
        (5243.7, "N/m", 104.6, "5240 ± 100 N/m"),
        (2.5e8, "Pa", 1e7, "250 ± 10 MPa"),
        (0.0159, "N", None, "15.9 mN"),
        (0.00236, "m", None, "2.36 mm"),
        (3.8e-6, "m", None, "3.8 µm"),
        (0.05, "kg", None, "0.05 kg"),
        (2e5, "N/m^1.5", None, "200000 N/m^1.5"),
        (12345.0, "1", None, "12345"),
        (0.0, "N", None, "0 N"),
    ],
)
def test_a_quantity_has_the_prefix_that_keeps_it_short(value, unit, half, text):
    assert quantity(value, unit, half) == text
