"""Whatever a name holds, nothing in it is obeyed: not by the terminal, not by rich, not by matplotlib."""

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import palpate
from palpate.cli import _terminal, main
from palpate.report.page import Table
from palpate.report.terminal import head, show_table
from palpate.text import printable

EVIL = "\x1b]0;owned\x07\x1b[2J[bold]$x^{$\u202egnp.\udcff"


@given(st.text(st.characters(categories=["L", "N", "P", "S", "Zs", "Cc", "Cf", "Cs"])))
def test_what_is_shown_holds_nothing_that_is_obeyed(text):
    safe = printable(text)
    safe.encode("utf-8")
    assert all(letter in "\n\t" or ord(letter) >= 32 for letter in safe)
    assert not set("\x7f\x9b\u202e\u2028") & set(safe)
    assert printable(safe) == safe
    if text.isascii() and text.isprintable():
        assert safe == text


def test_letters_of_any_script_stay():
    for text in ("Kraft [N] ± 3 µm", "力", "نیم‌فاصله", "é"):
        assert printable(text) == text


def test_a_console_obeys_neither_markup_nor_escapes(capsys):
    screen = _terminal.console()
    head(screen, EVIL, EVIL)
    show_table(screen, Table(EVIL, (EVIL, "value"), [(EVIL, EVIL)]))
    _terminal.place(screen, "report:", EVIL)
    screen.print(EVIL, style="yellow")
    _terminal.print_lines(EVIL)
    _terminal.say(EVIL)
    told = "".join(capsys.readouterr())
    assert "\x1b" not in told
    assert "\x07" not in told
    assert "[bold]" in told
    assert r"\x1b]0;owned\x07" in told


def test_json_is_ascii_and_none_is_null(capsys):
    _terminal.print_json({"name": "Kraft ± \x1b[2J", "value": float("nan")})
    line = capsys.readouterr().out
    assert line.isascii()
    assert line.count("\n") == 1
    assert json.loads(line) == {"name": "Kraft ± \x1b[2J", "value": None}


def test_a_log_with_a_hostile_name(capsys):
    """Refused or not, its name comes out harmless."""
    for name in ("a$x^{$b.csv", "[bold]a.csv", "\x1b[2Ja.csv"):
        table = np.column_stack([np.arange(50) / 100, np.zeros(50), np.zeros(50)])
        np.savetxt(name, table, delimiter=",", header="time_s,position_mm,force_N", comments="")
        assert main(["topics", name]) == 0
        assert "\x1b" not in "".join(capsys.readouterr())
        assert main(["topics", f"no{name}"]) == 2
        told = capsys.readouterr().err
        assert "\x1b" not in told
        assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "name", "value", "code"),
    [
        ("topics press.csv", "POLARS_MAX_THREADS", "0", 0),
        ("press --arm fr3 --force 20:N --surface K=5000,B=50 --out p", "NUMBA_DISABLE_JIT", "1", 2),
    ],
)
def test_a_library_is_not_asked_for_what_it_cannot_do(tmp_path, words, name, value, code):
    shutil.copy(Path(palpate.__file__).parent / "logs" / "press.csv", tmp_path)
    ran = subprocess.run(
        [sys.executable, "-m", "palpate", *words.split()],
        env={**os.environ, name: value},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ran.returncode, ran.stderr.count("\n")) == (code, code // 2)


@pytest.mark.parametrize(
    ("variables", "encoding", "told"),
    [
        pytest.param({"LANG": "C", "LC_ALL": "C"}, "utf-8", "± 2.1 %", marks=pytest.mark.long),
        ({"PYTHONIOENCODING": "ascii"}, "ascii", "+- 2.1 %"),
        pytest.param({"PYTHONIOENCODING": "latin-1"}, "latin-1", "± 2.1 %", marks=pytest.mark.long),
        pytest.param(
            {"TERM": "xterm-256color", "HOME": "/proc/nobody"}, "utf-8", "± 2.1 %", marks=pytest.mark.long
        ),
    ],
)
def test_little_is_needed_of_the_environment(tmp_path, variables, encoding, told):
    """With nothing but the way to programs: letters that the encoding lacks, a home that cannot be written."""
    surface = ("--stiffness", "3000", "--damping", "50", "--force", "15", "--peak", "20", "--duration", "4")
    drawn = "HOME" in variables
    ran = subprocess.run(
        [sys.executable, "-m", "palpate", "excite", *surface, *(["--figure", "excite.png"] if drawn else [])],
        env={"PATH": os.environ["PATH"], **variables},
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr == b""
    assert told in ran.stdout.decode(encoding)
    assert (tmp_path / "excite.png").is_file() == drawn


@pytest.mark.parametrize(("closed", "code"), [("2>&- <&-", 0), (">&-", 2), (">&- 2>&- <&-", 2)])
def test_an_answer_that_a_closed_stream_loses_is_an_error(closed, code, tmp_path):
    command = f"'{sys.executable}' -m palpate run --list {closed}"
    ran = subprocess.run(command, shell=True, check=False, cwd=tmp_path, capture_output=True)
    assert ran.returncode == code
    assert (ran.stdout != b"") == (code == 0)
    assert ran.stderr.count(b"\n") == (closed == ">&-")


def test_a_stream_without_a_file_is_no_trouble(monkeypatch):
    class Full(io.StringIO):
        def flush(self):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    assert main(["--version"]) == 2
