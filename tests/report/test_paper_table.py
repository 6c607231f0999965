"""Identifications as a table for a paper: one unit a column, and the numbers of the pooled answer."""

from __future__ import annotations

import csv
from dataclasses import replace

import pytest

from identification.synthetic_contacts import shaken
from palpate.cli import main
from palpate.files import ours
from palpate.identification import identify, pool
from palpate.identification.indenter import Indenter, with_modulus
from palpate.report.identification.words import Source
from palpate.report.many.table import LogRow, cells, write_table
from report.outcomes import OUTCOMES


@pytest.fixture(scope="module")
def rows():
    found = [
        identify(shaken(k=k, noise=0.05, seed=i), lag=0.0) for i, k in enumerate((4800.0, 5000.0, 5300.0))
    ]
    return [
        LogRow(Source(name, {}), own)
        for name, own in zip(("=a_1.csv", "b%2.mat", "c|3.xlsx"), found, strict=True)
    ]


@pytest.fixture(scope="module")
def pooled(rows):
    return pool([row.result for row in rows])


def test_the_summary_is_the_pooled_answer(rows, pooled):
    head, body = cells(rows, pooled)
    assert head[:3] == ("log", "stiffness [N/m]", "stiffness ± 95 % [N/m]")
    assert head[-1] == "verdict"
    assert body[0][-1] == "identified"
    assert len(set(head)) == len(head)
    by_name = {row[0]: dict(zip(head, row, strict=True)) for row in body}
    assert [*by_name][3:] == ["n", "mean", "next press", "deviation"]
    column = head.index("K [N/m]")
    K = pooled.parameters["K"]
    values = {row[0]: row[column] for row in body}
    halves = {row[0]: row[column + 1] for row in body}
    assert values["n"] == "3"
    assert float(values["mean"]) == pytest.approx(K.parameter.value, abs=float(halves["mean"]) / 5)
    assert float(values["deviation"]) == pytest.approx(K.between, rel=0.1)
    assert float(halves["next press"]) == pytest.approx((K.prediction95[1] - K.prediction95[0]) / 2, rel=0.1)
    for row, line in zip(rows, body, strict=False):
        own = row.result.parameters["K"]
        assert float(line[column]) == pytest.approx(own.value, abs=float(line[column + 1]) / 5)


def test_the_file_holds_all_cells_and_may_be_replaced(rows, pooled, tmp_path):
    path = tmp_path / "t.csv"
    write_table(rows, pooled, path)
    text = path.read_text(encoding="utf-8")
    assert ours(path)
    write_table(rows, pooled, path)
    assert path.read_text(encoding="utf-8") == text
    table = list(csv.reader(text.splitlines()))
    assert len({len(row) for row in table}) == 1


def test_a_spreadsheet_computes_no_name_and_a_line_break_ends_no_row(rows, tmp_path):
    names = ("\t=1.csv", "+1\n.csv", "-1.csv")
    hostile = [replace(row, source=Source(name, {})) for row, name in zip(rows, names, strict=True)]
    write_table(hostile, None, tmp_path / "t.csv")
    table = list(csv.reader((tmp_path / "t.csv").read_text(encoding="utf-8").splitlines()))
    assert [row[0] for row in table[1:4]] == ["'=1.csv", "'+1 .csv", "'-1.csv"]


def test_a_modulus_is_the_first_column_and_a_column_has_one_unit(rows):
    found = with_modulus(OUTCOMES["not_identifiable"](), Indenter.parse("punch:5:mm"))
    E = replace(found.parameters["E"], value=9.5e3, ci95=(9e3, 1e4))
    soft = LogRow(Source("a.csv", {}), replace(found, parameters={**found.parameters, "E": E}))
    stiff = LogRow(
        Source("b.csv", {}), replace(found, parameters={"E": replace(E, value=2e5, ci95=(1.9e5, 2.1e5))})
    )
    head, body = cells([soft, stiff], None)
    assert head[1] == "E [kPa]"
    assert [row[1] for row in body[:2]] == ["9.50", "200"]


def test_another_ending_is_refused_before_any_work(root, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    log = root / "examples/data/press.csv"
    assert main(["identify", str(log), "--table", "t.docx"]) == 2
    assert "name it t.csv" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    assert main(["identify", str(log), "--table", "t.csv"]) == 0
    assert "table: t.csv" in capsys.readouterr().out
