"""The commands of this distribution: palpate lists them, imports none of them for it, and explains each flag."""

import shlex
import subprocess
import sys
import tomllib
from importlib.metadata import version

import pytest
from packaging.requirements import Requirement

from meta.test_lock import pins
from palpate.cli import _program, main

COMMANDS = ("thesis", "laboratory")


def test_palpate_lists_each_command_with_its_line(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "Measure every figure and every claim of the thesis again." in shown
    assert "Infer the thesis' laboratory from its own sentences; resumable." in shown


def test_the_list_of_commands_imports_no_command():
    code = (
        "import sys; from palpate.cli import main; main(['--help']); print([*sys.modules], file=sys.stderr)"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "palpate_thesis.commands.thesis" not in ran.stderr
    assert "'numpy'" not in ran.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_its_help_has_an_example_that_palpate_understands(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert all(len(line) <= 80 for line in shown.splitlines())
    examples = [line.strip() for line in shown.splitlines() if line.startswith(f"    palpate {command} ")]
    assert examples
    for line in examples:
        _, bound, _ = _program.program().parse_args(shlex.split(line)[1:])
        assert bound is not None, line


@pytest.mark.parametrize("command", COMMANDS)
def test_every_flag_is_explained(command):
    arguments = _program.program()[command].assemble_argument_collection(parse_docstring=True)
    assert len(arguments) > 0
    assert not [argument.name for argument in arguments if argument.show and not argument.parameter.help]


def test_no_suggestion_is_a_flag_that_loses_something(capsys):
    assert main(["thesis", "--replac"]) == 2
    assert "Did you mean" not in capsys.readouterr().err


def test_what_it_declares_is_in_the_lock_of_palpate(root):
    """So that one lock serves both, and installs nothing for this distribution alone."""
    text = (root / "packages/palpate-thesis/pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    palpate = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = {wanted.name: wanted.specifier for wanted in map(Requirement, project["dependencies"])}
    assert needed.pop("palpate").contains(palpate["version"])
    assert needed.keys() <= {Requirement(line).name for line in palpate["dependencies"]}
    locked = pins(root, "run")
    for name, specifier in needed.items():
        (pin,) = locked[name].specifier
        assert specifier.contains(pin.version), name
    assert project["version"] == palpate["version"] == version("palpate-thesis")
