"""Books whose sheets repeat one test, a sensor beside its own volts, columns z and fz: what `topics` proposes."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest

from logs.books import spreadsheet
from palpate.cli import main
from palpate.errors import InputError
from palpate.logs import read_log
from palpate.logs.listing import list_log
from palpate.report.identification.words import file_digest

RNG = np.random.default_rng(5)
T = np.arange(400) / 100
X = 2e-3 * (1 - np.cos(2 * np.pi * T)) / 2


def sheet(stiffness):
    force = stiffness * X + 0.02 * RNG.standard_normal(len(T))
    rows = [["t (s)", "Extension (mm)", "Load (N)"]]
    return rows + [[a, 1e3 * b, c] for a, b, c in zip(T.tolist(), X.tolist(), force.tolist(), strict=True)]


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    sheets = {f"Specimen {k}": sheet(1000.0 + 10 * k) for k in range(1, 6)}
    return spreadsheet(tmp_path_factory.mktemp("book") / "tests.xlsx", {"Summary": [["by", "K"]], **sheets})


def test_equal_sheets_are_proposed_as_a_pool_and_identified_as_one(book, capsys):
    proposal = list_log(book).proposal
    assert "5 sheets have the same columns and are pooled" in proposal.guesses[-1]
    words = shlex.split(proposal.command(book))
    assert words[:3] == ["palpate", "identify", str(book)]
    assert main([*words[1:], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["file"] for one in found["files"]] == [f"{book}/Specimen {k}" for k in range(1, 6)]
    assert {one["sha256"] for one in found["files"]} == {file_digest(book)}


def test_a_pool_of_sheets_is_tried_before_it_is_printed(book, capsys):
    assert main(["topics", str(book), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["identify"]["command"] == list_log(book).proposal.command(book)


def test_the_longest_sheet_is_left_for_one_with_force_and_position(tmp_path):
    long = [["Time (s)", "Byte"], *([a / 200, a % 7] for a in range(3 * len(T)))]
    book = spreadsheet(tmp_path / "tests.xlsx", {"Bus": long, "Press": sheet(1000.0)})
    assert list_log(book).proposal.options["force"] == "Press.Load (N):N"


def test_one_sheet_of_a_book_is_a_log(book):
    columns = {"time": "t (s)", "position": "Extension (mm)", "force": "Load (N)"}
    record = read_log(book / "Specimen 2", **columns)
    assert np.allclose(record["position"], X)
    with pytest.raises(InputError, match="did you mean 'Specimen 2'"):
        read_log(book / "Specimen2", **columns)
    named = {role: f"Specimen 3.{name}" for role, name in columns.items()}
    assert len(read_log(book, **named)) == len(T)


def test_a_named_sheet_is_not_pooled(book, capsys):
    words = [f"--{role}=Specimen 3.{name}" for role, name in
             (("time", "t (s)"), ("position", "Extension (mm)"), ("force", "Load (N)"))]  # fmt: skip
    assert main(["identify", str(book), *words, "--json"]) in {0, 1}
    assert [one["file"] for one in json.loads(capsys.readouterr().out)["files"]] == [str(book)]


def csv(path, names, *columns):
    rows = "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in zip(*columns, strict=True))
    path.write_text(",".join(names) + "\n" + rows)
    return path


def test_a_sensor_beside_its_own_volts_is_no_contact(tmp_path):
    force = 1000 * X + 0.02 * RNG.standard_normal(len(T))
    path = csv(tmp_path / "a.csv", ["time_s", "channel_a", "channel_b"], T, force, 0.5 + 0.1 * force)
    assert list_log(path).proposal.words is None
    path = csv(
        tmp_path / "b.csv", ["time_s", "force", "force_volts", "place"], T, force, 0.1 * force, 1e3 * X
    )
    words = list_log(path).proposal.words
    assert words[words.index("--position") + 1].startswith("place")


def test_a_spring_that_is_exactly_a_line_stays_a_contact(tmp_path):
    path = csv(tmp_path / "a.csv", ["time_s", "position_mm", "force_N"], T, 1e3 * X, 1000 * X)
    assert list_log(path).proposal.words is not None
