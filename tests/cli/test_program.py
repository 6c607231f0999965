"""Commands that other distributions add by entry points, and those whose distribution is missing."""

import sys

import pytest

from palpate.cli import main
from palpate.cli._program import COMPANIONS, program
from palpate.errors import how_to_install

MODULE = '''
"""A module that must not be imported for a list of commands."""
raise RuntimeError("imported")
'''
COMMAND = '''
"""A command of a stranger's."""


def polish(force: float, /) -> int:
    """Polish with a force.

    palpate polish 20

    Parameters
    ----------
    force
        Desired force [N].
    """
    print(f"polished with {force} N")
    return 1
'''


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """An installed distribution with a module of the given source, and an entry point for each of the given names."""

    def install(source, *names):
        (tmp_path / "stranger.py").write_text(source, encoding="utf-8")
        info = tmp_path / "stranger-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: stranger\nVersion: 1.0\n")
        lines = [f"{name} = stranger:polish" for name in names]
        (info / "entry_points.txt").write_text("\n".join(["[palpate.commands]", *lines]))
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, "stranger", raising=False)

    return install


def test_a_command_is_listed_by_the_first_line_of_its_docstring_and_runs(distribution, capsys):
    distribution(COMMAND, "polish")
    assert main(["--help"]) == 0
    assert "Polish with a force." in capsys.readouterr().out
    assert "stranger" not in sys.modules
    assert main(["polish", "20"]) == 1
    assert capsys.readouterr().out == "polished with 20.0 N\n"
    assert main(["polish", "--help"]) == 0
    assert "Desired force [N]." in capsys.readouterr().out


def test_a_command_within_a_package_is_listed_and_the_package_not_imported(
    distribution, tmp_path, monkeypatch, capsys
):
    distribution("", "polish")
    monkeypatch.delitem(sys.modules, "strange", raising=False)
    (tmp_path / "strange").mkdir()
    (tmp_path / "strange" / "__init__.py").write_text(MODULE, encoding="utf-8")
    (tmp_path / "strange" / "commands.py").write_text(COMMAND, encoding="utf-8")
    info = tmp_path / "stranger-1.0.dist-info" / "entry_points.txt"
    info.write_text("[palpate.commands]\npolish = strange.commands:polish\n", encoding="utf-8")
    assert main(["--help"]) == 0
    assert "Polish with a force." in capsys.readouterr().out
    assert "strange" not in sys.modules


@pytest.mark.parametrize("source", [MODULE, "def polish(:", "polish = 1"])
def test_a_broken_distribution_stops_neither_the_list_nor_another_command(distribution, capsys, source):
    distribution(source, "polish")
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "polish" in shown
    assert "identify" in shown
    assert main(["run", "--list"]) == 0


def test_no_distribution_replaces_a_command_of_palpate(distribution, capsys):
    distribution(COMMAND, "speed", "polish")
    assert main(["speed", "--help"]) == 0
    assert "one tick" in capsys.readouterr().out
    assert "polish" in [str(name) for name in program()]
    assert program()["speed"].help.startswith("Measure the time of one tick")


@pytest.mark.parametrize("command", COMPANIONS)
@pytest.mark.parametrize("more", [(), ("--help",)])
def test_a_command_whose_distribution_is_missing_says_how_to_get_it(monkeypatch, capsys, command, more):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: ())
    assert main([command, *more]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert told.err.endswith(f"which is not installed: {how_to_install(COMPANIONS[command])}\n")
