"""The first lines in Python: any table is a log, and what is wrong is one line in Python's words."""

import re
from importlib import import_module
from inspect import signature
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest

import palpate
from palpate.identification.options import OPTION_NAMES

LOG = Path(__file__).parents[1] / "examples/data/press.csv"
COLUMNS = {"time": "time_s", "position": "position_mm:mm", "force": "force_N:N"}


class Stream:
    """Only Arrow's stream, as any library may give it."""

    def __init__(self, frame):
        self._frame = frame

    def __arrow_c_stream__(self, requested_schema=None):
        return self._frame.__arrow_c_stream__(requested_schema)


TABLES = {
    "polars": pl.read_csv,
    "pandas": pd.read_csv,
    "stream": lambda path: Stream(pl.read_csv(path)),
    "mapping": lambda path: {name: column.to_numpy() for name, column in pd.read_csv(path).items()},
}


@pytest.fixture(scope="module")
def record():
    return palpate.read_log(LOG, **COLUMNS)


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_a_table_in_memory_is_read_as_its_file(table, record):
    own = palpate.read_log(table(LOG), **COLUMNS)
    assert own.units == record.units
    for name, column in record.columns.items():
        np.testing.assert_allclose(own[name], column, rtol=1e-12)


@pytest.mark.parametrize("table", [pl.read_csv, pd.read_csv])
def test_a_table_whose_names_leave_nothing_to_guess_is_read_alone(table, record):
    own = palpate.read_log(table(LOG))
    for name, column in record.columns.items():
        np.testing.assert_allclose(own[name], column, rtol=1e-12)


def test_a_record_goes_out_and_comes_back(record):
    for table in (record.to_polars(), record.to_pandas(), pl.DataFrame(record), Stream(record)):
        own = palpate.read_log(table)
        assert all(np.array_equal(own[name], record[name]) for name in record.columns)
    assert record.to_pandas().attrs["units"]["position"] == "m"


def test_dates_and_gaps_of_a_table():
    t = pd.date_range("2026-01-01", periods=5, freq="100ms")
    own = palpate.read_log(
        pd.DataFrame({"at": t, "x": [0.0, 1.0, None, 3.0, 4.0], "f": range(5)}),
        time="at",
        position="x:mm",
        force="f:N",
    )
    np.testing.assert_allclose(own["time"], [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6)
    assert np.isnan(own["position"][2])
    assert own["position"][3] == pytest.approx(3e-3)


def test_one_call_identifies_a_file_a_table_and_a_record(record):
    found = palpate.identify(record)
    for source, columns in ((LOG, COLUMNS), (str(LOG), COLUMNS), (pd.read_csv(LOG), COLUMNS)):
        assert palpate.identify(source, **columns).K.value == pytest.approx(found.K.value, rel=1e-9)


def test_a_lag_may_be_a_pair(record):
    assert palpate.identify(record, lag=(5e-3, 1e-3)) == palpate.identify(record, lag=5e-3, lag_std=1e-3)


def test_each_option_is_a_parameter_that_an_editor_completes():
    known = set(signature(palpate.identify).parameters)
    assert {*OPTION_NAMES} <= known
    assert {"time", "position", "force", "rate", "start", "end", "missing", "delimiter"} <= known


def test_parameters_by_name(record):
    found = palpate.identify(record)
    assert {"K", "B", "M", "plot"} <= {*dir(found)}
    assert found.K is found.parameters["K"]
    with pytest.raises(AttributeError, match="no 'E'; its parameters are K, B, M"):
        found.E  # noqa: B018


def test_pooling_takes_logs_and_identifications(record):
    pooled = palpate.pool([LOG, record, palpate.identify(record)], **COLUMNS)
    assert pooled.count == 3


WRONG = {
    "a word for a lag": (
        lambda r: palpate.identify(r, lag="5:ms"),
        "lag must be a number in SI units, got '5:ms'",
    ),
    "half a pair": (lambda r: palpate.identify(r, lag=(1,)), "lag must be a pair"),
    "no pair": (lambda r: palpate.identify(r, mass=0.1), "mass must be a pair"),
    "no log": (lambda r: palpate.identify(3), "not a int"),
    "no such option": (lambda r: palpate.identify(r, lagg=2.0), "did you mean 'lag'"),
    "columns of a record": (lambda r: palpate.identify(r, time="t"), "unknown option 'time'"),
    "a lag for reading": (lambda r: palpate.read_log(LOG, lag=3.0, **COLUMNS), "unknown option 'lag'"),
    "no names": (lambda r: palpate.read_log(pd.DataFrame({"a": [1.0], "b": [2.0]})), "say which are which"),
    "no time": (
        lambda r: palpate.read_log(LOG, position="position_mm:mm", force="force_N:N"),
        "with time=, or",
    ),
    "text": (
        lambda r: palpate.read_log({"time": ["a"], "position": [1.0], "force": [1.0]}),
        "no finite number",
    ),
    "lengths": (
        lambda r: palpate.read_log({"time": [0.0], "position": [1.0, 2.0], "force": [1.0]}),
        "one length",
    ),
    "one log": (lambda r: palpate.pool("press.csv"), "takes a list of logs"),
}


@pytest.mark.parametrize(("call", "message"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_one_line_in_pythons_words(call, message, record):
    with pytest.raises(palpate.InputError, match=message) as error:
        call(record)
    assert "\n" not in str(error.value)
    assert "--" not in str(error.value)


@pytest.mark.parametrize(
    "name",
    [
        "palpate.identify_log",
        "palpate.force.ForceLoop.load",
        "palpate.force.SlidingLoop.load",
        "palpate.identifiers.RecursiveLeastSquares.update",
        "palpate.maps.StiffnessMap.predict",
        "palpate.networks.Perceptron.learn",
        "palpate.robots.Planar3R.jacobian_dot",
        "palpate.robots.SerialArm.from_urdf",
        "palpate.robots.SerialArm.named",
    ],
)
def test_a_name_that_scripts_rely_on(name):
    """Whatever distribution it is of."""
    module, *rest = re.fullmatch(r"([a-z_.]+?)\.([A-Z]\w*|identify_log)(?:\.(\w+))?", name).groups()
    found = import_module(module)
    for part in filter(None, rest):
        found = getattr(found, part)
    assert callable(found)
