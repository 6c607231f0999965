"""The command as a user types it: what it prints, what it writes, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from cli import asked
from palpate.bench.tables import parse
from palpate.cli import main
from palpate.logs.tables.parquet import read_record

SURFACES = ("--stiffness", "3:8:N/mm", "--damping", "100:300", "--mass", "0.1:0.3")
ONE = ("--stiffness", "5000", "--damping", "200", "--mass", "0.2", "--force", "15", "--peak", "20")
"""One surface, where nine are not what is tested."""
ASKED = (*SURFACES, "--force", "15", "--peak", "20:N", "--precision", "K=10%,B=10%")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder, which is the working one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ask(capsys, *words):
    return asked.ask(capsys, "excite", *words)


def test_the_contract_of_json(capsys, elsewhere):
    code, found = ask(capsys, *ASKED)
    assert code == 0
    assert set(found) == {
        "command", "options", "files", "version",
        "feasible", "duration_s", "settle_s", "mean_N", "wave", "asked", "reached", "surfaces", "remedies",
    }  # fmt: skip
    assert found["feasible"] is True
    assert found["asked"] == {"K": 0.1, "B": 0.1}
    assert len(found["surfaces"]) == 9
    assert set(found["surfaces"][0]) == {"K", "B", "M", "half_width", "force_N", "travel_m"}
    assert max(surface["half_width"]["K"] for surface in found["surfaces"]) == found["reached"]["K"] <= 0.1
    assert len(found["wave"]["frequencies"]) == len(found["wave"]["phases"])
    assert found["remedies"] == []
    assert list(elsewhere.iterdir()) == []


def test_what_is_printed_and_drawn(capsys, elsewhere):
    assert main(["excite", *ASKED, "--duration", "4", "--figure", "excite.png"]) == 0
    printed = capsys.readouterr().out
    assert "multisine of" in printed
    assert "predicted K" in printed
    assert "written: excite.png" in printed
    assert (elsewhere / "excite.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_what_cannot_be_had_is_refused_with_what_would_help(capsys, elsewhere):
    words = (*ONE, "--lag-std", "1:ms", "--precision", "1%", "--out", "excite.csv", "--duration", "4")
    assert main(["excite", *words]) == 1
    printed = capsys.readouterr().out
    assert "at best K" in printed
    assert "all of these" in printed
    assert list(elsewhere.iterdir()) == []
    code, found = ask(capsys, *words)
    assert code == 1
    assert found["feasible"] is False
    assert {"change", "reached", "enough", "needed_s"} == set(found["remedies"][0])
    # The terminal has these in a table, which breaks their lines.
    assert any("a lag between force and position known exactly" in r["change"] for r in found["remedies"])


@pytest.mark.long
def test_the_force_over_time(capsys, elsewhere):
    words = (*ASKED, "--duration", "4")
    assert main(["excite", *words, "--out", "excite.csv"]) == 0
    table = np.genfromtxt("excite.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "force_desired_N")
    assert len(table) == 5001
    assert 9.9 < table["force_desired_N"].min() < table["force_desired_N"].max() < 20.1
    assert main(["excite", *words, "--out", "excite.parquet"]) == 0
    record = read_record("excite.parquet")
    assert record.units == {"time": "s", "force_desired": "N"}
    assert record["force_desired"] == pytest.approx(table["force_desired_N"], abs=1e-6)
    assert record.meta["design"]["feasible"] is True


def test_the_experiment_is_one_that_palpate_run_takes(elsewhere):
    words = ("--gain", "0.5", "--duration", "4", "--experiment", "own.toml")
    assert main(["excite", *ASKED, *words]) == 0
    made = parse((elsewhere / "own.toml").read_text("utf-8"), "own.toml")
    assert made.force.first == 15.0
    assert made.controller.kf == 0.5
    assert made.surface.stiffness == pytest.approx(np.sqrt(24e6), rel=1e-5)
    assert made.force.multisine is not None
    assert made.run.press < made.run.duration


def test_nothing_is_overwritten_unasked(capsys, elsewhere):
    words = (*ASKED, "--duration", "4", "--out", "excite.csv")
    assert main(["excite", *words]) == 0
    assert main(["excite", *words]) == 2
    assert "exists" in capsys.readouterr().err
    assert main(["excite", *words, "--replace"]) == 0
    (elsewhere / "excite.csv").write_text("mine")
    assert main(["excite", *words, "--replace"]) == 2
    assert "palpate did not write it" in capsys.readouterr().err
    assert (elsewhere / "excite.csv").read_text() == "mine"


BAD = [
    ((), "stiffness"),
    (("--stiffness", "soft"), "--stiffness"),
    (("--stiffness", "8000:3000"), "LOW <= HIGH"),
    (("--stiffness", "-3000:8000"), "LOW <= HIGH"),
    (("--damping", "0"), "damping must be"),
    (("--force", "25"), "least < mean < peak"),
    (("--force", "1"), "least < mean < peak"),
    (("--precision", "0"), "between 0.0001 and 100 %"),
    (("--precision", "150%"), "between 0.0001 and 100 %"),
    (("--bandwidth", "240"), "below half the force sensor's sampling"),
    (("--bandwidth", "0.5"), "lowest < highest"),
    (("--lowest", "0"), "0 < lowest"),
    (("--force-rate", "-5"), "above 0 N/s"),
    (("--drive", "0"), "more than 0 N"),
    (("--duration", "-1"), "duration must be above 0"),
    (("--longest", "1e6"), "at most 3600 s"),
    (("--settle", "-1"), "settle must be"),
    (("--noise", "0"), "noise of a force chain must be above 0"),
    (("--noise", "1e308"), "no robot has such a force"),
    (("--drive", "1e308"), "no robot has such a force"),
    (("--rate", "1.8e308"), "must be a finite number"),
    (("--sampling", "0"), "--sampling must be between 1 and 200000 Hz"),
    (("--sampling", "4.5"), "sampling"),
    (("--rate", "-1000"), "--rate must be between 1 and 200000 Hz"),
    (("--force-filter", "bessel"), "force filter"),
    (("--position-step", "-1"), "position_step"),
    (("--lag-std", "-1"), "lag_std"),
    (("--loop-bandwidth", "0"), "above 0 Hz"),
    (("--loop-bandwidth", "10", "--gain", "1"), "models the whole robot"),
    (("--tip-mass", "-1"), "tip_mass"),
    (("--gain", "50"), "lower its gain"),
    (("--out", "excite.mat"), ".csv or .parquet"),
    (("--out", "nowhere/excite.csv"), "there is no folder nowhere"),
    (("--experiment", "excite.json"), ".toml"),
    (("--figure", "excite.pdf"), "it is a PNG"),
]


@pytest.mark.parametrize(
    ("words", "told"), BAD, ids=lambda value: " ".join(value) if isinstance(value, tuple) else ""
)
def test_bad_input_is_one_line_that_says_what_to_do(words, told, capsys, elsewhere):
    usual = dict(zip(ASKED[::2], ASKED[1::2], strict=True))
    given = dict(zip(words[::2], words[1::2], strict=True))
    line = [word for pair in {**usual, **given}.items() for word in pair] if words else ["--force", "15"]
    assert main(["excite", *line]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert told in printed.err
    assert printed.err.count("\n") == 1
    assert list(elsewhere.iterdir()) == []
