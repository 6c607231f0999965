"""The scripts of `palpate completion` in the shells that they are for: bash, zsh and fish, as a user has them."""

import os
import pty
import re
import select
import shlex
import shutil
import subprocess
import time
from contextlib import redirect_stdout
from functools import cache
from io import StringIO

import pytest

from palpate.cli import main

PATIENCE = 60.0
"""Within which a shell answers, on whatever machine [s]."""
CASES = [
    (["iden"], {"identify"}),
    (["identify", "--wrench-f"], {"--wrench-frame"}),
    (["export", "found.json", "--to", "mu"], {"mujoco"}),
    (["export", "found.json", "--to", "m"], {"mujoco", "mjcf-spring"}),
    (["run", "foam-decoupled-"], {"foam-decoupled-printed"}),
    (["press", "--arm", "u"], {"ur5e"}),
    (["identify", "--preset", "ur"], {"ur-rtde"}),
    (["identify", "--model", "h"], {"hunt-crossley"}),
]


def needed(shell):
    """Skips where a shell is not there, and says how to have it."""
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell} on this machine (Debian: apt-get install {shell})")


@cache
def printed(shell):
    """The script of a shell, which takes a third of a second to make."""
    with redirect_stdout(StringIO()) as script:
        assert main(["completion", shell]) == 0
    return script.getvalue()


@pytest.fixture
def script(tmp_path):
    """The script of a shell, in a folder that is the working one and holds a file of no interest."""

    def made(shell, name):
        needed(shell)
        (tmp_path / name).write_text(printed(shell), encoding="utf-8")
        return tmp_path / name

    (tmp_path / "a-file.csv").touch()
    return made


@pytest.mark.parametrize(("words", "wanted"), CASES)
def test_bash(script, words, wanted):
    line = " ".join(map(shlex.quote, ["palpate", *words]))
    asked = f"COMP_WORDS=({line}); COMP_CWORD={len(words)}; _palpate"
    asks = f'source {script("bash", "own")}; {asked}; printf "%s\\n" "${{COMPREPLY[@]}}"'
    ran = subprocess.run(["bash", "--norc", "-c", asks], capture_output=True, text=True, check=True)
    assert set(ran.stdout.split()) == wanted


@pytest.mark.parametrize(("words", "wanted"), [*CASES, (["certify", "a-"], {"a-file.csv"})])
def test_fish(script, words, wanted):
    asks = f"source {script('fish', 'own')}; complete -C {shlex.quote(' '.join(['palpate', *words]))}"
    ran = subprocess.run(["fish", "--no-config", "-c", asks], capture_output=True, text=True, check=True)
    assert {line.partition("\t")[0] for line in ran.stdout.splitlines()} == wanted


def test_fish_proposes_commands_and_no_files_first(script):
    asks = f"source {script('fish', 'own')}; complete -C 'palpate '"
    ran = subprocess.run(["fish", "--no-config", "-c", asks], capture_output=True, text=True, check=True)
    proposed = {line.partition("\t")[0] for line in ran.stdout.splitlines()}
    assert {"identify", "run", "completion"} <= proposed
    assert "a-file.csv" not in proposed


class Zsh:
    """An interactive zsh, with what it needs to show the line that stands after a tabulator."""

    def __init__(self, folder):
        self._pid, self._terminal = pty.fork()
        if self._pid == 0:
            os.execvpe("zsh", ["zsh", "-f", "-i"], {**os.environ, "TERM": "dumb"})
        self._tell(
            f"PS1=; fpath=({shlex.quote(str(folder))} $fpath); autoload -Uz compinit; compinit -u -D\n"
        )
        self._tell(
            'shown() { print -r -- "<<$BUFFER>>"; zle kill-buffer }; zle -N shown; bindkey "^X" shown\n'
        )
        self._tell("print rea''dy\n")
        self._read("ready")

    def completed(self, line):
        """The line after a tabulator."""
        self._tell(f"{line}\t\x18")
        return self._read(r"<<(palpate [^>]*)>>")

    def close(self):
        os.close(self._terminal)
        os.waitpid(self._pid, 0)

    def _tell(self, text):
        os.write(self._terminal, text.encode())

    def _read(self, pattern):
        text, end = "", time.monotonic() + PATIENCE
        while (found := re.search(pattern, text)) is None:
            ready, _, _ = select.select([self._terminal], [], [], max(0.0, end - time.monotonic()))
            assert ready, f"not within {PATIENCE:.0f} s: {pattern} in {text!r}"
            text += os.read(self._terminal, 4096).decode(errors="replace")
        return found[1] if found.groups() else found[0]


@pytest.mark.long
def test_zsh(script):
    path = script("zsh", "_palpate")
    shell = Zsh(path.parent)
    try:
        assert shell.completed("palpate iden").strip() == "palpate identify"
        assert shell.completed("palpate identify --wrench-f").strip() == "palpate identify --wrench-frame"
        assert (
            shell.completed("palpate export found.json --to mu").strip()
            == "palpate export found.json --to mujoco"
        )
        assert shell.completed("palpate certify a-").strip() == "palpate certify a-file.csv"
    finally:
        shell.close()
