"""The question before an arm moves, typed at a pseudo-terminal of its own."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest

from palpate.logs import read_record
from wires.slow_cell import PATIENCE, WORDS, arm, relayed, rows_came

pytestmark = pytest.mark.real_time


CONTROLLED = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, "-m", "palpate", *sys.argv[1:]])
"""
"""Makes the terminal the one whose keys are signals, and becomes palpate."""


class Terminal:
    """A press whose standard input and output are a terminal, as a user's are."""

    def __init__(self, words, where):
        self.ours, theirs = pty.openpty()
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "200"}
        command = [sys.executable, "-c", CONTROLLED, *map(str, words)]
        self.process = subprocess.Popen(
            command,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=where,
            env=environment,
            start_new_session=True,
        )
        os.close(theirs)
        self.text = ""

    def until(self, said):
        """Read until this was printed; None for all."""
        end = time.monotonic() + 2.0 * PATIENCE
        while said is None or said not in self.text:
            assert time.monotonic() < end, self.text
            if not select.select([self.ours], [], [], 0.2)[0]:
                continue
            try:
                data = os.read(self.ours, 4096)
            except OSError:  # the other end is closed
                data = b""
            if not data:
                break
            self.text += data.decode()
        assert said is None or said in self.text, self.text

    def typed(self, keys):
        os.write(self.ours, keys)

    def ended(self):
        """Exit code, when all was read."""
        self.until(None)
        code = self.process.wait(PATIENCE)
        os.close(self.ours)
        return code


def words_of(folder, address, *more):
    return ["press", "--wire", address, "--gains", folder / "gains.toml", *WORDS, "--record", "rec", *more]


QUESTION = "the arm will move; type press to go on"


@pytest.mark.parametrize(
    ("keys", "code", "says"),
    [
        pytest.param(b"no\n", 2, "nothing was moved", id="no"),
        pytest.param(b"\x04", 2, "nothing was moved", id="end of file"),
        pytest.param(b"\x03", 130, "", id="Ctrl-C"),
    ],
)
def test_whoever_does_not_say_so_moves_nothing(folder, tmp_path, keys, code, says):
    with arm(folder) as (_, address), relayed(address, lambda *_: None) as relay:
        terminal = Terminal(words_of(folder, relay.address), tmp_path)
        terminal.until(QUESTION)
        assert "presses with 10 N for 6 s" in terminal.text
        terminal.typed(keys)
        assert terminal.ended() == code, terminal.text
        assert not relay.commands
    assert says in terminal.text
    assert "Traceback" not in terminal.text
    assert not (tmp_path / "rec").exists()


def test_whoever_types_the_word_presses_and_ctrl_c_then_brings_the_arm_to_rest(folder, tmp_path):
    with arm(folder, "--gap", "0.05") as (_, address):
        terminal = Terminal(words_of(folder, address, "--seconds", "10"), tmp_path)
        terminal.until(QUESTION)
        terminal.typed(b"press\n")
        assert rows_came(tmp_path / "rec" / "rows.f64"), terminal.text
        terminal.typed(b"\x03")
        assert terminal.ended() == 130, terminal.text
    assert "stopped by the user (Ctrl-C); the arm rests" in terminal.text
    assert len(read_record(tmp_path / "rec" / "record.parquet")) > 20


def test_a_terminal_that_goes_away_moves_nothing(folder, tmp_path):
    with arm(folder) as (_, address), relayed(address, lambda *_: None) as relay:
        terminal = Terminal(words_of(folder, relay.address), tmp_path)
        terminal.until(QUESTION)
        os.close(terminal.ours)
        assert terminal.process.wait(PATIENCE) in {2, 130, -signal.SIGHUP}
        assert not relay.commands
