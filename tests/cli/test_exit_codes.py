"""The default command on every log: it never ends as a defect, and its exit code is that of its verdicts."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import palpate
from cli import hostile_logs
from cli.typed_logs import TypedLog, logs_of_the_project, measured_logs
from palpate.cli import main
from palpate.report.identification import charts, page

NAMED = ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N")
DOUBTS = {"unit-doubtful", "time-doubtful", "columns-swapped", "unit-guess"}
QUICK = {"press.csv", "ensaio10.mat", "names_glued.tab", "press.h5", "LICENSE"}
"""Logs that also stand in the short run: an answer, a press, no answer, and files that are no logs."""


def _parameter(log):
    quick = log.path.name in QUICK and "--bonded" not in log.words
    return pytest.param(log, id=log.name, marks=() if quick else pytest.mark.long)


LOGS = [_parameter(log) for log in (*logs_of_the_project(), *measured_logs())]


OTHER_SIZES = [("0", "24"), ("²", "²"), ("-5", "0")]
"""Columns and lines of a terminal, beside the smallest."""


def identify(capfd, *words):
    """Exit code, standard output and standard error of `palpate identify`, of compiled libraries, too."""
    code = main(["identify", *map(str, words)])
    printed = capfd.readouterr()
    return code, printed.out, printed.err


def wanted_code(answer):
    """0 if the working point's stiffness or a parameter is identified and no unit or column is in doubt, else 1."""
    point = answer["working_point"]
    verdicts = [p["verdict"] for p in answer["parameters"].values()]
    verdicts += [point["stiffness"]["verdict"]] if point else []
    doubts = {warning["code"] for warning in answer["warnings"]} & DOUBTS
    return 0 if "identified" in verdicts and not doubts else 1


def check(capfd, log, *words):
    """Run the command with and without --json, and hold code, verdicts, text and picture against each other.

    Returns:
        The code, and the object that was printed; none where the log is refused.
    """
    code, text, said = identify(capfd, log, *words, "--figure", "picture.png")
    code_of_json, out, error = identify(capfd, log, *words, "--json")
    assert code == code_of_json
    if code == 2:
        assert text == out == ""
        assert said == error
        assert said.count("\n") == 1
        return code, None
    assert said == error == ""
    answer = json.loads(out)
    assert code == wanted_code(answer)
    assert ("✓ identified" in text) == (code == 0)
    assert ("figure: picture.png" in text) == Path("picture.png").exists()
    return code, answer


@pytest.mark.parametrize("log", LOGS)
def test_exit_code_of_every_log_follows_its_verdicts(log: TypedLog, capfd, elsewhere):
    check(capfd, log.path, *log.words.split())


CODES = {"only_unloading": 0, "fracture": 0, "one_touch": 1, "fluid": 1, "free_motion": 1, "no_number": 2}


@pytest.mark.parametrize("words", [pytest.param((), marks=pytest.mark.long), NAMED], ids=["bare", "named"])
@pytest.mark.parametrize("make", hostile_logs.HOSTILE, ids=lambda make: make.__name__)
def test_hostile_logs_end_as_an_answer_or_one_line(make, words, capfd, elsewhere):
    code, _ = check(capfd, hostile_logs.write_log(elsewhere, make()), *words)
    assert not words or code == CODES.get(make.__name__, code)


@pytest.mark.parametrize(
    "make",
    [
        hostile_logs.only_unloading,
        pytest.param(hostile_logs.only_unloading_in_contact, marks=pytest.mark.long),
    ],
)
def test_an_unloading_is_drawn_where_there_is_no_loading(make, capfd, elsewhere):
    log = hostile_logs.write_log(elsewhere, make())
    code, text, said = identify(capfd, log, *NAMED, "--figure", "log.png", "--report", "page.html")
    assert (code, said) == (0, "")
    assert text.endswith("figure: log.png\nreport: page.html\n")
    assert (elsewhere / "log.png").exists()
    found = palpate.identify_log(log)
    (press,) = (chart for chart in charts.evidence_charts(found, found.traces) if chart.title == "Press")
    labels = [series.label for series in press.series]
    assert "unloading" in labels
    assert "loading" not in labels


def fail(*_, **__):
    raise ValueError("a defect\nof a drawing")


@pytest.mark.parametrize(
    "words",
    [(), pytest.param(("--json",), marks=pytest.mark.long)],
    ids=["text", "json"],
)
def test_a_picture_that_fails_is_one_line_after_the_answer(words, capfd, elsewhere, monkeypatch):
    log = hostile_logs.write_log(elsewhere, hostile_logs.only_unloading())
    answer = identify(capfd, log, *NAMED, *words)[1]
    monkeypatch.setattr(charts, "_window", fail)
    ended, text, said = identify(capfd, log, *NAMED, *words, "--figure", "log.png")
    assert ended == 0
    assert text.replace(" --figure log.png", "") == answer
    assert said.count("\n") == 1
    assert said.startswith("palpate: log.png is not drawn: ValueError in charts.py, line ")
    assert "a defect of a drawing" in said
    assert [*elsewhere.iterdir()] == [log]


def test_a_page_that_fails_leaves_figure_and_table(capfd, elsewhere, monkeypatch):
    log = hostile_logs.write_log(elsewhere, hostile_logs.only_unloading())
    monkeypatch.setattr(page, "_figures", fail)
    code, text, said = identify(
        capfd, log, *NAMED, "--figure", "log.png", "--report", "page.html", "--table", "t.csv"
    )
    assert code == 0
    assert text.endswith("figure: log.png\ntable: t.csv\n")
    assert said.count("\n") == 1
    assert said.startswith("palpate: page.html is not drawn: ValueError")


@pytest.mark.parametrize(
    ("names", "code"),
    [(("fluid", "only_unloading"), 0), (("fluid", "one_touch"), 1), (("no_number", "only_unloading"), 0)],
)
def test_a_folder_is_identified_if_one_of_its_logs_is(names, code, capfd, elsewhere):
    (elsewhere / "logs").mkdir()
    for name in names:
        hostile_logs.write_log(elsewhere / "logs", getattr(hostile_logs, name)(), f"{name}.csv")
    ended, _, said = identify(capfd, "logs", *NAMED)
    assert (ended, said) == (code, "")


def test_a_unit_that_is_guessed_from_values_is_no_identification(capfd, elsewhere):
    """Milliseconds from 1970, unless the user states them; a unit in a name is the file's own statement."""
    rows = hostile_logs.only_unloading()
    rows[:, 0] = 1.7e12 + 1e3 * rows[:, 0]
    log = elsewhere / "log.csv"
    np.savetxt(log, rows, delimiter=",", header="t,position_mm,force_N", comments="", fmt="%.9f")
    columns = ("--position", "position_mm", "--force", "force_N")
    code, text, _ = identify(capfd, log, "--time", "t", *columns)
    assert code == 1
    assert text.startswith("! no unit was given for 't': ms is taken from its values")
    assert "✓ identified" not in text
    code, out, _ = identify(capfd, log, "--time", "t:ms", *columns, "--json")
    assert code == 0
    assert {w["code"] for w in json.loads(out)["warnings"]} & {"unit-guess", "unit-stated"} == {"unit-stated"}


@pytest.mark.parametrize(("unit", "code"), [("", 1), (":uN", 0)])
def test_a_soft_surface_is_in_doubt_unless_its_units_are_stated(unit, code, capfd, elsewhere):
    """As soft as a cell: text, JSON and Python have one verdict."""
    rows = hostile_logs.only_unloading()
    rows[:, 2] *= 1e-6 if code else 1.0
    log = hostile_logs.write_log(elsewhere, rows, head="t,a,b")
    words = ("--time", "t:s", "--position", "a:mm", "--force", f"b{unit}")
    ended, answer = check(capfd, log, *words)
    assert ended == code
    verdicts = {p["verdict"] for p in (*answer["parameters"].values(), answer["working_point"]["stiffness"])}
    assert ("identified" in verdicts) == (code == 0)
    found = palpate.identify(log, time="t:s", position="a:mm", force=f"b{unit}")
    assert ("unit-doubtful" in found.codes) == (code == 1)


@pytest.mark.parametrize("column", ["position", "force", "both"])
def test_tiny_numbers_are_refused_and_no_library_writes(column, capfd, elsewhere):
    """Squares of 1e-303 are 0: a fit to them fails within LAPACK, which writes on standard output itself."""
    rows = hostile_logs.only_unloading()
    places = {"position": [1], "force": [2], "both": [1, 2]}[column]
    rows[:, places] = 1e-303 * np.round(rows[:, places], 3)
    log = hostile_logs.write_log(elsewhere, rows, head="time_s,a,b")
    code, text, said = identify(capfd, log)
    assert (code, text) == (2, "")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("columns", "lines"),
    [("1", "24"), *(pytest.param(*size, marks=pytest.mark.long) for size in OTHER_SIZES)],
)
def test_no_size_of_a_terminal_spoils_an_answer_or_the_help(columns, lines, capfd, elsewhere, monkeypatch):
    log = hostile_logs.write_log(elsewhere, hostile_logs.only_unloading())
    usual = identify(capfd, log, *NAMED)
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("LINES", lines)
    assert identify(capfd, log, *NAMED) == usual
    monkeypatch.setenv("COLUMNS", columns)
    assert main(["--help"]) == 0
    printed = capfd.readouterr()
    assert printed.err == ""
    assert "Identify the touched surface" in printed.out


@pytest.mark.parametrize("count", [6, 63])
def test_too_few_open_files_are_one_line(count, elsewhere):
    log = hostile_logs.write_log(elsewhere, hostile_logs.only_unloading())
    line = f"ulimit -n {count} && exec {sys.executable} -m palpate identify {log}"
    ran = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert ran.stderr == (
        f"palpate: this process may have {count} files open, and its libraries need 64; raise the limit with: ulimit -n"
        " 1024\n"
    )
