"""What laboratories write: preambles, units below the header, comments, stamps, sheets; and what is said about it."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import palpate
from logs.books import spreadsheet
from palpate.errors import InputError
from palpate.logs import columns_of, read_log

N = 40
T = np.arange(N) / 1000
X = 0.5 + 0.01 * np.arange(N) + 1e-4 * np.arange(N) ** 2
F = np.sin(np.arange(N) / 25)
COLUMNS = {"time": "t", "position": "x:mm", "force": "f:N"}
DDF = Path("../shared/data/skin_indentation/press_250mN.ddf")


def table(rows=None, delimiter=",", header="t,x,f"):
    rows = zip(T, X, F, strict=True) if rows is None else rows
    lines = [
        delimiter.join(f"{cell:.6f}" if isinstance(cell, float) else str(cell) for cell in row)
        for row in rows
    ]
    return "\n".join([header.replace(",", delimiter), *lines] if header else lines) + "\n"


def saved(tmp_path, text, name="log.txt", **how):
    path = tmp_path / name
    path.write_text(text, **how)
    return path


def right(record):
    np.testing.assert_allclose(record["time"], T, atol=2e-6)
    np.testing.assert_allclose(record["position"], 1e-3 * X, atol=1e-9)
    np.testing.assert_allclose(record["force"], F, atol=1e-6)


def codes(record):
    return {note["code"] for note in record.meta["notes"]}


AURORA = """DMCv5.3 Data File
Sample Frequency (Hz): 2000
Reference Area: NaN sq. mm
Calibration Data:
Channel\tAI0\tAI1\tAI2\tAO0
Units\tmm\tmN\t\tmm
Scale (units/V)\t1.5\t500.0\t0.0\t1.0
Offset (volts)\t0.25\t0.0\t0.0\t0.0
Test Comments:

Protocol Array:
0.2\tRamp\tLength Out\t6, 0.5\t
Test Data in Volts:

"""


def aurora():
    rows = [(k, X[k], F[k], 0.1, 0.2) for k in range(N)]
    return AURORA + table(rows, "\t", "Sample,AI0,AI1,AI2,AO0")


def test_a_preamble_that_states_rate_units_and_scales(tmp_path):
    record = read_log(saved(tmp_path, aurora(), "press.ddf"), position="AI0", force="AI1")
    np.testing.assert_allclose(record["time"], np.arange(N) / 2000)
    np.testing.assert_allclose(record["position"], 1.5e-3 * (X + 0.25), atol=1e-8)
    np.testing.assert_allclose(record["force"], 0.5 * F, atol=1e-6)
    assert record.units == {"time": "s", "position": "m", "force": "N"}
    told = " ".join(record.meta["facts"])
    assert "2000 rows a second" in told
    assert "'AI1' is scaled by 500 mN a volt" in told


def test_a_unit_that_contradicts_the_preamble_is_taken_and_said(tmp_path):
    record = read_log(saved(tmp_path, aurora()), position="AI0", force="AI1:N")
    np.testing.assert_allclose(record["force"], 500 * F, atol=1e-3)
    assert any("says mN" in note["text"] for note in record.meta["notes"])


def test_another_rate_than_the_file_states_is_said(tmp_path):
    record = read_log(saved(tmp_path, aurora()), rate=1000, position="AI0", force="AI1")
    assert record["time"][1] == pytest.approx(1e-3)
    assert "time-doubtful" in codes(record)


@pytest.mark.skipif(not DDF.is_file(), reason="the measured logs are not here")
def test_the_measured_file_is_scaled_as_its_siblings_were():
    record = read_log(DDF, position="AI0", force="AI1")
    raw = np.loadtxt(DDF, delimiter="\t", skiprows=26, usecols=(1, 2))
    np.testing.assert_allclose(record["position"], 1e-3 * raw[:, 0])
    np.testing.assert_allclose(record["force"], 0.5 * raw[:, 1])
    assert record["time"][-1] == pytest.approx((len(raw) - 1) / 2000)


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("# Sampling rate: 500 Hz", 500),
        ("% sample_rate = 2 kHz", 2000),
        ("Sample Interval (ms): 4", 250),
        ("Abtastrate / sampling frequency [Hz];1.000,0", None),
        ("Sample frequency: 1,000 Hz", 1000),
    ],
)
def test_rates_in_words(tmp_path, line, rate):
    rows = list(zip(X, F, strict=True))
    path = saved(tmp_path, f"{line}\n" + table(rows, "\t", "x,f"))
    if rate is None:
        with pytest.raises(InputError, match="--rate"):
            read_log(path, position="x:mm", force="f")
    else:
        assert read_log(path, position="x:mm", force="f")["time"][1] == pytest.approx(1 / rate)


def labview(columns="One"):
    head = f"""LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
X_Columns\t{columns}
Date\t2020/02/01
***End_of_Header***\t

"""
    block = """Channels\t2\t\t
Samples\t20\t20\t
Y_Unit_Label\tmm\tNewtons\t
X_Dimension\tTime\tTime\t
X0\t0.0E+0\t0.0E+0\t
Delta_X\t0.001000\t0.001000\t
***End_of_Header***\t\t\t
X_Value\tPath\tLoad\tComment
"""
    rows = [f"{T[k] if columns == 'One' else ''}\t{X[k]:.6f}\t{F[k]:.6f}" for k in range(N)]
    return head + block + "\n".join(rows[:20]) + "\n\n" + block + "\n".join(rows[20:]) + "\n"


def test_labview_with_a_header_before_each_block(tmp_path):
    record = read_log(saved(tmp_path, labview(), "log.lvm"), time="X_Value", position="Path", force="Load")
    right(record)
    assert {"unit-stated", "lines-skipped"} <= codes(record)


def test_labview_without_a_column_of_time(tmp_path):
    right(read_log(saved(tmp_path, labview("No"), "log.lvm"), position="Path", force="Load"))


def test_a_row_of_units_is_taken_where_none_is_given(tmp_path):
    text = table(header="t,x,f\ns,mm,N")
    record = read_log(saved(tmp_path, text), time="t", position="x", force="f")
    right(record)
    assert "by the row of units" in record.meta["notes"][0]["text"]
    right(read_log(saved(tmp_path, text), **COLUMNS))
    other = read_log(saved(tmp_path, text), time="t", position="x:m", force="f")
    np.testing.assert_allclose(other["position"], X, atol=1e-6)
    assert any("as given, but the row of units says mm" in note["text"] for note in other.meta["notes"])


@pytest.mark.parametrize(
    "header", ["Time Position Force\n(s) (mm) (N)", "t[s]  Tip (mm)   Force [N]", "Time\tTip (mm)\tForce [N]"]
)
def test_headers_above_columns_of_spaces(tmp_path, header):
    rows = "".join(f"{t:9.3f} {x:12.6f} {f:12.6f}\n" for t, x, f in zip(T, X, F, strict=True))
    path = saved(tmp_path, f"Operator: Bob 7\nTemperature: 21.5 C\n\n{header}\n{rows}")
    time, position, force = columns_of(path)
    assert "Force" in force
    right(read_log(path, time=time, position=position, force=force))


@pytest.mark.parametrize("mark", ["#", "%", "//", ";"])
def test_comments(tmp_path, mark):
    lines = table(header="").splitlines()
    lines.insert(20, f"{mark} the probe slipped, 3 times")
    right(read_log(saved(tmp_path, f"{mark} t, x, f\n" + "\n".join(lines)), **COLUMNS))


def test_spaces_in_cells_between_tabs(tmp_path):
    rows = [(t, x, f, "in contact") for t, x, f in zip(T, X, F, strict=True)]
    record = read_log(
        saved(tmp_path, table(rows, "\t", "run time,tip position,normal force,what it does")),
        time="run time",
        position="tip position:mm",
        force="normal force",
    )
    right(record)


def test_more_names_than_columns(tmp_path):
    right(read_log(saved(tmp_path, table(header="t,x,f,comment")), **COLUMNS))
    right(read_log(saved(tmp_path, table(delimiter="\t", header="t,x,f,,")), **COLUMNS))


def test_blank_lines_a_line_of_delimiters_and_zeros_of_a_lost_disk(tmp_path):
    lines = table().splitlines()
    lines.insert(20, "")
    lines.insert(21, " , , ")
    right(read_log(saved(tmp_path, "\n".join(lines) + "\n" + "\x00" * 900), **COLUMNS))


def test_a_last_line_that_is_cut_is_left_out_and_said(tmp_path):
    record = read_log(saved(tmp_path, table() + "0.040000,0.9"), **COLUMNS)
    right(record)
    (note,) = record.meta["notes"]
    assert note["code"] == "lines-skipped"
    assert f"the last line ({N + 2}) is cut short" in note["text"]


def test_lines_of_another_width_are_left_out_and_said(tmp_path):
    lines = table().splitlines()
    lines[10:10] = ["0.5,0.5", "1,2,3,4,5", "t,x,f"]
    record = read_log(saved(tmp_path, "\n".join(lines) + "\n"), **COLUMNS)
    right(record)
    assert (
        "3 lines are no rows of 3 cells and are left out (the first is line 11)"
        in record.meta["notes"][0]["text"]
    )


def test_decimal_commas_between_tabs_and_in_quotes(tmp_path):
    right(read_log(saved(tmp_path, table(delimiter="\t").replace(".", ",")), **COLUMNS))
    quoted = "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in table().splitlines())
    right(read_log(saved(tmp_path, quoted), **COLUMNS))
    commas = "\n".join(
        ",".join(f'"{c}"'.replace(".", ",") for c in line.split(",")) for line in table().splitlines()
    )
    right(read_log(saved(tmp_path, commas, "c.csv"), **COLUMNS))


def test_an_old_windows_and_an_old_macintosh(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(table(header="t,weg [µm],f").encode("cp1252"))
    assert columns_of(path)[1] == "weg [µm]"
    assert read_log(path, time="t", position="weg [µm]", force="f")["position"][0] == pytest.approx(0.5e-6)
    path.write_bytes(table().replace("\n", "\r").encode())
    right(read_log(path, **COLUMNS))


@pytest.mark.parametrize(("unit", "per"), [("ms", 10**3), ("us", 10**6), ("ns", 10**9)])
def test_stamps_since_1970_keep_their_digits(tmp_path, unit, per):
    begin = 1_743_486_221 * per
    ticks = [begin + k * per // 1000 + (7 if unit == "ns" else 0) for k in range(N)]
    path = saved(tmp_path, table(zip(ticks, X, F, strict=True)))
    for spec in ("t", f"t:{unit}"):
        record = read_log(path, **{**COLUMNS, "time": spec})
        np.testing.assert_allclose(record["time"], T, atol=1e-12, rtol=0)
        assert record.meta["start_s"] == pytest.approx(1_743_486_221)
        assert ("unit-guess" in codes(record)) == (spec == "t")


def test_a_clock_since_boot_is_no_date(tmp_path):
    ticks = [2_000_000_000_000 + k * 10**6 for k in range(N)]  # ns; as ms it would be a date of 2033
    record = read_log(saved(tmp_path, table(zip(ticks, X, F, strict=True))), **COLUMNS)
    assert any("Then say t:ns" in note["text"] for note in record.meta["notes"])


def test_rates_that_there_are_not(tmp_path):
    path = saved(tmp_path, table(zip((1000.0 * T).tolist(), X, F, strict=True)))
    assert "time-doubtful" not in codes(read_log(path, **{**COLUMNS, "time": "t:ms"}))
    slow = saved(tmp_path, table(zip((4000.0 * T).tolist(), X, F, strict=True)), "slow.csv")
    text = next(n["text"] for n in read_log(slow, **COLUMNS).meta["notes"] if n["code"] == "time-doubtful")
    assert "0.25 rows a second; is its unit ms, with 250 rows a second? Then say t:ms" in text
    stated = read_log(slow, **{**COLUMNS, "time": "t:s"})
    assert "time-doubtful" not in {*codes(stated), *palpate.identify(stated).codes}
    fast = read_log(saved(tmp_path, table(), "fast.csv"), **{**COLUMNS, "time": "t:us"})
    assert any("Then say t:s" in note["text"] for note in fast.meta["notes"])


def test_a_time_that_counts_rows(tmp_path):
    record = read_log(saved(tmp_path, table(zip(range(N), X, F, strict=True))), **COLUMNS)
    assert any("counts rows" in n["text"] for n in record.meta["notes"] if n["code"] == "time-doubtful")


def test_time_and_position_in_each_other_s_place(tmp_path):
    path = saved(tmp_path, table(zip(T, np.sin(9 * X), F, strict=True)))
    with pytest.raises(
        InputError, match=r"goes back in .* while the position goes on in even steps.*swapped"
    ):
        read_log(path, time="x", position="t:mm", force="f")


def test_a_name_that_speaks_against_its_role(tmp_path):
    path = saved(tmp_path, table(header="t,x_mm,f_mN"))
    record = read_log(path, time="t", position="f_mN", force="x_mm")
    assert codes(record) == {"columns-swapped"}


def test_no_name_is_a_pattern(tmp_path):
    saved(tmp_path, table(zip(T, 2 * X, F, strict=True)), "press1.csv")
    right(read_log(saved(tmp_path, table(), "press[1].csv"), **COLUMNS))
    right(read_log(saved(tmp_path, table(), "log*.csv"), **COLUMNS))
    with pytest.raises(InputError, match="there is no file"):
        read_log(tmp_path / "press?.csv", **COLUMNS)


@pytest.mark.parametrize("scale", [1e-200, 1e77, 1e300])
@pytest.mark.parametrize("role", ["time", "position", "force"])
def test_values_beyond_all_measure(tmp_path, scale, role):
    columns = {"time": T, "position": X, "force": F}
    columns[role] = scale * columns[role]
    path = saved(tmp_path, table(zip(*(map(repr, map(float, c)) for c in columns.values()), strict=True)))
    with pytest.raises(InputError, match=rf"\({role}\) (holds|changes by) .*no measurement"):
        read_log(path, **COLUMNS)


def test_arrays_of_more_dimensions_and_what_is_too_wide(tmp_path):
    poses = np.zeros((4, 4, N))
    poses[0, 3] = X
    path = tmp_path / "log.mat"
    savemat(path, {"t": T, "T": poses, "f": F, "film": np.zeros((90, 80, 2))})
    right(read_log(path, time="t", position="T.0.3:mm", force="f"))
    with pytest.raises(InputError, match="'film' is an array of 90 x 80 x 2"):
        read_log(path, time="t", position="film", force="f")


def test_whole_numbers_of_matlab_keep_their_digits(tmp_path):
    savemat(tmp_path / "a.mat", {"t": 1_743_486_221 * 10**9 + np.arange(N) * 10**6 + 1, "x": X, "f": F})
    np.testing.assert_allclose(read_log(tmp_path / "a.mat", **COLUMNS)["time"], T, atol=1e-12, rtol=0)


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def an_object(name, kind):
    """A variable as MATLAB keeps an object: its name, what made it and its class, then numbers of MATLAB's own."""
    numbers = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 2, 1)) + element(1, b"")
    numbers += element(6, struct.pack("<II", 0xDD000000, 2))
    words = b"".join(element(1, word.encode()) for word in (name, "MCOS", kind))
    return element(14, element(6, struct.pack("<II", 17, 0)) + words + element(14, numbers))


@pytest.mark.parametrize(
    ("kind", "way"),
    [
        ("table", "table2struct"),
        *(
            pytest.param(*of, marks=pytest.mark.long)
            for of in (("timeseries", r"\.Time"), ("press.Log", "struct"))
        ),
    ],
)
def test_objects_of_matlab_are_named_with_the_way_out(tmp_path, kind, way):
    path = tmp_path / "log.mat"
    savemat(path, {"t": T, "x": X}, do_compression=False)
    path.write_bytes(path.read_bytes() + an_object("press", kind) + an_object("other", "string"))
    with pytest.raises(InputError, match=rf"'press' is a MATLAB {kind}.*{way}") as caught:
        read_log(path, time="t", position="x", force="press.force")
    assert "\n" not in str(caught.value)
    assert columns_of(path) == ["t", "x"]


def test_a_spreadsheet_whose_sheets_are_named_like_topics(tmp_path):
    rows = [
        ["pressed by hand"],
        ["t", "x", "f"],
        ["s", "mm", "N"],
        *map(list, zip(T.tolist(), X.tolist(), F.tolist(), strict=True)),
    ]
    other = [["t", "g"], *([float(t), 1.0] for t in T)]
    path = spreadsheet(tmp_path / "log.xlsx", {"Press 1": rows, "Air": other, "Notes": [["nothing"]]})
    assert columns_of(path) == ["Press 1.t", "Press 1.x", "Press 1.f", "Air.t", "Air.g"]
    right(read_log(path, time="Press 1.t", position="x", force="f"))
    with pytest.raises(InputError, match="one sheet, got Air, Press 1"):
        read_log(path, time="Air.t", position="x", force="f")
    alone = spreadsheet(tmp_path / "one.xlsx", {"Press": rows})
    right(read_log(alone, time="t", position="x", force="f"))


def test_fields_of_structs_in_parquet(tmp_path):
    import polars

    path = tmp_path / "log.parquet"
    polars.DataFrame(
        {
            "t": T,
            "state": [{"x": x, "ft": {"z": f}} for x, f in zip(X, F, strict=True)],
            "raw": [[1.0, 2.0]] * N,
        }
    ).write_parquet(path)
    right(read_log(path, time="t", position="state.x:mm", force="state.ft.z"))
    with pytest.raises(InputError, match="'raw' is a column of lists"):
        read_log(path, time="t", position="raw", force="state.x")


def test_a_second_table_beside_the_first_is_no_part_of_its_header(tmp_path):
    """A title over each column, and numbers of a result beside the names and the units."""
    head = [["A 1", "A 1", "A 1"], ["Time", "Travel", "Force", "", 20.0], ["s", "mm", "N", "", 3.1]]
    rows = [
        [t, x, f, "", 12.0 * (k == 1) or ""]
        for k, (t, x, f) in enumerate(zip(*map(np.ndarray.tolist, (T, X, F)), strict=True))
    ]
    path = spreadsheet(tmp_path / "log.xlsx", {"A 1": [row + [""] * (5 - len(row)) for row in head] + rows})
    assert columns_of(path)[:3] == ["Time", "Travel", "Force"]
    np.testing.assert_allclose(read_log(path)["position"], 1e-3 * np.asarray(X), atol=1e-12)
