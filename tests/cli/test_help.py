"""The help of every command: an example that can be typed, options in groups, lines that end between phrases."""

import json
import re
import shlex
import subprocess
import sys
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.cli import main
from palpate.cli._help import example, page, wrap
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
        elif re.match(r"│ (?:\*  )?--", line):
            groups[name] = groups.get(name, 0) + 1
    assert groups or command == "completion"
    assert "Parameters" not in groups
    assert max(groups.values(), default=0) <= MOST, groups


@pytest.mark.parametrize("command", ["", *ALL])
def test_no_line_is_longer_than_the_terminal(help_of, command):
    for line in help_of(*[command] if command else []).splitlines():
        assert len(line) <= WIDTH or " " not in line.strip(), line


@pytest.mark.parametrize("command", ALL)
def test_no_text_is_broken_where_its_source_was(help_of, command):
    """A line in a panel is short only where the next word would not fit, or a phrase ends."""
    lines = [line.strip("│ ").rstrip() for line in help_of(command).splitlines() if line.startswith("│")]
    inner = WIDTH - 4
    for this, following in pairwise(lines):
        if following.startswith(("-", "*")) or not this or not following:
            continue
        phrase = this.endswith((".", ",", ";", ":", ")", "]"))
        assert phrase or len(this) > 0.3 * inner - len(following.split()[0]), this


@given(
    st.lists(st.text(st.characters(categories=["L", "P"]), min_size=1, max_size=12), min_size=1, max_size=40)
)
def test_wrapping_loses_no_word_and_fits(words):
    lines = wrap(" ".join(words), 30)
    assert " ".join(lines).split() == " ".join(words).split()
    assert all(len(line) <= 30 for line in lines)


def test_a_phrase_is_kept_whole_where_that_costs_little():
    text = "Text in columns, Parquet, a spreadsheet, a bag; or the record of a run."
    assert wrap(text, 44) == ["Text in columns, Parquet, a spreadsheet,", "a bag; or the record of a run."]


def test_an_example_is_continued_as_a_shell_continues_it():
    line = (
        "palpate identify press.csv --time time_s --position position_mm:mm --force force_mN:mN > found.json"
    )
    shown = "\n".join(example(line, 50))
    assert max(len(one) for one in shown.splitlines()) <= 50
    assert shlex.split(shown.replace("\\\n", "")) == shlex.split(line)
    assert page(f"Words.\n\n{line}", 50) == f"Words.\n\n{shown}"


@pytest.mark.parametrize(
    "words",
    [
        ("run", "foam-hybrid", "--replac"),
        ("study", "learning-rate", "--yess"),
        ("export", "found.json", "--to", "newton", "--replce"),
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


@pytest.mark.parametrize(
    "shell", ["bash", *(pytest.param(s, marks=pytest.mark.long) for s in ("zsh", "fish"))]
)
def test_completion_knows_commands_and_options(capsys, shell):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for word in (*ALL, "wrench-frame", "working-point"):
        assert word in script


def test_completion_imports_nothing_heavy():
    code = "import sys; from palpate.cli import main; main(['completion', 'bash']); print([n for n in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(re.findall(r"'(\w+)'", ran.stdout.splitlines()[-1]))
    assert not loaded & {"numba", "scipy", "matplotlib", "polars", "mujoco"}


@pytest.mark.parametrize("command", ALL)
def test_the_short_help_is_usage_examples_and_eight_options(capsys, command):
    assert main([command, "-h"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"Usage: palpate {command}")
    assert lines[-1] == f"all options: palpate {command} --help"
    assert 1 <= sum(line.startswith("    palpate ") for line in lines) <= 2
    options = [line for line in lines if line.startswith("  --")]
    assert len(options) <= 8
    assert all(len(line.split()) > 1 for line in options), options
    assert len(lines) <= 40


def test_the_commands_are_in_groups(capsys):
    assert main(["--help"]) == 0
    titles = [title[1] for line in capsys.readouterr().out.splitlines() if (title := PANEL.match(line))]
    assert titles[:3] == ["From a log", "Force loop", "Simulate"]


def test_completed_models_are_those_of_the_library():
    assert MODELS == NAMES


def test_json_of_identify_is_complete(capsys, root):
    log = root / "examples" / "data" / "press.csv"
    said = {"time": "time_s", "position": "position_mm:mm", "force": "force_N:N", "lag": 0.0, "bonded": False}
    words = [
        "--time",
        "time_s",
        "--position",
        "position_mm:mm",
        "--force",
        "force_N:N",
        "--lag",
        "0",
        "--no-bonded",
    ]
    assert main(["identify", str(log), *words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["file"] == str(log)
    assert len(told["sha256"]) == 64
    assert told["version"]
    assert said.items() <= told["options"].items()
    assert told["models"]
    assert all({"model", "r2", "note"} <= set(one) for one in told["models"])
    assert [one["model"] for one in told["models"] if one["chosen"]] == [told["model"]]


def test_a_word_too_many_is_said(capsys):
    assert main(["slide", "bowl"]) == 2
    assert "Words that the command does not take: ['bowl']" in capsys.readouterr().err
