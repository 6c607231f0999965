"""The help of every command: an example that can be typed, options in groups."""

import ast
import re
import shlex

import pytest

from palpate.cli import main
from palpate.cli._program import COMMANDS, added_commands, program
from palpate.cli.options.common import MODELS
from palpate.identification.models import NAMES

ALL = [*COMMANDS, *added_commands()]
"""Those of palpate, and of the distributions beside it."""
WIDTH = 80
PANEL = re.compile(r"^╭─ (.+?) ─*╮$")
MOST = 14
"""Options that a group has at most: what a reader takes in without a search."""


@pytest.fixture(scope="module")
def pages():
    """Help that was printed, by its command: several tests look at each."""
    return {}


@pytest.fixture
def help_of(pages, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(WIDTH))

    def shown(*command):
        if command not in pages:
            assert main([*command, "--help"]) == 0
            pages[command] = capsys.readouterr().out
        return pages[command]

    return shown


def examples(text):
    """Commands of a page of help, each on one line."""
    joined = text.replace(" \\\n        ", " ")
    return [line.strip() for line in joined.splitlines() if line.startswith("    palpate ")]


@pytest.mark.parametrize("command", ALL)
def test_each_help_has_an_example_that_palpate_understands(help_of, command):
    found = [line for line in examples(help_of(command)) if line.split()[1] == command]
    assert found, f"palpate {command} --help has no example"
    for line in found:
        _, bound, _ = program().parse_args(shlex.split(line.partition(" > ")[0])[1:])
        assert bound is not None, line


@pytest.mark.parametrize("command", ALL)
def test_options_are_in_groups(help_of, command):
    groups, name = {}, ""
    for line in help_of(command).splitlines():
        if (title := PANEL.match(line)) is not None:
            name = title[1]
        elif re.match(r"│ +(?:\*  )?--", line):
            groups[name] = groups.get(name, 0) + 1
    assert groups or command == "completion"
    assert "Parameters" not in groups
    assert max(groups.values(), default=0) <= MOST, groups


def sentences(source):
    """The texts of a module that are no docstrings; what is put into them is left out."""
    tree = ast.parse(source)
    documents = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(
                str(getattr(part, "value", "")) for part in node.values if isinstance(part, ast.Constant)
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documents:
            yield node.value


def options_of(command):
    return {name for argument in program()[command].assemble_argument_collection() for name in argument.names}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_options_that_its_refusals_name_are_its_own(command, root):
    """Or of a command that imports it. A sentence about another command, `palpate topics LOG`, names its options."""
    sources = {name: (root / f"src/palpate/cli/{name}.py").read_text(encoding="utf-8") for name in COMMANDS}
    users = [name for name in COMMANDS if name == command or f"palpate.cli.{command} import" in sources[name]]
    texts = [re.split(r"palpate [a-z]", text)[0] for text in sentences(sources[command])]
    named = {option for text in texts for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", text)}
    assert named <= set().union(*map(options_of, users))


@pytest.mark.parametrize("command", ["", *ALL])
def test_no_line_is_longer_than_the_terminal(help_of, command):
    for line in help_of(*[command] if command else []).splitlines():
        assert len(line) <= WIDTH or " " not in line.strip(), line


@pytest.mark.parametrize(
    "words",
    [
        ("run", "foam-hybrid", "--replac"),
        ("press", "--wire", "ur:192.0.2.1", "--yess"),
        ("export", "found.json", "--to", "drake", "--replce"),
    ],
)
def test_no_suggestion_is_a_flag_that_loses_something(capsys, words):
    assert main(list(words)) == 2
    said = capsys.readouterr().err
    assert words[-1] in said
    assert not re.search(r"Did you mean \"?--(no-)?(force|replace|yes)", said)


def test_other_suggestions_stay(capsys):
    assert main(["identify", "x.csv", "--positon", "x"]) == 2
    assert "Did you mean --position" in capsys.readouterr().err
    assert main(["identify", "x.csv", "--forse", "x"]) == 2
    assert "--force" in capsys.readouterr().err  # of identify it is a column


def test_completed_models_are_those_of_the_library():
    assert MODELS == NAMES


def test_a_word_too_many_is_said(capsys):
    assert main(["slide", "bowl"]) == 2
    assert "Words that the command does not take: ['bowl']" in capsys.readouterr().err
