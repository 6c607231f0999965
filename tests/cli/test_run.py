"""`palpate run`: what it writes, what it prints, and what it refuses."""

import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

import palpate.logs
from cli import asked
from cli.asked import References
from palpate.bench import names, simulation, source
from palpate.bench.force_input import COLUMNS
from palpate.bench.tables import FILES as EXPERIMENTS
from palpate.cli import main
from palpate.logs import read_record

# Contact after some 150 ms.
NEAR = """
[robot]
start = [0.4635, 0.0, 0.0]
"""
FILES = {
    "record.parquet",
    "summary.json",
    "report.html",
}


def refused(capsys, *words):
    return asked.refused(capsys, "run", *words)


def text_of(**lines):
    """The text of foam-hybrid, near the wall; each keyword replaces the line of that key."""
    text = source("foam-hybrid") + NEAR
    lines = {"press": 0.3, "hold": 0.05, "first": 0.470, "step": 0.002, "period": 0.1} | lines
    for key, value in lines.items():
        pattern = re.compile(rf"^{key} = [^#\n]*", re.MULTILINE)
        assert pattern.search(text), key
        text = pattern.sub(f"{key} = {value} ", text, count=1)
    return text


@pytest.fixture
def mine(tmp_path):
    """A quick experiment in a file, in an empty folder that is the working one."""
    file = tmp_path / "mine.toml"
    file.write_text(text_of(), encoding="utf-8")
    return file


def nothing_but(folder, *names):
    assert {path.name for path in folder.iterdir()} == set(names)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A run of the quick experiment with seed 3: the folder that it was typed in, and what was printed."""
    folder, printed = tmp_path_factory.mktemp("typed"), StringIO()
    (folder / "mine.toml").write_text(text_of(), encoding="utf-8")
    with chdir(folder), redirect_stdout(printed):
        assert main(["run", "mine.toml", "--seed", "3", "--out", "results"]) == 0
    return folder, printed.getvalue()


def test_a_run_leaves_a_folder_of_results(done):
    typed_in, shown = done
    folder = typed_in / "results"
    nothing_but(folder, *FILES)
    nothing_but(typed_in, "mine.toml", "results")
    assert str(folder.name) in shown
    for words in ("settling", "overshoot", "K [N/m]", "B [N s/m]", "M [kg]", "truth", "5200"):
        assert words in shown
    record = read_record(folder / "record.parquet")
    assert dict(record.units) == COLUMNS
    assert record.meta["seed"] == 3
    assert record.meta["command"] == "palpate run mine.toml --seed 3"
    assert (record["phase"] == 1.0).sum() == 300
    for png in folder.glob("*.png"):
        assert png.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_the_report_opens_without_a_network(done):
    page = (done[0] / "results" / "report.html").read_text(encoding="utf-8")
    references = References()
    references.feed(page)
    assert all(r.startswith("data:") for r in references.found)
    assert "default-src &#39;none&#39;" in page
    assert "unsafe-eval" not in page
    assert "stiffness = 5200.0" in page, "the experiment's file"
    assert "palpate run mine.toml --seed 3" in page


@pytest.mark.long
def test_the_same_seed_writes_the_same_record_and_prints_its_summary(mine, done, capsys):
    """To a folder named after experiment and seed; another seed writes another: see the bench's own tests."""
    assert main(["run", "mine.toml", "--seed", "3", "--json"]) == 0
    folder = mine.parent / "runs" / "mine-3"
    assert (folder / "report.html").is_file()
    summary = json.loads((folder / "summary.json").read_text())
    assert summary.items() <= json.loads(capsys.readouterr().out).items()
    a, b = (read_record(at / "record.parquet") for at in (folder, done[0] / "results"))
    for name in COLUMNS:
        np.testing.assert_array_equal(a[name], b[name])


@pytest.fixture(scope="module")
def evil(tmp_path_factory):
    """The results of a longer press by a file whose name and text are no good HTML."""
    folder = tmp_path_factory.mktemp("evil")
    text = text_of(press=2.0, title='"</title><script>alert(1)</script>"', about='"<b>&"')
    (folder / "evil name.toml").write_text(text, encoding="utf-8")
    with chdir(folder):
        assert main(["run", "evil name.toml", "--out", "results"]) == 0
    return folder / "results"


def test_what_is_in_the_file_cannot_break_the_page(evil):
    page = (evil / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "&lt;script&gt;" in page
    assert "palpate run &#39;evil name.toml&#39; --seed 0" in page


def test_no_contact_is_an_answer_and_exit_code_1(mine, capsys):
    mine.write_text(text_of(x=0.5) + "\n", encoding="utf-8")
    mine.write_text(mine.read_text().replace("press = 0.3", "press = 0.3\nduration = 0.5"), encoding="utf-8")
    assert main(["run", "mine.toml", "--out", "results"]) == 1
    assert "no contact was detected" in capsys.readouterr().out
    nothing_but(mine.parent / "results", *FILES)
    summary = json.loads((mine.parent / "results" / "summary.json").read_text())
    assert summary["end"] == "no contact"
    assert summary["force"] is None


@pytest.mark.long
def test_a_reader_that_has_gone_loses_no_results(mine):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "palpate", "run", "mine.toml", "--out", "results"]
    with os.fdopen(writer, "w") as pipe:
        assert subprocess.run(command, check=False, stdout=pipe, timeout=300).returncode == 141
    assert {path.name for path in (mine.parent / "results").iterdir()} == FILES


def test_a_report_that_is_not_there_is_not_named(mine, capsys, monkeypatch):
    class Interrupting:
        def run(self, *arguments):
            raise KeyboardInterrupt

    monkeypatch.setattr(simulation, "compiled_march", Interrupting())
    assert main(["run", "mine.toml", "--out", "results"]) == 130
    told = capsys.readouterr().out
    assert "report.html" not in told
    assert "the record is in results" in told
    assert len(read_record(mine.parent / "results" / "record.parquet")) == 0


def test_the_list_is_a_name_a_line_and_what_it_does(capsys):
    assert main(["run", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == EXPERIMENTS.names()
    assert all(len(line.split()) > 2 for line in lines)


@pytest.mark.parametrize("name", names())
def test_print_shows_a_file_that_can_be_run(name, capsys):
    assert main(["run", name, "--print"]) == 0
    assert capsys.readouterr().out == source(name)


@pytest.mark.parametrize("seed", ["-1", "1.5", "many"])
def test_a_seed_is_a_whole_number_from_zero_on(mine, capsys, seed):
    assert "seed" in refused(capsys, "mine.toml", "--seed", seed).lower()
    nothing_but(mine.parent, "mine.toml")


def test_results_are_not_written_over(mine, done, capsys):
    results = shutil.copytree(done[0] / "results", mine.parent / "results")
    before = (results / "record.parquet").read_bytes()
    assert "--replace" in refused(capsys, "mine.toml", "--seed", "9", "--out", "results")
    assert (results / "record.parquet").read_bytes() == before


def test_figures_that_cannot_be_written_are_refused(mine, capsys):
    assert "--figures must be of png, svg, pdf, got 'gif'" in refused(capsys, "mine.toml", "--figures", "gif")
    assert "--dpi must be from" in refused(capsys, "mine.toml", "--dpi", "5")


def test_a_full_disk_leaves_nothing(mine, done, capsys, monkeypatch):
    """Behind a run that has compiled the loop, which says so while it waits."""

    def full(record, path):
        path.write_bytes(b"half a rec")
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("palpate.logs.tables.parquet.write_record", full)
    assert "No space left" in refused(capsys, "mine.toml", "--out", "results")
    nothing_but(mine.parent, "mine.toml")


@pytest.mark.long
def test_the_first_run_says_what_it_waits_for_and_the_second_does_not(mine):
    """Of a package and a cache of its own: the first empty, the second not changed by whoever works on it."""
    package = shutil.copytree(
        Path(palpate.__file__).parent,
        mine.parent / "src" / "palpate",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    environment = {
        **os.environ,
        "PYTHONPATH": str(package.parent),
        "NUMBA_CACHE_DIR": str(mine.parent / "cache"),
        "MPLBACKEND": "Agg",
    }

    def run(out):
        command = [sys.executable, "-m", "palpate", "run", "mine.toml", "--out", out]
        return subprocess.run(
            command, capture_output=True, text=True, env=environment, timeout=600, check=False
        )

    first, second = run("first"), run("second")
    assert first.returncode == second.returncode == 0, first.stderr + second.stderr
    assert "compiling the loop" in first.stdout + first.stderr
    assert "compiling" not in second.stdout + second.stderr
    one, other = (read_record(mine.parent / out / "record.parquet") for out in ("first", "second"))
    for name in COLUMNS:
        np.testing.assert_array_equal(one[name], other[name])


@pytest.mark.long
def test_the_verdict_is_that_of_identify(evil, capsys):
    """On whatever was run: the page, the summary and `palpate identify` of the record say one thing."""
    assert main(["identify", str(evil / "record.parquet"), "--json"]) in {0, 1}
    found = json.loads(capsys.readouterr().out)
    summary = json.loads((evil / "summary.json").read_text())
    assert summary["identification"]["parameters"] == found["parameters"]
    page = (evil / "report.html").read_text(encoding="utf-8")
    for own in found["parameters"].values():
        assert f">{own['verdict']}</span>" in page
