"""A Ctrl-C is never lost: not in an import, not in a finaliser, not while results are written."""

import os
import signal
import subprocess
import sys
import time

import pytest

from cli.test_run import text_of
from palpate.cli import main
from palpate.cli._streams import notice_signals
from palpate.logs import read_record
from palpate.press import prepare
from palpate.press.prepare import prepare_press
from palpate.report.run import figures as pages

PRELUDE = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from palpate.cli import _streams
from palpate.cli._streams import run_guarded
_streams.keep()
"""


def ended(code, *words):
    """A process that runs the code and then sleeps as a command does."""
    text = f"{PRELUDE}{code}\nraise SystemExit(run_guarded(lambda: time.sleep(20)))"
    return subprocess.run(
        [sys.executable, "-c", text, *words], capture_output=True, text=True, check=False, timeout=60
    )


def test_one_that_falls_into_a_finaliser_comes_again():
    code = """
class Left:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.001)

left = Left()
del left
"""
    ran = ended(code)
    assert (ran.returncode, ran.stderr) == (130, "palpate: interrupted\n")


def test_one_that_falls_into_an_import_waits_for_its_end(tmp_path):
    (tmp_path / "heavy.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(0.01)\nwhole = True\n"
    )
    ran = ended("sys.path.insert(0, sys.argv[1])\nimport heavy\nassert heavy.whole", str(tmp_path))
    assert (ran.returncode, ran.stderr) == (130, "palpate: interrupted\n")


def test_within_noticed_nothing_is_raised_and_it_is_told():
    with notice_signals() as came:
        assert not came()
        os.kill(os.getpid(), signal.SIGINT)
        deadline = time.monotonic() + 5.0
        while not came():
            assert time.monotonic() < deadline
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1.0)


@pytest.mark.long
def test_results_that_are_being_written_are_written(tmp_path, monkeypatch):
    """It comes while the page is made: everything is there, and the code says that it came."""
    (tmp_path / "mine.toml").write_text(text_of(), encoding="utf-8")
    page = pages.page

    def interrupted(*words):
        os.kill(os.getpid(), signal.SIGINT)
        return page(*words)

    monkeypatch.setattr(pages, "page", interrupted)
    assert main(["run", "mine.toml", "--out", "results"]) == 130
    assert (tmp_path / "results" / "report.html").is_file()
    assert read_record(tmp_path / "results" / "record.parquet").meta["end"] == "done"


@pytest.mark.long
@pytest.mark.parametrize("error", [MemoryError("Unable to allocate"), OSError(28, "No space left on device")])
def test_what_cannot_be_drawn_does_not_lose_what_was_simulated(tmp_path, monkeypatch, capsys, error):
    (tmp_path / "mine.toml").write_text(text_of(), encoding="utf-8")

    def full(*words):
        raise error

    monkeypatch.setattr(pages, "build_figure", full)
    assert main(["run", "mine.toml", "--out", "results", "--figures", "png"]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert "the record is in results" in line
    assert len(read_record(tmp_path / "results" / "record.parquet"))
    assert not (tmp_path / "results" / "report.html").exists()


@pytest.mark.parametrize(
    "name", ["SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGALRM", "SIGXCPU", "SIGPWR"]
)
def test_within_noticed_no_signal_ends_or_halts_and_each_has_its_code(name):
    number = getattr(signal, name)
    before = signal.getsignal(number)
    with notice_signals() as came:
        assert came.reason is None
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), signal.SIGTERM)  # the first one counts
        time.sleep(0.01)
        assert came()
        assert (came.code, came.reason) == (128 + number, f"stopped by the user ({name})")
    assert signal.getsignal(number) == before


def test_a_signal_without_a_name_has_its_number():
    with notice_signals() as came:
        os.kill(os.getpid(), signal.SIGRTMIN + 1)
        time.sleep(0.01)
        assert came.reason == f"stopped by the user (signal {signal.SIGRTMIN + 1})"


def test_a_hang_up_that_is_ignored_and_a_handler_of_somebody_else_are_left():
    heard = []
    before = (
        signal.signal(signal.SIGUSR2, lambda *_: heard.append("other")),
        signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    try:
        with notice_signals() as came:
            os.kill(os.getpid(), signal.SIGHUP)
            os.kill(os.getpid(), signal.SIGUSR2)
            time.sleep(0.01)
            assert not came()
            assert heard == ["other"]
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGUSR2, before[0])
        signal.signal(signal.SIGHUP, before[1])


def test_a_press_before_its_first_tick_leaves_nothing(tmp_path, monkeypatch, capsys):
    def interrupted(*words):
        os.kill(os.getpid(), signal.SIGINT)
        return prepare_press(*words)

    monkeypatch.setattr(prepare, "prepare_press", interrupted)
    folder = tmp_path / "press"
    words = ["press", "--arm", "fr3", "--force", "20:N", "--surface", "K=5000,B=50", "--out", str(folder)]
    assert main(words) == 130
    assert capsys.readouterr().err == "palpate: interrupted\n"
    assert not folder.exists()
