"""`palpate study`: what it writes, what it prints, what it refuses; killed, interrupted, on a full disk."""

import json
import signal
import subprocess
import sys
import time

import polars
import pytest

from cli import asked
from palpate.cli import main
from studies.small import NEAR, SMALL, text

MANY = SMALL.replace("points = 3", "points = 60")
FILES = {
    *(f"{kind}{number}.png" for kind in ("curves", "map") for number in (1, 2, 3)),
    "report.html",
    "results.parquet",
    "runs.jsonl",
    "study.toml",
    "summary.json",
}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder, which is the working one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, *words):
    return asked.refused(capsys, "study", *words)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the studies `small.toml` and `many.toml`, and the results of the first."""
    folder = tmp_path_factory.mktemp("studies")
    for name, source in (("small", SMALL), ("many", MANY)):
        (folder / f"{name}.toml").write_text(source, encoding="utf-8")
    assert main(["study", str(folder / "small.toml"), "--out", str(folder / "small")]) == 0
    return folder


@pytest.fixture(scope="module")
def many(folder):
    """The table of the study of 240 runs, run through."""
    assert main(["study", str(folder / "many.toml"), "--out", str(folder / "many")]) == 0
    return (folder / "many" / "results.parquet").read_bytes()


def started(*words, **options):
    """`palpate study` in a process of its own."""
    command = [sys.executable, "-m", "palpate", "study", *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def wait_for(path, lines):
    """Waits until a journal has so many runs."""
    deadline = time.monotonic() + 120.0
    while not path.exists() or path.read_bytes().count(b"\n") <= lines:
        assert time.monotonic() < deadline
        time.sleep(0.003)


def test_a_study_is_printed_to_be_copied(capsys):
    assert main(["study", "learning-rate", "--print"]) == 0
    assert "[parameters]" in capsys.readouterr().out


def test_the_folder_of_results(folder):
    assert {path.name for path in (folder / "small").iterdir()} == FILES
    frame = polars.read_parquet(folder / "small" / "results.parquet")
    assert len(frame) == 12
    summary = json.loads((folder / "small" / "summary.json").read_text())
    assert summary["results"] == {"done": 12}
    means = frame.group_by("controller.ki", "surface.damping").agg(polars.col("force_rms").mean())
    best = summary["best"][0]["settings"][0]
    assert best["metric"]["value"] == pytest.approx(means["force_rms"].min())
    assert best["metric"]["half"] > 0.0
    assert (folder / "small" / "study.toml").read_text().endswith(f"\n{SMALL}")


@pytest.mark.long
def test_killed_at_any_moment_it_goes_on_and_the_table_is_the_same_to_the_byte(folder, many, tmp_path):
    out = tmp_path / "out"
    for runs in (0, 100):
        process = started(folder / "many.toml", "--out", out)
        wait_for(out / "runs.jsonl", runs)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert not (out / "results.parquet").exists()
    process = started(folder / "many.toml", "--out", out)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert (out / "results.parquet").read_bytes() == many
    assert not list(out.glob(".*"))


@pytest.mark.long
def test_ctrl_c_saves_and_says_how_to_go_on(folder, tmp_path):
    out = tmp_path / "out"
    process = started(folder / "many.toml", "--out", out)
    wait_for(out / "runs.jsonl", 20)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert output == ""
    assert errors.count("\n") == 1
    assert f"the finished runs are saved in {out}; the same command resumes" in errors
    done = (out / "runs.jsonl").read_bytes().count(b"\n") - 1
    assert 20 <= done < 240


def test_a_study_of_failures_alone_is_an_answer_and_it_is_no(tmp_path, capsys):
    (tmp_path / "far.toml").write_text(text('"wall.x" = [0.8, 0.9]'))
    assert main(["study", "far.toml", "--out", "far"]) == 1
    assert "2 of 2 runs failed: no contact was detected: after 1.5 s the tip is still" in " ".join(
        capsys.readouterr().out.split()
    )


def test_experiments_are_found_beside_the_study(tmp_path, capsys, monkeypatch):
    beside = tmp_path / "beside"
    beside.mkdir()
    assert main(["run", "foam-pi", "--print"]) == 0
    (beside / "mine.toml").write_text(capsys.readouterr().out)
    source = text('"controller.ki" = [1.0, 2.0]').replace('"foam-pi"', '"mine.toml"')
    (beside / "study.toml").write_text(source)
    assert main(["study", "beside/study.toml", "--out", "out"]) == 0


def test_what_is_wrong_is_told_in_a_line(capsys, tmp_path):
    assert "unknown study 'learning-rat'; did you mean 'learning-rate'?" in refused(capsys, "learning-rat")
    assert "no such file" in refused(capsys, "mine.toml")
    assert "no study is named" in refused(capsys)
    (tmp_path / "bad.toml").write_text(text('"controller.kii" = [1.0]', fixed=NEAR))
    assert refused(capsys, "bad.toml").startswith("palpate: bad.toml: unknown parameter 'controller.kii'")
    (tmp_path / "good.toml").write_text(SMALL)
    (tmp_path / "taken").write_text("")
    assert "is not a folder" in refused(capsys, "good.toml", "--out", "taken")
