"""Every way a command can end is an exit code, and what the user can mend is one line."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.cli._program import COMMANDS, added_commands, program
from palpate.cli._streams import run_guarded
from palpate.errors import InputError, PalpateError


def raising(error):
    def command():
        raise error

    return command


def one_line(capsys) -> str:
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("palpate: ")
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.mark.parametrize("kind", [InputError, PalpateError])
def test_wrong_input_is_one_line_even_when_the_message_has_several(capsys, kind):
    assert run_guarded(raising(kind("press.csv: row 3:\n   'a' is not a number"))) == 2
    assert one_line(capsys) == "palpate: press.csv: row 3: 'a' is not a number\n"


@pytest.mark.parametrize(
    "number", [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.ENOENT, errno.EISDIR, errno.EIO]
)
def test_the_system_says_no(capsys, number):
    assert run_guarded(raising(OSError(number, os.strerror(number), "out/report.html"))) == 2
    line = one_line(capsys)
    assert "out/report.html" in line
    assert os.strerror(number) in line
    assert ";" in line, "what to do about it"


def test_an_interrupt_is_130(capsys):
    assert run_guarded(raising(KeyboardInterrupt())) == 130
    assert "interrupted" in one_line(capsys)


def test_a_defect_keeps_its_traceback_without_what_a_terminal_obeys(capsys):
    assert run_guarded(raising(ZeroDivisionError("a\x1b[31mb"))) == 70
    error = capsys.readouterr().err
    assert "Traceback" in error
    assert "\x1b" not in error
    assert "\nZeroDivisionError: a\\x1b[31mb\n" in error


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["-h"], ["identify", "--help"]])
def test_help_and_version_ask_no_file_of_options(words, capsys):
    assert main([*words, "--options=there-is-none.toml"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["identfy", "log.csv"], "identify"),
        (["runn"], "run"),
        (["--verison"], "--verison"),
        (["run", "foam-hybrid", "--sed", "1"], "--seed"),
        (["run", "foam-hybrid", "--seed", "one"], "one"),
        (["identify"], "log"),
    ],
)
def test_misspelt_words_are_answered_with_the_right_one(capsys, words, said):
    assert main(words) == 2
    line = one_line(capsys)
    assert said in line.lower()
    assert "--help" in line


def test_every_module_of_a_command_is_a_command(root):
    modules = {path.stem for path in (root / "src/palpate/cli").glob("*.py") if not path.stem.startswith("_")}
    assert modules - {"one_log", "toolkit"} == {name.replace("-", "_") for name in COMMANDS}


@pytest.mark.parametrize("command", [*COMMANDS, *added_commands()])
def test_every_flag_of_a_command_is_explained(command):
    arguments = program()[command].assemble_argument_collection(parse_docstring=True)
    assert len(arguments) > 0
    silent = [argument.name for argument in arguments if argument.show and not argument.parameter.help]
    assert not silent


BARE = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
"""As a user has it: output is buffered, and flushed once more at exit."""


def answered(*words, **streams):
    """The program's code, and what it says on standard error if that is read."""
    ran = subprocess.run([sys.executable, "-m", "palpate", *words], env=BARE, check=False, **streams)
    return ran.returncode, (ran.stderr or b"").decode()


def test_a_reader_that_leaves_is_no_error():
    reader, writer = os.pipe()
    os.close(reader)
    assert answered("--help", stdout=writer, stderr=subprocess.PIPE) == (141, "")
    os.close(writer)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("words", [("--help",), pytest.param(("run", "--list"), marks=pytest.mark.long)])
def test_a_full_disk_is_one_line(words):
    with Path("/dev/full").open("w") as full:
        code, told = answered(*words, stdout=full, stderr=subprocess.PIPE)
        assert code == 2
        assert told.count("\n") == 1
        assert "No space left" in told
        assert answered(*words, stdout=full, stderr=full)[0] == 2
        assert answered("no-such-command", stdout=subprocess.DEVNULL, stderr=full)[0] == 2
