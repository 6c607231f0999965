"""The commands of this distribution: palpate lists them, and imports none of them for it."""

import subprocess
import sys

from palpate.cli import main


def test_palpate_lists_each_command_with_its_line(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "Measure every figure and every claim of the thesis again." in shown


def test_the_list_of_commands_imports_no_command():
    code = (
        "import sys; from palpate.cli import main; main(['--help']); print([*sys.modules], file=sys.stderr)"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "palpate_thesis.command" not in ran.stderr
    assert "'numpy'" not in ran.stderr


def test_no_suggestion_is_a_flag_that_loses_something(capsys):
    assert main(["thesis", "--replac"]) == 2
    assert "Did you mean" not in capsys.readouterr().err
