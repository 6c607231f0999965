"""`--json` of every command: one object and nothing else, with the keys that docs/json.md says."""

import json
import shutil

import numpy as np
import pytest

from cli import json_keys
from cli.test_payload import write
from cli.test_run import text_of
from contact_frame.turning_tool import Tool, log_of, six
from export import scenes
from force.gained import gains_of
from palpate import __version__
from palpate.cli import main
from palpate.cli._program import COMMANDS, COMPANIONS
from studies.small import SMALL

HEAD = {"command", "version", "options", "files"}
PRESS = "press.csv --time time_s --position position_mm:mm --force force_N:N"
SEEDED = {"run", "press", "slide"}
"""Commands that draw random numbers."""
WITHOUT = {
    "live": "shows a page",
    "completion": "prints a script",
    "demo": "runs identify, which prints one",
    "thesis": "writes claims.json",
}
"""Commands that print no object, and what they do instead."""
CASES = {
    "identify": [f"identify {PRESS}"],
    "identify, several logs": [f"identify other.csv {PRESS}"],
    "payload": ["payload turning.parquet --wrench-frame tool"],
    "topics": ["topics press.csv"],
    "excite": [
        "excite --stiffness 3:8:N/mm --damping 100:300 --force 15 --peak 20 --precision K=20% --duration 4"
    ],
    "tune": ["tune --stiffness 1e3:1e5 --arm ur5e --force 20"],
    "certify": ["certify gains.toml --held-only --out certificate.json"],
    "certify, another controller": [
        "certify law.yaml --controller crisp --delay 2:ms --mass 3:kg --rate 1000"
    ],
    "export": ["export found.json --to drake --geom foam"],
    "press": ["press --arm fr3 --force 20 --surface K=5000,B=50 --seconds 1 --out pressed"],
    "slide": ["slide --arm ur5e --seconds 1 --out slid"],
    "run": ["run mine.toml --seed 3 --out ran"],
    "study": ["study small.toml --out studied"],
    "checks": ["checks my_parts:Push"],
    "references": ["references check"],
    "speed": ["speed"],
}
LONG = {
    "certify",
    "certify, another controller",
    "checks",
    "press",
    "references",
    "run",
    "slide",
    "speed",
    "study",
    "tune",
}


@pytest.fixture(scope="module")
def place(tmp_path_factory, root):
    """A folder with what the commands read."""
    folder = tmp_path_factory.mktemp("json")
    for name in ("press.csv", "other.csv"):
        shutil.copy(root / "examples" / "data" / "press.csv", folder / name)
    (folder / "my_parts.py").write_text((root / "tests" / "own_parts.py").read_text(encoding="utf-8"))
    (folder / "found.json").write_text(json.dumps(scenes.found()))
    (folder / "gains.toml").write_text(gains_of().to_toml())
    (folder / "law.yaml").write_text("task.k_pos_x: 300.0\n")
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    (folder / "mine.toml").write_text(text_of(), encoding="utf-8")
    write(log_of(Tool(), six(), np.random.default_rng(0)), folder / "turning.parquet")
    return folder


@pytest.fixture(scope="module")
def documented(root):
    return json_keys.documented(root)


def asked(capsys, words):
    code = main([*words.split(), "--json"])
    told = capsys.readouterr()
    assert code in (0, 1)
    return json.loads(told.out), told


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long) if name in LONG else name for name in CASES]
)
def test_it_is_json_alone_with_the_keys_that_are_documented(
    name, place, documented, capsys, monkeypatch, tmp_path
):
    monkeypatch.chdir(place)
    (words,) = CASES[name]
    found, told = asked(capsys, words)
    assert told.out.count("\n") == 1
    assert set(found) == documented[name] | HEAD
    assert found["version"] == __version__
    assert found["command"].startswith(f"palpate {words.split(' --')[0]}")
    for read in found["files"]:
        assert set(read) == {"file", "sha256"}
        assert (place / read["file"]).is_file()
    if name in SEEDED:
        assert found["seed"] == (3 if "--seed 3" in words else 0)


def test_every_command_is_documented_or_has_a_reason(documented):
    commands = {*COMMANDS, *COMPANIONS}
    assert {name.partition(",")[0] for name in documented} - {"Every command"} == commands - set(WITHOUT)
    assert documented["Every command"] == HEAD


def test_options_of_a_file_and_what_is_written_are_told_apart(place, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(place)
    (tmp_path / "cell.toml").write_text('wrench-frame = "tool"\n')
    tool = tmp_path / "tool.toml"
    found, _ = asked(capsys, f"payload turning.parquet --options {tmp_path}/cell.toml --out {tool}")
    assert tool.is_file()
    assert found["options"]["wrench_frame"] == "tool"
    assert [one["file"] for one in found["files"]] == ["turning.parquet", f"{tmp_path}/cell.toml"]
