"""Text logs as people and instruments write them, and as nobody should: each read, or refused in one line at once."""

from __future__ import annotations

import json
import os
import time
from contextlib import suppress

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.files.reading import ReadingLimits
from palpate.logs import read_log
from palpate.logs.listing import list_log

T = np.arange(200) / 100
X = 1e-3 * T
F = 900 + 100 * T
COLUMNS = {"time": "t", "position": "x", "force": "f"}
ROWS = [f"{t:.2f},{x:.6f},{f:.2f}" for t, x, f in zip(T, X, F, strict=True)]
WHOLE = ["t,x,f", *ROWS]


def read(path, lines, **columns):
    path.write_text("\n".join(lines) + "\n")
    return read_log(path, **(columns or COLUMNS))


def is_the_press(record):
    return (
        np.allclose(record["time"], T)
        and np.allclose(record["position"], X, atol=1e-6)
        and np.allclose(record["force"], F, atol=0.01)
    )


@pytest.mark.parametrize("mark", ["#", "%", "//", "# ", "#\t"])
@pytest.mark.parametrize("place", [0, 1, 40])
def test_a_bare_mark_of_a_comment(tmp_path, mark, place):
    assert is_the_press(read(tmp_path / "log.csv", [*WHOLE[:place], mark, *WHOLE[place:]]))


@pytest.mark.parametrize("row", ["start,0.0,900", "2020-13-45T00:00:00,0.0,900", "t0,,900.5"])
def test_a_first_row_that_begins_with_a_word_is_a_row(tmp_path, row):
    with pytest.raises(InputError, match=r"'t', row 1 \(line 2\) holds"):
        read(tmp_path / "log.csv", [WHOLE[0], row, *ROWS])
    assert len(read_log(tmp_path / "log.csv", rate=100, position="x", force="f")) == len(T) + 1


@pytest.mark.parametrize("lost", [1, 3, 60])
def test_a_tracker_that_does_not_see_its_tool_at_first(tmp_path, lost):
    head = "Tools\tPort 1\tFrame\tState\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\tError\tForce [N]"
    unseen = [f"1\tPort 1: 8700340\t{100 + k}\tMissing" + "\t" * 8 + f"\t{F[k]:.2f}" for k in range(lost)]
    seen = [f"1\tPort 1: 8700340\t{100 + k}\tOK\t1\t0\t0\t0\t1.5\t2.5\t{1e3 * X[k]:.4f}\t0.1\t{F[k]:.2f}"
            for k in range(lost, len(T))]  # fmt: skip
    record = read(tmp_path / "log.tsv", [head, *unseen, *seen], rate=100, position="Tz:mm", force="Force [N]")
    assert len(record) == len(T)
    assert np.isnan(record["position"]).sum() == lost
    assert np.allclose(record["force"], F, atol=0.01)


def test_the_number_by_which_a_tracker_means_none(tmp_path):
    rows = [row if k % 20 else f"{T[k]:.2f},-3.697314E+28,{F[k]:.2f}" for k, row in enumerate(ROWS)]
    record = read(tmp_path / "log.csv", [WHOLE[0], *rows])
    assert np.isnan(record["position"]).sum() == 10


GERMAN = str.maketrans(".,", ",.")


def quoted(*cells):
    return ",".join(f'"{cell}"' for cell in cells)


DIALECTS = {
    "quoted, as testing machines write it": (",", quoted),
    "only the large ones quoted": (",", lambda t, x, f: f"{t},{x}," + (quoted(f) if "," in f else f)),
    "tabs": ("\t", lambda t, x, f: f"{t}\t{x}\t{f}"),
    "semicolons": (";", lambda t, x, f: f"{t};{x};{f}"),
    "German": (";", lambda t, x, f: f"{t};{x};{f}".translate(GERMAN)),
    "German, quoted": (",", lambda t, x, f: quoted(*(n.translate(GERMAN) for n in (t, x, f)))),
}
"""The delimiter, and a row of numbers in the notation of 1,000.12."""


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("copies", [1, 10])
def test_commas_that_part_thousands(tmp_path, dialect, copies):
    """The force crosses 1000 within the first lines, and far behind those that are looked at."""
    mark, row = DIALECTS[dialect]
    t, force = np.arange(200 * copies) / 100, 900 + 100 * T[-1] * np.arange(200 * copies) / (200 * copies)
    rows = [row(f"{a:.2f}", f"{1e-3 * a:.6f}", f"{b:,.2f}") for a, b in zip(t, force, strict=True)]
    record = read(tmp_path / "log.csv", [mark.join("txf"), *rows])
    assert len(record) == 200 * copies
    assert not record.meta["notes"] or all(note["code"] != "lines-skipped" for note in record.meta["notes"])
    assert np.allclose(record["force"], force, atol=0.01)


@pytest.mark.parametrize(
    ("x", "scale"), [("{:,.2f}", 1), ("{:.2f}", 1000)], ids=["beside both marks", "alone"]
)
def test_a_comma_before_three_digits_parts_thousands_beside_a_cell_with_both_marks(tmp_path, x, scale):
    at = 2000 + np.arange(200)
    rows = [f"{t:.2f};{x.format(1e3 + k)};{k:,}" for t, k in zip(np.arange(200) / 100, at, strict=True)]
    assert np.allclose(read(tmp_path / "log.csv", ["t;x;f", *rows])["force"], at / scale)


def test_a_decimal_comma_with_three_places_stays_one(tmp_path):
    rows = [f"{t:.3f};{1e-3 * t:.6f};{f:.3f}".replace(".", ",") for t, f in zip(T, 1.5 + T, strict=True)]
    assert np.allclose(read(tmp_path / "log.csv", ["t;x;f", *rows])["force"], 1.5 + T)


HOSTILE = {
    "digits": ["t,x,f", "1" * 100_000, *ROWS],
    "digits in a cell": ["t,x,f", "1" * 100_000 + ",2,3", *ROWS],
    "brackets in a header by spaces": ["[" * 60_000, *(row.replace(",", " ") for row in ROWS)],
    "round brackets": ["a(" * 60_000, *(row.replace(",", " ") for row in ROWS)],
    "names by spaces": ["a " * 60_000, *(row.replace(",", " ") for row in ROWS)],
    "a rate that never ends": ["sampl" + "_" * 100_000, *WHOLE],
    "cells without end": ["," * 100_000, *WHOLE],
    "dates without end": [",".join(["2020-01-01T00:00:0x"] * 8000)] * 20,
    "quotes": ['"' * 100_000, *WHOLE],
    "lists without end": ["t,x,f", "[(" * 50_000, "[1" + " " * 100_000, "a:1 " * 30_000, *ROWS],
    "a name without end": ["t,x,f" + "_" * 100_000, *ROWS],
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_line_takes_as_long_as_any_other(tmp_path, kind):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(HOSTILE[kind]) + "\n")
    begun = time.process_time()
    for ask in (lambda: list_log(path), lambda: read_log(path, **COLUMNS)):
        with suppress(InputError):
            ask()
    assert (
        time.process_time() - begun < 8.0
    )  # 0.5 s where nothing else runs; the square of the length took 75 s


def test_a_line_without_end(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*WHOLE[:2], "1," * 300_000, *ROWS]))
    with pytest.raises(InputError, match=r"line 3 of .* has over 500,000 letters"):
        read_log(path, **COLUMNS)


def test_the_limit_of_time_holds_while_the_layout_is_found(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(WHOLE))
    with pytest.raises(InputError, match="takes more than 1e-09 s"):
        list_log(path, limits=ReadingLimits(seconds=1e-9))


@pytest.mark.parametrize("quoted", [False, True])
def test_a_name_that_is_not_utf_8(tmp_path, quoted):
    path = tmp_path / os.fsdecode(b"pr\xe9sse.csv")
    lines = [",".join(f'"{cell}"' for cell in line.split(",")) for line in WHOLE] if quoted else WHOLE
    assert is_the_press(read(path, lines))
    assert [entry.name for entry in list_log(path).entries]


def test_names_longer_than_any_are_shown_by_their_ends(tmp_path):
    record = read(tmp_path / "log.csv", ["t,x," + "f" * 70_000, *ROWS], time="t", position="x", force="2")
    assert len(record) == len(T)
    assert all(len(entry.name) <= 200 for entry in list_log(tmp_path / "log.csv").entries)


def written_as(form):
    """The press in a form of text that is no lines of cells."""
    rows = list(zip(T.tolist(), X.tolist(), F.tolist(), strict=True))
    listed = [f'{t},"[0.5, {x:.6f}]",{f:.2f}' for t, x, f in rows]
    return {
        "JSON lines": [json.dumps({"t": t, "tip": {"x": x}, "ft": [0.0, f]}) for t, x, f in rows],
        "a list of objects": [json.dumps([{"t": t, "tip": {"x": x}, "ft": [0.0, f]} for t, x, f in rows])],
        "an object of lists": [
            json.dumps({"who": "me", "t": list(T), "tip": {"x": list(X)}, "ft": {"1": list(F)}})
        ],
        "labels": ["ready", *(f"t:{t} x: {x:.6f}\tf:{f:.2f}" for t, x, f in rows)],
        "labels and units": [f"t={t} s, x={1e3 * x:.3f} mm, f={f:.2f} N" for t, x, f in rows],
        "stamps": [f"00:00:{t:06.3f} -> x:{x:.6f},f:{f:.2f}" for t, x, f in rows],
        "lists in cells": ["t,tip,f", *listed],
        "quoted line breaks": ["t,note,x,f", *(f'{t},"a ""b""\nc",{x:.6f},{f:.2f}' for t, x, f in rows)],
        "names on the first row": ["# t\tx\tf0.00\t0.0\t900.0", *(f"{t}\t{x:.6f}\t{f:.2f}" for t, x, f in rows[1:])],
        "names behind a percent sign": [
            "%time,field.header.seq,field.x,field.f",
            *(f"{round(1e9 * t) + 1_700_000_000_000_000_000},{k},{x:.6f},{f:.2f}" for k, (t, x, f) in enumerate(rows)),
        ],
    }[form]  # fmt: skip


FORMS = {
    "JSON lines": {"position": "tip.x", "force": "ft.1"},
    "a list of objects": {"position": "tip.x", "force": "ft.1"},
    "an object of lists": {"position": "tip.x", "force": "ft.1"},
    "labels": {},
    "labels and units": {"time": "t (s)", "position": "x (mm)", "force": "f (N)"},
    "stamps": {"time": "time"},
    "lists in cells": {"position": "tip.1"},
    "quoted line breaks": {},
    "names on the first row": {},
    "names behind a percent sign": {"time": "time:ns", "position": "field.x", "force": "field.f"},
}


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_text(tmp_path, form):
    record = read(tmp_path / "log.txt", written_as(form), **{**COLUMNS, **FORMS[form]})
    skipped = int(form == "names on the first row")  # that row is lost, and named
    assert len(record) == len(T) - skipped
    assert ("hangs on the names" in str(record.meta["notes"])) == bool(skipped)
    np.testing.assert_allclose(record["force"], F[skipped:], atol=0.01)
    np.testing.assert_allclose(record["position"], X[skipped:], atol=1e-6)
    np.testing.assert_allclose(record["time"], T[skipped:] - T[skipped], atol=1e-6)


def test_a_list_of_another_length_is_named_by_its_line(tmp_path):
    lines = written_as("lists in cells")
    lines[41] = lines[41].replace("0.5, ", "")
    with pytest.raises(InputError, match=r"column 'tip', row 41 \(line 42\) holds a list of 1 numbers"):
        read(tmp_path / "log.csv", lines, **{**COLUMNS, "position": "tip.1"})


def test_a_line_that_is_no_json_is_left_out_and_named(tmp_path):
    lines = written_as("JSON lines")
    lines[30] = lines[30][:12]
    record = read(tmp_path / "log.jsonl", lines, **{**COLUMNS, **FORMS["JSON lines"]})
    assert len(record) == len(T) - 1
    assert "the first is line 31" in record.meta["notes"][0]["text"]


@pytest.mark.parametrize(
    "text",
    ["{" * 5000, '{"t": ' + "[" * 100_000, '[{"t": 1}', "{}\n{}\n", '[{"a":1}' + ',{"a":"' + "x" * 9999],
)
def test_hostile_json_is_refused_in_one_line(tmp_path, text):
    with pytest.raises(InputError) as refused:
        read(tmp_path / "log.json", [text])
    assert "\n" not in str(refused.value)


def test_counts_are_divided_by_the_factor_in_the_header(tmp_path):
    lines = [
        "Counts per Force: 1000",
        "Force Units: N",
        "t,x,Fz",
        *(f"{t},{x},{round(1000 * f)}" for t, x, f in zip(T, X, F, strict=True)),
    ]
    record = read(tmp_path / "log.csv", lines, time="t", position="x", force="Fz")
    np.testing.assert_allclose(record["force"], F, atol=1e-3)
    assert "0.001 N a count" in record.meta["facts"][0]


def test_two_files_are_joined_by_their_times(tmp_path):
    slow = np.arange(0.013, 1.9, 0.031)
    forces = tmp_path / "forces.csv"
    forces.write_text("\n".join(["time_s,force_N", *(f"{t:.3f},{f:.2f}" for t, f in zip(T, F, strict=True))]))
    places = tmp_path / "places.csv"
    lines = [f"{1e3 * t:.2f};{1.0 * t:.5f}" for t in slow]
    places.write_text("\n".join(["t (ms);x (mm)", *lines]))
    record = read_log(forces, join=places, time="time_s", position="x (mm)", force="force_N")
    known = np.isfinite(record["position"])
    assert 0 <= len(slow) - known.sum() <= 2
    begin = record.meta["start_s"]
    np.testing.assert_allclose(record["position"][known], 1e-3 * (record["time"][known] + begin), atol=1e-8)
    np.testing.assert_allclose(record["force"], 900 + 100 * (record["time"] + begin), atol=0.02)
    places.write_text("\n".join(["t (ms);x (mm)", *(f"{1e3 * (t + 9):.2f};{t:.5f}" for t in slow)]))
    with pytest.raises(InputError, match=r"do not overlap: 0 to 1\.99 s"):
        read_log(forces, join=places, time="time_s", position="x (mm)", force="force_N")
