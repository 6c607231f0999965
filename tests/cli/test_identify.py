"""The command as a user types it: on the measured logs, on logs made here, and on bad input."""

from __future__ import annotations

import hashlib
import json
import re
import shutil

import numpy as np
import pytest

import palpate
from cli import asked
from identification.synthetic_contacts import pressed
from palpate import identify, read_log
from palpate.cli import main
from palpate.identification.causes import Code

SKIN = ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_mN:mN")


def ask(capsys, *words):
    return asked.ask(capsys, "identify", *words)


def codes(found):
    return [warning["code"] for warning in found["warnings"]]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    record = pressed()
    table = np.column_stack([record["time"], record["position"] * 1e3, record["force"]])
    path = tmp_path_factory.mktemp("written") / "press.csv"
    np.savetxt(path, table, delimiter=",", header="time_s,position_mm,force_N", comments="", fmt="%.7g")
    return path


@pytest.fixture
def log(written, tmp_path):
    return shutil.copy(written, tmp_path / "press.csv")


@pytest.fixture
def shaken(log):
    """A probe fixed to a surface and shaken from 0.5 to 40 Hz: K 5000 N/m, B 40 N s/m, M 0.5 kg."""
    time = np.arange(4000) / 1000
    phase = 2 * np.pi * (0.5 * time + 39.5 / 8 * time**2)
    x, rate = 1e-3 * np.sin(phase), 2 * np.pi * (0.5 + 39.5 / 4 * time)
    v = 1e-3 * rate * np.cos(phase)
    a = 1e-3 * (2 * np.pi * 39.5 / 4 * np.cos(phase) - rate**2 * np.sin(phase))
    force = 5000 * x + 40 * v + 0.5 * a + np.random.default_rng(0).normal(0, 0.02, len(time))
    path = log.parent / "shaken.csv"
    table = np.column_stack([time, 1e3 * x, force])
    np.savetxt(path, table, delimiter=",", header="time_s,position_mm,force_N", comments="", fmt="%.7g")
    return path


COLUMNS = {"time": "time_s", "position": "position_mm:mm", "force": "force_N:N"}
OWN = ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N")


@pytest.mark.parametrize("load", [pytest.param(20, marks=pytest.mark.long), 40])
def test_light_presses_on_skin_claim_nothing(measured, capsys, load):
    _, found = ask(capsys, measured / f"skin_indentation/press_{load}mN.csv", *SKIN)
    assert all(p["verdict"] != "identified" for p in found["parameters"].values())


@pytest.mark.long
def test_silverbox(measured, capsys):
    columns = ("--time", "time_s", "--position", "position_V:1", "--force", "force_V:1")
    code, found = ask(capsys, measured / "silverbox/schroeder_80mV.csv", *columns)
    assert code == 0
    own = found["parameters"]
    assert {own[name]["verdict"] for name in "KM"} == {"identified"}  # nobody told the lag, so B is not
    assert {own[name]["unit"] for name in "KBM"} == {"1"}
    k, m = (own[name]["value"] for name in "KM")
    half = 0.5 * np.hypot(*(1.96 * own[name]["std"] / own[name]["value"] for name in "KM"))
    assert half < 0.13  # of the mass a quarter: a lag of up to a radian may be a delay or a low-pass
    assert np.sqrt(k / m) / (2 * np.pi) == pytest.approx(68.6, rel=half)  # its frequency at small amplitudes


def test_json_is_that_of_the_identification_and_says_where_it_is_from(log, capsys):
    code, found = ask(capsys, log, *OWN)
    assert code == 0
    assert found["file"] == str(log)
    assert found["version"] == palpate.__version__
    assert found["sha256"] == hashlib.sha256(log.read_bytes()).hexdigest()
    assert found["options"]["position"] == "position_mm:mm"
    assert found["parameters"]["K"]["unit"] == "N/m"
    own = json.loads(json.dumps(identify(read_log(log, **COLUMNS)).to_json()))
    assert own.keys() <= found.keys()
    assert found["parameters"] == own["parameters"]
    assert found["working_point"] == own["working_point"]
    assert list(log.parent.iterdir()) == [log]


def test_the_uncertainty_budget_follows_the_answer(log, capsys):
    assert main(["identify", str(log), *OWN, "--budget"]) == 0
    text = capsys.readouterr().out
    assert text.index("all evidence") < text.index("u_c = ") < text.index("Follows the GUM")
    assert main(["identify", str(log), str(log), *OWN, "--budget"]) == 2
    assert "--budget prints the budget of one log" in capsys.readouterr().err


@pytest.mark.parametrize("word", [pytest.param("action", marks=pytest.mark.long), "-1"])
def test_the_sign_of_the_force_is_handed_on(log, capsys, word):
    """A word of an arm's wrench means the same on one axis."""
    sign = 1 if word == "action" else -1
    _, found = ask(capsys, log, *OWN, "--force-sign", word)
    own = identify(read_log(log, **COLUMNS), force_sign=sign)
    assert found["options"]["force_sign"] == sign
    assert found["parameters"]["K"]["value"] == own.parameters["K"].value


@pytest.mark.parametrize(
    "words",
    [pytest.param(["--indenter", "sphere:10:mm"], marks=pytest.mark.long), ["--indenter", "sphere:10mm"]],
)
def test_an_indenter_adds_youngs_modulus(log, capsys, words):
    _, found = ask(capsys, log, *OWN, *words, "--poisson", "0.45:0.02")
    own = found["parameters"]["E"]
    assert own["unit"] == "Pa"
    assert own["reason"]
    assert found["options"]["indenter"] == words[1]


def test_a_figure_of_somebody_else_is_not_written_over(log, capsys):
    other = log.parent / "holiday.png"
    other.write_bytes(b"a holiday")
    assert main(["identify", str(log), *OWN, "--figure", str(other)]) == 2
    assert "palpate did not write it" in capsys.readouterr().err
    assert other.read_bytes() == b"a holiday"


@pytest.mark.parametrize("words", ["0:0.5:ms", pytest.param("0.000:0.0005", marks=pytest.mark.long)])
def test_a_lag_with_its_std(log, capsys, words):
    _, found = ask(capsys, log, *OWN, "--lag", words)
    assert found["lag_s"] == {"value": 0.0, "std": 0.0005, "bound": pytest.approx(0.00098), "kind": "told"}
    assert (
        0.1 < found["parameters"]["B"]["budget"]["lag"] < 1.96 * 0.0005 * 5500
    )  # the log tells the lag, too


@pytest.mark.parametrize(
    ("words", "doubt"),
    [
        (("--position", "position_mm:m"), "'position_mm' is taken in m as given, but its name says mm"),
        pytest.param(
            ("--time", "time_s:min"), "is taken in min as given, but its name says s", marks=pytest.mark.long
        ),
        pytest.param(
            ("--force", "force_N:mN"), "is taken in mN as given, but its name says N", marks=pytest.mark.long
        ),
    ],
)
def test_a_doubtful_unit_stands_before_the_answer_which_then_is_no(log, capsys, words, doubt):
    given = dict(zip(OWN[::2], OWN[1::2], strict=True)) | {words[0]: words[1]}
    line = [word for pair in given.items() for word in pair]
    assert main(["identify", str(log), *line]) == 1
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("! ")
    head = next(i for i, text in enumerate(printed) if "stiffness" in text)
    assert any(doubt in text for text in printed[:head])
    assert "✓" not in "".join(printed)


def test_no_contact_is_an_answer_and_the_answer_is_no(log, capsys):
    rows = np.loadtxt(log, delimiter=",", skiprows=1)
    rows[:, 2] = np.random.default_rng(0).normal(0, 0.05, len(rows))
    np.savetxt(log, rows, delimiter=",", header="time_s,position_mm,force_N", comments="", fmt="%.7g")
    code, found = ask(capsys, log, *OWN)
    assert code == 1
    assert "no-contact" in codes(found)
    assert all(p["value"] is None for p in found["parameters"].values())


WRONG = {
    "unknown column": ([*OWN[:-1], "f:N"], "unknown column 'f'.*position_mm"),
    "one column": (OWN[2:4], "name the columns of .*--time, --force.*time_s"),
    "lag in what": ([*OWN, "--lag", "7.6"], "is 7.6 ms meant.*--lag 7.6:ms"),
    "lag in N": ([*OWN, "--lag", "7.6:N"], "needs one of time"),
    "lag": ([*OWN, "--lag", "late"], "--lag needs VALUE or VALUE:STD"),
    "lag in ms": (
        [*OWN, "--lag", "7.7:s"],
        "lag of 7.7 s is as long as the whole log .3 s.; give it in seconds",
    ),
    "one row": (
        [*OWN, "--end", "0.0001"],
        "has 1 row with a time of its own.*check --time, --start and --end",
    ),
    "no shape": ([*OWN, "--indenter", "ball:5:mm"], "needs sphere:RADIUS, punch:RADIUS or cone:HALF_ANGLE"),
    "no size": ([*OWN, "--indenter", "sphere"], "needs sphere:RADIUS"),
    "size of another kind": ([*OWN, "--indenter", "cone:5:mm"], "unit of length; a cone needs one of angle"),
    "size is none": ([*OWN, "--indenter", "sphere:5e:mm"], "needs sphere:RADIUS"),
    "poisson alone": ([*OWN, "--poisson", "0.3"], "add --indenter"),
    "sign": ([*OWN, "--force-sign", "2"], "force-sign"),
    "frame of one axis": ([*OWN, "--wrench-frame", "tool"], "this log has one axis"),
    "twice": (["./press.csv", *OWN], "is named twice; a log counts once"),
    "figure is a folder": ([*OWN, "--figure", "."], "is a folder; name a file with --figure"),
    "report is a folder": ([*OWN, "--report", ".."], "is a folder; name a file with --report"),
    "figure kind": ([*OWN, "--figure", "a.gif"], "name it a.png"),
    "figure folder": ([*OWN, "--figure", "none/a.png"], "no folder none"),
    "rate and time": ([*OWN, "--rate", "100"], "not both"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_wrong_input_is_one_line_and_code_2(log, capsys, kind):
    words, pattern = WRONG[kind]
    assert main(["identify", str(log), *words]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert re.search(pattern, printed.err), printed.err
    assert list(log.parent.iterdir()) == [log]


def test_every_warning_is_in_the_guide(root):
    guide = (root / "docs/answer.md").read_text()
    missing = [code.word for code in Code if f"`{code.word}`" not in guide]
    assert not missing
