"""The door for files from outside: what is no regular file, no text or no sane TOML is one line."""

from __future__ import annotations

import os
import time
from pathlib import Path

import msgspec
import pytest

from palpate.cli import main
from palpate.errors import LONGEST, InputError, PalpateError, unknown
from palpate.files import open_file, read_table, read_text, read_toml
from palpate.force import Gains, load_arm
from palpate.force.gains import gains_for

DEEP = "x = " + "[" * 2000 + "]" * 2000
DIGITS = "x = " + "1" * 5000
LARGE = f"x = {2**63}"
DOTS = "a." * 100_000 + "a = 1"
FORMS = {"deep": (DEEP, "within each other"), "digits": (DIGITS, "digits"), "large": (LARGE, "those of 64"),
         "dots": (DOTS, "within each other"), "no TOML": ("x = [", "not TOML")}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_toml_that_no_person_writes_is_refused_at_once(form):
    text, words = FORMS[form]
    begun = time.process_time()
    with pytest.raises(InputError, match=words):
        read_toml(text, "mine.toml")
    assert time.process_time() - begun < 1.0


def readers(path: Path) -> dict[str, list[str]]:
    """A command for each reader of TOML; `path` is the file."""
    log = ["press.csv", "--time", "t", "--position", "x", "--force", "f"]
    surface = ["--stiffness", "1000:9000"]
    return {
        "options": ["identify", *log, "--options", str(path)],
        "payload": [
            "identify",
            "press.csv",
            "--wrench",
            "f,a,b",
            "--pose",
            "x,c,t",
            "--rate",
            "100",
            "--payload",
            str(path),
        ],
        "arm of tune": ["tune", "--arm", str(path), "--force", "20", *surface],
        "gains": ["certify", str(path)],
        "arm of press": ["press", "--arm", str(path), "--force", "20", "--surface", "K=5000,B=50"],
        "experiment": ["run", str(path)],
        "study": ["study", str(path)],
    }


@pytest.mark.parametrize("reader", readers(Path("x.toml")))
@pytest.mark.parametrize("form", ["deep", "digits", "pipe"])
def test_every_reader_of_toml_goes_through_the_door(tmp_path, monkeypatch, capsys, reader, form):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.toml"
    (tmp_path / "press.csv").write_text(
        "t,x,f,a,b,c\n" + "".join(f"{k / 100},{k},{k * k},{k % 3},{k % 5},{k % 7}\n" for k in range(50))
    )
    if form == "pipe":
        os.mkfifo(path)
    else:
        path.write_text(FORMS[form][0])
    assert main(readers(path)[reader]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert str(path) in printed


@pytest.mark.parametrize(("make", "words"), [(os.mkfifo, "pipe or a device"), (os.mkdir, "is a folder")])
def test_a_pipe_and_a_folder_are_no_file(tmp_path, make, words):
    path = tmp_path / "arm.toml"
    make(path)
    with pytest.raises(InputError, match=words):
        open_file(path)
    with pytest.raises(InputError, match=words):
        load_arm(str(path))


def test_a_device_and_no_text(tmp_path):
    with pytest.raises(InputError, match="pipe or a device"):
        read_text(Path("/dev/zero"), "an arm")
    path = tmp_path / "a.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        read_text(path, "an arm")
    path.write_bytes(b" " * 1_000_001)
    with pytest.raises(InputError, match="more than 1000000 bytes are not an arm"):
        read_text(path, "an arm")
    with pytest.raises(InputError, match="zero byte"):
        read_text(Path("a\0b"), "an arm")


def test_an_error_quotes_little_of_a_stranger_s_file():
    text = str(unknown("column", "x" * 70_000, ["y" * 70_000]))
    assert len(text) <= LONGEST
    assert text.startswith("unknown column 'xxx")
    assert str(PalpateError("short")) == "short"


def test_the_output_of_identify_may_be_no_pipe(tmp_path, capsys):
    path = tmp_path / "found.json"
    os.mkfifo(path)
    assert main(["tune", str(path), "--arm", "ur5e", "--force", "20"]) == 2
    assert "pipe or a device" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (
            "force =",
            "forc = 1\nforce =",
            "unknown field `forc`; there are: alpha, approach, arm, cap, force",
        ),
        (
            "[arm.sensor]",
            "[arm.sensor]\nnois = 1",
            "at `$.arm.sensor`; there are: accuracy, drift, full_scale",
        ),
        (
            "[arm.limits]",
            "[slide]\nmu = 1\n[arm.limits]",
            "at `$.slide`; there are: acceleration, mu_max, radius",
        ),
        ("force = 15.0", "force = 'a'", "Expected `float`, got `str` - at `$.force`"),
    ],
)
def test_an_unknown_field_names_those_that_there_are(before, after, says):
    text = gains_for(load_arm("ur5e"), 15.0).to_toml()
    assert before in text
    with pytest.raises(InputError) as error:
        read_table(text.replace(before, after, 1), "gains.toml", Gains)
    assert says in str(error.value)
    assert ("there are" in says) == ("there are" in str(error.value))


class Sphere(msgspec.Struct, tag="sphere", forbid_unknown_fields=True):
    radius: float


class Plane(msgspec.Struct, tag="plane", forbid_unknown_fields=True):
    slope: float


class World(msgspec.Struct, forbid_unknown_fields=True):
    by_name: dict[str, Sphere]
    either: Sphere | Plane


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[by_name.ball]\ntype = 'sphere'\nradius = 1\nmass = 2", "; there are: radius"),
        ("[by_name]\n[either]\ntype = 'plane'\nradius = 1", "; there are: radius (sphere); slope (plane)"),
    ],
)
def test_the_fields_of_a_table_under_any_key_are_told_and_no_others(text, says):
    with pytest.raises(InputError) as error:
        read_table(text, "world.toml", World)
    assert "unknown field" in str(error.value)
    assert str(error.value).partition("; there are")[1:] == tuple(says.partition("; there are")[1:])
