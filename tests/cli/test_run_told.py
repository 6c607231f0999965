"""`palpate run`: what is told after the run, and to whom."""

import os
import subprocess
import sys

import pytest

from cli.test_run import FILES, text_of
from palpate.bench import simulation
from palpate.cli import main


@pytest.fixture
def mine(tmp_path):
    """A quick experiment in the working folder."""
    (tmp_path / "mine.toml").write_text(text_of(), encoding="utf-8")
    return tmp_path


@pytest.mark.long
def test_a_reader_that_has_gone_loses_no_results(mine):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "palpate", "run", "mine.toml", "--out", "results"]
    with os.fdopen(writer, "w") as pipe:
        assert subprocess.run(command, check=False, stdout=pipe, timeout=300).returncode == 141
    assert {path.name for path in (mine / "results").iterdir()} == FILES


def test_a_report_that_is_not_there_is_not_named(mine, capsys, monkeypatch):
    class Interrupting:
        def run(self, *arguments):
            raise KeyboardInterrupt

    monkeypatch.setattr(simulation, "compiled_march", Interrupting())
    assert main(["run", "mine.toml", "--out", "results"]) == 130
    told = capsys.readouterr().out
    assert "report.html" not in told
    assert "the record is in results" in told
