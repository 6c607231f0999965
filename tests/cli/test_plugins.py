"""Code that a file names runs only by the user's word: --plugins, an answer at a terminal, a name that is typed."""

import os
import pty
import select
import subprocess
import sys
import time

import pytest

from palpate.bench.tables import load
from palpate.cli import main
from palpate.errors import InputError
from palpate.plugins import consent, permit, plugin
from studies.small import text

EXPERIMENT = 'title = "T"\nsurface = {{ kind = "kelvin-voigt", stiffness = 5e3 }}\n{}'
NAMED = {
    "controller": 'controller = {{ kind = "{}:Name" }}',
    "surface": 'surface = {{ kind = "{}:Name" }}',
    "identifier": 'identifier = {{ kind = "{}:Name" }}',
}


@pytest.fixture
def traitor(tmp_path, monkeypatch, request):
    """A module beside the file that leaves a trace when it is imported; its name."""
    monkeypatch.chdir(tmp_path)
    name = f"traitor_{abs(hash(request.node.name))}"
    (tmp_path / f"{name}.py").write_text('open("ran", "w").close()\n\n\ndef Name(look):\n    return 1.0\n')
    return name


def write(folder, traitor, role):
    """An experiment that names the module as one of its parts."""
    named = NAMED[role].format(traitor)
    body = f'title = "T"\n{named}' if role == "surface" else EXPERIMENT.format(named)
    (folder / "e.toml").write_text(body)


@pytest.mark.parametrize("role", NAMED)
@pytest.mark.parametrize("words", [("run", "e.toml"), ("checks", "e.toml"), ("live", "--run", "e.toml")])
def test_a_file_runs_no_code_without_a_word(words, role, traitor, tmp_path, capsys):
    write(tmp_path, traitor, role)
    assert main([*words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "e.toml" in said
    assert f"{traitor}:Name" in said
    assert "--plugins" in said
    assert not (tmp_path / "ran").exists()
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("parameters", "more"),
    [
        ("a = [1.0]", {"metrics": '["{}:Name"]'}),
        ('[parameters.law.cases]\nPI = {{}}\nmine = {{ controller = {{ kind = "{}:Name" }} }}', {}),
        ('"controller" = [{{ kind = "{}:Name" }}]', {}),
    ],
    ids=["metric", "case", "value"],
)
def test_a_study_runs_no_code_without_a_word(parameters, more, traitor, tmp_path, capsys):
    source = text(parameters.format(traitor), **{key: value.format(traitor) for key, value in more.items()})
    (tmp_path / "s.toml").write_text(source.replace("a = [1.0]", '"surface.stiffness" = [1000.0]'))
    assert main(["study", "s.toml"]) == 2
    said = capsys.readouterr().err
    assert "--plugins" in said
    assert not (tmp_path / "ran").exists()


def test_the_word_of_the_command_line_runs_it(traitor, tmp_path, capsys):
    write(tmp_path, traitor, "controller")
    assert main(["run", "e.toml", "--plugins"]) == 2, "it is no class"
    assert (tmp_path / "ran").exists()
    assert "--plugins" not in capsys.readouterr().err


def test_a_name_that_is_typed_is_the_users_own_word(traitor, tmp_path, capsys):
    assert main(["checks", f"{traitor}:Name"]) == 2, "it is no class"
    assert (tmp_path / "ran").exists()
    assert "--plugins" not in capsys.readouterr().err


def test_an_experiment_that_a_study_names_runs_no_code_either(traitor, tmp_path, capsys):
    write(tmp_path, traitor, "controller")
    (tmp_path / "s.toml").write_text(
        'title = "S"\nexperiment = "e.toml"\nmetrics = ["force_rms"]\n'
        '[parameters]\n"surface.stiffness" = [1000.0]\n'
    )
    assert main(["study", "s.toml"]) == 2
    assert "--plugins" in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


def test_a_script_permits_names(traitor, tmp_path):
    write(tmp_path, traitor, "controller")
    with pytest.raises(InputError, match=r"palpate\.plugins\.permit"):
        load("e.toml")
    with consent(lambda name: False):  # whatever is permitted within a test is forgotten after it
        permit(f"{traitor}:Other")
        with pytest.raises(InputError, match="names code"):
            plugin(f"{traitor}:Name")
        permit(f"{traitor}:Name")
        assert plugin(f"{traitor}:Name").name == f"{traitor}:Name"
    with pytest.raises(InputError, match="names code"):
        plugin(f"{traitor}:Name")


@pytest.mark.long
@pytest.mark.parametrize(
    ("answer", "runs"), [(b"y\n", True), (b"n\n", False), (b"\n", False), (b"\x04", False)]
)
def test_a_terminal_is_asked(answer, runs, traitor, tmp_path):
    write(tmp_path, traitor, "controller")
    own, theirs = pty.openpty()
    command = [sys.executable, "-m", "palpate", "run", "e.toml"]
    with subprocess.Popen(command, cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs) as process:
        os.close(theirs)
        said = _heard(own, b"[y/n]")
        os.write(own, answer)
        said += _heard(own, None)
        assert process.wait(60) == 2
    os.close(own)
    assert traitor.encode() in said.replace(b"\r\n", b"")
    assert b"Traceback" not in said
    assert (tmp_path / "ran").exists() == runs


def _heard(terminal, until):
    """What a terminal shows, until a word, or the end."""
    said, latest = b"", time.monotonic() + 60.0
    while time.monotonic() < latest and (until is None or until not in said):
        if not select.select([terminal], [], [], 0.2)[0]:
            continue
        try:
            piece = os.read(terminal, 4096)
        except OSError:  # the other end has gone
            break
        if not piece:
            break
        said += piece
    return said


RAISES = {
    "where it is imported": 'class Evil(BaseException):\n    pass\n\n\nraise Evil("a\\x1b[31mb\\nc")\n',
    "where its name is looked up": (
        "class Evil(BaseException):\n    pass\n\n\ndef __getattr__(name):\n"
        '    if name == "Name":\n        raise Evil("a\\x1b[31mb\\nc")\n    raise AttributeError\n'
    ),
}


@pytest.mark.parametrize("where", RAISES)
def test_what_is_raised_beside_exceptions_is_one_line_without_escapes(where, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name = f"evil_{where.split()[-1]}"
    (tmp_path / f"{name}.py").write_text(RAISES[where])
    write(tmp_path, name, "surface")
    assert main(["run", "e.toml", "--plugins"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "\x1b" not in said
    line = RAISES[where][: RAISES[where].index("raise Evil")].count("\n") + 1
    assert f"{name}.py, line {line}: Evil: a\\x1b[31mb c" in said
    assert not (tmp_path / "runs" / "e-0").exists()


@pytest.mark.parametrize(
    ("raised", "told"),
    [("SystemExit(0)", "SystemExit: 0"), ("Mute", "Mute"), ("GeneratorExit", "GeneratorExit")],
)
def test_a_part_that_ends_the_program_or_has_no_words_is_one_line(
    raised, told, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    name = f"ends_{raised[:4].lower()}"
    code = "class Mute(BaseException):\n    def __str__(self):\n        raise self\n\n\n"
    code += f"class Name:\n    def __init__(self):\n        raise {raised}\n\n"
    code += "    def update(self, regressor, force): ...\n    def estimate(self): ...\n"
    (tmp_path / f"{name}.py").write_text(code)
    assert main(["checks", f"{name}:Name"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"{name}.py, line 8: {told}; let your code" in said
