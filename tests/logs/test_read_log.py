from __future__ import annotations

import gzip
from datetime import datetime, timedelta

import numpy as np
import polars
import pytest

from palpate.errors import InputError
from palpate.logs import read_log, read_record, write_record
from palpate.logs.tables.sheet import find_sentinel
from palpate.records import Record

COLUMNS = {"time": "t", "position": "x:mm", "force": "f:mN"}


def write(path, rows, header="t,x,f", delimiter=","):
    lines = [header.replace(",", delimiter)] if header else []
    lines += [delimiter.join(str(cell) for cell in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def rows(n=30):
    return [(round(0.01 * k, 3), k + 0.5, 10 * k) for k in range(n)]


def test_units_become_si_and_time_starts_at_zero(tmp_path):
    log = write(tmp_path / "a.csv", [(1743486221.5 + t, x, f) for t, x, f in rows()])
    record = read_log(log, **COLUMNS)
    assert record.units == {"time": "s", "position": "m", "force": "N"}
    np.testing.assert_allclose(record["position"], 1e-3 * (np.arange(30) + 0.5))
    np.testing.assert_allclose(record["force"], 1e-2 * np.arange(30))
    np.testing.assert_allclose(record["time"], 0.01 * np.arange(30), atol=1e-6)
    assert record.meta["start_s"] == pytest.approx(1743486221.5)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", " "])
def test_the_delimiter_is_found(tmp_path, delimiter):
    log = write(tmp_path / "a.csv", rows(), delimiter=delimiter)
    np.testing.assert_allclose(read_log(log, **COLUMNS)["force"], 1e-2 * np.arange(30))


def test_columns_aligned_with_several_spaces(tmp_path):
    log = tmp_path / "a.txt"
    log.write_text("".join(f"{t:8.3f}   {x:9.4f}  {f:7d}\n" for t, x, f in rows()))
    np.testing.assert_allclose(
        read_log(log, time="0", position="1:mm", force="2:mN")["force"], 1e-2 * np.arange(30)
    )


def test_decimal_commas(tmp_path):
    log = tmp_path / "a.csv"
    log.write_text("t;x;f\n" + "".join(f"{t:.3f};{x:.2f};{f}\n".replace(".", ",") for t, x, f in rows()))
    np.testing.assert_allclose(read_log(log, **COLUMNS)["position"], 1e-3 * (np.arange(30) + 0.5))


def test_columns_by_number_without_a_header_and_with_comments(tmp_path):
    log = write(tmp_path / "a.csv", rows(), header="# made by hand")
    record = read_log(log, time="0", position="1:mm", force="2:mN")
    assert len(record) == 30


def test_parquet_keeps_units_and_meta(tmp_path):
    record = Record({"time": np.arange(5.0), "f": np.ones(5)}, {"time": "s", "f": "N"}, {"seed": 3})
    path = write_record(record, tmp_path / "r.parquet")
    back = read_record(path)
    assert back.units == record.units
    assert back.meta == record.meta
    np.testing.assert_array_equal(back["f"], record["f"])
    assert read_log(path, time="time", force="f").units["force"] == "N"
    assert [p.name for p in tmp_path.iterdir()] == ["r.parquet"]


def test_nothing_half_written_is_left(tmp_path):
    record = Record({"f": np.ones(5)}, {"f": "N"}, {"bad": float("nan")})
    with pytest.raises(ValueError, match="JSON"):
        write_record(record, tmp_path / "r.parquet")
    assert list(tmp_path.iterdir()) == []


def test_a_rate_stands_for_the_time(tmp_path):
    log = write(tmp_path / "a.csv", rows())
    np.testing.assert_allclose(
        read_log(log, rate=200.0, position="x:mm", force="f")["time"], np.arange(30) / 200
    )


def test_the_cut_is_in_seconds_from_the_first_row(tmp_path):
    log = write(tmp_path / "a.csv", [(t + 100, x, f) for t, x, f in rows()])
    assert len(read_log(log, start=0.1, end=0.2, **COLUMNS)) == 10
    with pytest.raises(InputError, match="no row"):
        read_log(log, start=5.0, **COLUMNS)


def test_a_sentinel_is_found_and_named(tmp_path):
    log = write(
        tmp_path / "a.csv", [(t, x, -1 if k % 2 else 200 + 10 * k) for k, (t, x, _) in enumerate(rows(60))]
    )
    record = read_log(log, time="t", position="x:mm", force="f:g")
    assert np.isnan(record["force"]).sum() == 30
    (note,) = record.meta["notes"]
    assert note["code"] == "missing-samples"
    assert "-1" in note["text"]
    assert "row 2" in note["text"]


def test_minus_one_among_negative_forces_is_a_force(tmp_path):
    log = write(tmp_path / "a.csv", [(t, x, [-2, -1, 0, 1][k % 4]) for k, (t, x, _) in enumerate(rows(60))])
    assert np.isfinite(read_log(log, **COLUMNS)["force"]).all()


def test_a_sentinel_in_two_rows_of_thousands_is_found_and_a_step_below_zero_is_none():
    """Whole grams whose noise at rest goes down to -1, which is one step of the scale; and a marker that is no step."""
    rng = np.random.default_rng(0)
    grams = np.round(500 * np.maximum(np.sin(np.arange(5000) / 400), 0) + 0.4 * rng.standard_normal(5000))
    grams = np.maximum(grams, -1)
    assert (grams == -1).sum() > 10
    assert find_sentinel(grams) is None
    grams[[700, 4000]] = -9999
    assert find_sentinel(grams) == -9999


def test_missing_values_that_are_said(tmp_path):
    cells = [(t, x, "NA" if k == 3 else 77 if k == 5 else f) for k, (t, x, f) in enumerate(rows())]
    record = read_log(write(tmp_path / "a.csv", cells), missing=["NA", 77], **COLUMNS)
    assert list(np.flatnonzero(np.isnan(record["force"]))) == [3, 5]


def test_a_unit_in_the_name_is_taken_and_said(tmp_path):
    log = write(tmp_path / "a.csv", rows(), header="t,x_mm,f_mN")
    record = read_log(log, time="t", position="x_mm", force="f_mN")
    assert record["force"][1] == pytest.approx(0.01)
    assert {note["code"] for note in record.meta["notes"]} == {"unit-stated"}


CLOCKS = {
    "ISO": lambda t: (datetime(2024, 3, 1, 23, 59, 59) + timedelta(seconds=t)).isoformat(),
    "a zone": lambda t: (datetime(2024, 3, 1, 23, 59, 59) + timedelta(seconds=t)).isoformat() + "Z",
    "a space": lambda t: str(datetime(2024, 3, 1, 23, 59, 59) + timedelta(seconds=t)),
    "time of day": lambda t: str((datetime(2024, 3, 1, 12) + timedelta(seconds=t)).time()),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_dates_and_times_are_seconds(tmp_path, kind):
    log = write(tmp_path / "a.csv", [(CLOCKS[kind](0.1 * k), x, f) for k, (_, x, f) in enumerate(rows())])
    record = read_log(log, **COLUMNS)
    assert record["time"] == pytest.approx(0.1 * np.arange(len(record)), abs=1e-6)
    assert record.units["time"] == "s"
    with pytest.raises(InputError, match=r"'t' holds dates and times.*leave :ms out"):
        read_log(log, **{**COLUMNS, "time": "t:ms"})


def test_dates_in_parquet_are_seconds_whatever_they_count_in(tmp_path):
    begin = datetime(2024, 3, 1)
    ms, us, ns = (
        polars.Series([begin + timedelta(seconds=0.1 * k) for k in range(30)], dtype=polars.Datetime(unit))
        for unit in ("ms", "us", "ns")
    )
    cells = {"ms": ms, "ns": ns, "duration": us - begin, "time": us.dt.time()}
    polars.DataFrame({**cells, "x": np.arange(30.0), "f": np.arange(30.0)}).write_parquet(tmp_path / "a")
    for kind in cells:
        time = read_log(tmp_path / "a", **{**COLUMNS, "time": kind})["time"]
        assert time == pytest.approx(0.1 * np.arange(30), abs=1e-6), kind


def test_a_date_that_is_none_is_named(tmp_path):
    cells = [(CLOCKS["ISO"](0.1 * k), x, f) for k, (_, x, f) in enumerate(rows())]
    cells[17] = ("yesterday", *cells[17][1:])
    with pytest.raises(InputError, match=r"row 18 \(line 19\) holds 'yesterday'"):
        read_log(write(tmp_path / "a.csv", cells), **COLUMNS)


@pytest.mark.parametrize("cell", ["inf", "-inf", "oops", "1.2.3"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_cell_that_is_no_number_is_named_with_its_row(tmp_path, cell, place):
    cells = [list(row) for row in rows()]
    cells[17][place] = cell
    with pytest.raises(InputError, match=rf"row 18 \(line 19\) holds '{cell}'"):
        read_log(write(tmp_path / "a.csv", cells), **COLUMNS)


@pytest.mark.parametrize("word", ["", "nan", "NaN", "N/A", "null", "--"])
def test_an_empty_cell_and_its_like_are_no_reading(tmp_path, word):
    cells = [list(row) for row in rows()]
    cells[17][2] = word
    record = read_log(write(tmp_path / "a.csv", cells), **COLUMNS)
    assert np.isnan(record["force"][17])
    assert record.meta["notes"][0]["code"] == "missing-samples"


def binary(path):
    path.write_bytes(bytes(range(256)) * 10)


WRONG_FILES = {
    "missing": (lambda path: None, "there is no file"),
    "folder": (lambda path: path.mkdir(), "is a folder"),
    "empty": (lambda path: path.write_text(""), "is empty"),
    "only comments": (lambda path: path.write_text("# nothing\n\n"), "is empty"),
    "header only": (lambda path: path.write_text("t,x,f\n"), "no rows"),
    "binary": (binary, "not text"),
    "compressed": (lambda path: path.write_bytes(gzip.compress(b"t,x,f\n0,0,0\n")), "unpack it first"),
    "UTF-16": (lambda path: path.write_text("t,x,f\n0,0,0\n", encoding="utf-16"), "UTF-16"),
    "Parquet without rows": (
        lambda path: polars.DataFrame({"t": [], "x": [], "f": []}).write_parquet(path),
        "no rows",
    ),
    "decimal commas between commas": (
        lambda path: path.write_text("t,x,f\n0,1,0,2,0,3\n0,2,0,2,0,3\n"),
        "more cells than its header's 3",
    ),
    "half a Parquet": (lambda path: path.write_bytes(b"PAR1" + b"x" * 100), "Parquet"),
}


@pytest.mark.parametrize("kind", WRONG_FILES)
def test_wrong_files(tmp_path, kind):
    make, words = WRONG_FILES[kind]
    path = tmp_path / "log.csv"
    make(path)
    with pytest.raises(InputError, match=words) as caught:
        read_log(path, **COLUMNS)
    assert "\n" not in str(caught.value)


WRONG_SPECS = {
    "unknown column": ({"force": "g:mN"}, r"unknown column 'g'.*f.*t.*x"),
    "unknown unit": ({"force": "f:parsec"}, r"unknown unit 'parsec'.*mN"),
    "wrong quantity": ({"force": "f:mm"}, "unit of length; force needs"),
    "number too large": ({"force": "7"}, "columns are 0 to 2"),
    "one column twice": ({"force": "x"}, "force and position cannot be the same column"),
    "no time": ({"time": None}, "--time.*--rate"),
}


@pytest.mark.parametrize("kind", WRONG_SPECS)
def test_wrong_specs(tmp_path, kind):
    change, words = WRONG_SPECS[kind]
    specs = {name: spec for name, spec in {**COLUMNS, **change}.items() if spec}
    with pytest.raises(InputError, match=words):
        read_log(write(tmp_path / "a.csv", rows()), **specs)


def test_a_wrong_delimiter_is_suspected(tmp_path):
    log = write(tmp_path / "a.csv", rows())
    with pytest.raises(InputError, match="is the delimiter right"):
        read_log(log, delimiter=";", **COLUMNS)


def test_a_name_with_a_colon_is_given_with_its_unit(tmp_path):
    log = write(tmp_path / "a.csv", rows(), header="t,pos:x,f")
    with pytest.raises(InputError, match=r"unknown column 'pos'.*given with its unit: pos:x:UNIT"):
        read_log(log, **{**COLUMNS, "position": "pos:x"})
    assert len(read_log(log, **{**COLUMNS, "position": "pos:x:mm"})) == 30


def test_a_column_that_is_there_twice_must_be_named_by_number(tmp_path):
    log = write(tmp_path / "a.csv", rows(), header="t,f,f")
    with pytest.raises(InputError, match=r"2 columns named 'f'.*1, 2"):
        read_log(log, time="t", position="f:mm", force="f:mN")
    assert len(read_log(log, time="t", position="1:mm", force="2:mN")) == 30
