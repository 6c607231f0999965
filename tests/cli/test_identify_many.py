"""Many logs as a user names them: files, a folder, some of them bad."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from cli import asked
from identification.synthetic_contacts import pressed
from palpate.cli import main
from palpate.cli.identify import OneLog
from palpate.logs.formats import gather_logs, is_folder_of_logs, log_of, read_covariates

OWN = ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N")


def write(path, stiffness, seed):
    record = pressed(k=stiffness, seed=seed)
    table = np.column_stack([record["time"], record["position"] * 1e3, record["force"]])[::4]
    np.savetxt(path, table, delimiter=",", header="time_s,position_mm,force_N", comments="", fmt="%.7g")
    return path


@pytest.fixture
def presses(tmp_path):
    """Three presses of surfaces of 4500, 5000 and 5600 N/m, named so that the alphabet has another order."""
    folder = tmp_path / "presses"
    folder.mkdir()
    for i, stiffness in ((2, 4500), (10, 5000), (9, 5600)):
        write(folder / f"press_{i}.csv", stiffness, i)
    (folder / "README.md").write_text("not a log")
    return folder


def ask(capsys, *words):
    return asked.ask(capsys, "identify", *words, *OWN)


def test_a_folder_is_its_logs_and_what_they_say_together(presses, capsys):
    code, found = ask(capsys, presses, "--lag", "0")
    assert code == 0
    assert [log["file"].rsplit("_")[-1] for log in found["logs"]] == ["2.csv", "9.csv", "10.csv"]
    values = [log["parameters"]["K"]["value"] for log in found["logs"]]
    assert values == pytest.approx([4500, 5600, 5000], rel=0.05)
    own = found["pooled"]["parameters"]["K"]
    assert own["value"] == pytest.approx(np.mean(values), rel=0.02)
    assert own["between_std"] == pytest.approx(np.std(values, ddof=1), rel=0.1)
    low, high = own["prediction95"]
    assert low < min(values)
    assert max(values) < high
    point = found["pooled"]["working_point"]
    assert point["stiffness"]["value"] == pytest.approx(5000, rel=0.1)
    assert point["force_N"][0] < point["force_N"][1]
    _, alone = ask(capsys, presses / "press_2.csv", "--lag", "0")
    assert found["logs"][0] == {key: alone[key] for key in alone if key not in ("command", "files")}


def test_a_covariate_is_the_mean_of_a_logs_own_readings(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time_s;warm\n0;20,5\n1;-1\n2;21,5\n")
    assert read_covariates([log], ["warm"], missing=["-1"], delimiter=";")["warm"] == pytest.approx([21.0])


def test_a_log_that_fails_is_a_row_that_says_why(presses, capsys):
    (presses / "press_5.csv").write_text("time_s,position_mm,force_N\n1,2,3\n")
    code, found = ask(capsys, presses, presses.parent / "none.csv")
    assert code == 0
    errors = {log["file"].rsplit("/")[-1]: log.get("error") for log in found["logs"]}
    assert "at least 20 are needed" in errors["press_5.csv"]
    assert "there is no file" in errors["none.csv"]
    assert errors["press_2.csv"] is None
    assert found["pooled"]["parameters"]["K"]["logs"] == [0, 2, 3]


def test_where_all_fail_it_is_one_line_and_code_2(presses, capsys):
    for path in presses.glob("*.csv"):
        path.write_text("nothing")
    before = sorted(presses.parent.rglob("*"))
    assert main(["identify", str(presses), *OWN]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert "none of 3 logs can be identified: " in printed.err
    assert sorted(presses.parent.rglob("*")) == before


def test_an_interruption_keeps_what_was_done(presses, capsys, monkeypatch):
    known = OneLog.identification
    seen = []

    def third_is_interrupted(self, log):
        seen.append(log)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return known(self, log)

    monkeypatch.setattr(OneLog, "identification", third_is_interrupted)
    assert main(["identify", str(presses), *OWN, "--json"]) == 130
    printed = capsys.readouterr()
    assert len(json.loads(printed.out)["logs"]) == 2
    assert "interrupted: 2 of 3 logs" in printed.err


@pytest.mark.parametrize(
    ("words", "pattern"),
    [
        ([], "no log is named"),
        (["presses/press_2.csv", "presses"], "press_2.csv is named twice"),
        (["empty"], "holds no log"),
        (["presses", "--covariate", "temp"], "unknown column 'temp'"),
        (["presses", "--covariate", "time_s"], "time_s is the same in all 3 logs"),
        (["presses/press_2.csv", "--covariate", "temp"], "--covariate needs several logs"),
    ],
)
def test_wrong_input_is_one_line_and_code_2(presses, capsys, words, pattern):
    (presses.parent / "empty").mkdir()
    assert main(["identify", *words, *OWN]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert re.search(pattern, printed.err), printed.err


def test_a_bag_s_own_folder_is_one_log(presses):
    bag = presses / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:")
    (presses / "sub").mkdir()
    (presses / ".hidden.csv").write_text("")
    names = [path.name for path in gather_logs([presses])]
    assert names == ["bag", "press_2.csv", "press_9.csv", "press_10.csv"]
    assert gather_logs([bag]) == (bag,)


def test_the_folder_of_a_run_is_one_log(tmp_path):
    """Its record is meant; a folder of such folders holds as many logs, and a record alone in a folder is no run."""
    for name in ("run-1", "run-2"):
        (tmp_path / name).mkdir()
        for file in ("record.parquet", "summary.json", "report.html"):
            (tmp_path / name / file).touch()
    records = tuple(tmp_path / name / "record.parquet" for name in ("run-1", "run-2"))
    assert log_of(tmp_path / "run-1") == records[0]
    assert gather_logs([tmp_path]) == records
    assert not is_folder_of_logs(tmp_path / "run-1")
    (tmp_path / "run-1" / "summary.json").unlink()
    assert is_folder_of_logs(tmp_path / "run-1")
