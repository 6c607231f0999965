"""Experiments: those that are shipped, and every way that a file can be wrong, told in its own words."""

import msgspec
import pytest

from palpate.bench import Experiment, build, load, names, source, with_values
from palpate.bench.tables import parse
from palpate.errors import InputError

GOOD = """
title = "A press"

[run]
press = 8.0

[surface]
kind = "kelvin-voigt"
stiffness = 5200.0
damping = 200.0
mass = 0.10

[wall]
x = 0.465

[friction]
coulomb = [3.0, 0.25, 0.03]

[controller]
kind = "hybrid"
"""


@pytest.mark.parametrize("name", names())
def test_every_shipped_experiment_says_what_it_is_and_builds(name):
    experiment = load(name)
    assert experiment.title
    assert experiment.about
    assert build(experiment).meta["truth"]
    # The file says nothing that is lost on the way.
    again = msgspec.convert(msgspec.to_builtins(experiment), Experiment)
    assert again == experiment


def test_a_copy_in_a_file_is_the_experiment(tmp_path):
    copy = tmp_path / "mine.toml"
    copy.write_text(source("foam-hybrid"), encoding="utf-8")
    assert load(str(copy)) == load("foam-hybrid")


# What is replaced, by what, and what the error says.
WRONG_VALUES = {
    "negative": ("stiffness = 5200.0", "stiffness = -1.0", r"stiffness in \[surface\] must be a number above 0"),
    "zero": ("stiffness = 5200.0", "stiffness = 0", r"above 0, got 0"),
    "infinite": ("stiffness = 5200.0", "stiffness = inf", r"stiffness in \[surface\] must be finite, got inf"),
    "not a number": ("stiffness = 5200.0", "stiffness = nan", r"stiffness in \[surface\] must be finite, got nan"),
    "infinite in a list": ("[3.0, 0.25, 0.03]", "[3.0, inf, 0.03]", r"coulomb\[1\] in \[friction\] must be finite"),
    "a text for a number": ("stiffness = 5200.0", "stiffness = 'hard'", r"must be a number, got 'hard'"),
    "true for a number": ("press = 8.0", "press = true", r"press in \[run\] must be a number, got True"),
    "a number for a text": ('"A press"', "3", "title must be a text, got 3"),
    "half a tick": ("press = 8.0", "rate = 1000.5", r"rate in \[run\] must be a whole number, got 1000.5"),
    "too few ticks": ("press = 8.0", "rate = 60", r"rate in \[run\] must be a whole number at least 100, got 60"),
    "too many steps": ("press = 8.0", "steps = 2000", r"steps in \[run\] must be a whole number at most 1000"),
    "too short a list": ("[3.0, 0.25, 0.03]", "[3.0, 0.25]", r"coulomb in \[friction\] must be a list of 3, got \[3"),
    "one joint wrong": ("[3.0, 0.25, 0.03]", "[3.0, -0.25, 0.03]", r"coulomb\[1\] in \[friction\] must be a number"),
    "forgetting": ("[wall]", "[identification]\nforgetting = 1.2\n[wall]", r"must be a number at most 1, got 1.2"),
    "elbow": ("[wall]", "[robot]\nelbow = 2\n[wall]", r"unknown elbow '2' in \[robot\]; there are: -1, 1"),
    "key": ("stiffness = 5200.0", "stiffnes = 1.0", r"unknown key 'stiffnes' in \[surface\]; did you mean 'stiffness'"),
    "table": ("[run]", "[runn]", r"unknown key 'runn'; did you mean 'run'"),
    "kind of surface": ('"kelvin-voigt"', '"kelvin"', r"kind 'kelvin' in \[surface\]; did you mean 'kelvin-voigt'"),
    "kind of controller": ('"hybrid"', '"hybird"', r"unknown kind 'hybird' in \[controller\]; did you mean 'hybrid'"),
    "kind left out": ('kind = "kelvin-voigt"', "", r"'kind' is missing in \[surface\]; it is one of: hunt-crossley"),
    "key left out": ("stiffness = 5200.0", "", r"the key 'stiffness' is missing in \[surface\]$"),
    "title left out": ('title = "A press"', "", r"the key 'title' is missing$"),
    "another kind's key": ("mass = 0.10", "mass = 0.1\nexponent = 1.5", r"unknown key 'exponent' in \[surface\]"),
    "twice": ("[wall]", "[run]", "not TOML: .*line"),
    "no TOML": ("[run]", "[run", "not TOML: .*line"),
    "empty": (GOOD, "", "the key 'title' is missing|the key 'surface' is missing"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "told"), WRONG_VALUES.values(), ids=WRONG_VALUES)
def test_a_wrong_file_is_told_in_its_own_words(old, new, told):
    assert old in GOOD
    with pytest.raises(InputError, match=told) as caught:
        parse(GOOD.replace(old, new, 1), "mine.toml")
    message = str(caught.value)
    assert message.startswith("mine.toml: ")
    assert "\n" not in message
    assert "`" not in message, "msgspec's own words"


def test_a_table_that_is_a_number():
    with pytest.raises(InputError, match="run must be a table, got 3"):
        parse("run = 3\n" + GOOD.replace("[run]\npress = 8.0", ""), "mine.toml")


# Each value is well by itself.
TOGETHER = {
    "out of reach": ({"robot.start": (0.6, 0.0, 0.0)}, r"out of reach by 68\.2 mm"),
    "too near to reach": ({"robot.start": (0.16, 0.0, 0.0)}, r"out of reach by \d+\.\d mm"),
    "wall behind the start": ({"wall.x": 0.44}, r"the wall at x = 0.44 m in \[wall\] lies behind the arm's start"),
    "less stiction than friction": ({"friction.static": (0.6, 0.3, 0.036)}, r"static in \[friction\] must be at least"),
    "velocity filter": ({"filters.motion": 600.0}, r"motion in \[filters\] must be below 500 Hz, half the rate"),
    "force filter": ({"filters.force": 500.0}, r"force in \[filters\] must be below 500 Hz.*got 500"),
    "slow loop": ({"run.rate": 200}, r"force in \[filters\] must be below 100 Hz"),
    "estimator's filter": ({"identification.cutoff": 501.0}, r"cutoff in \[identification\] must be below 500 Hz"),
    "sensor's filter": ({"force_sensor.cutoff": 600.0}, r"cutoff in \[force_sensor\] must be below 500 Hz"),
    "sensor faster than physics": ({"force_sensor.sampling": 40000}, r"\[force_sensor\] must be at most 20000 Hz"),
    "phase beyond a period": ({"force_sensor.phase": 0.0021}, r"phase in \[force_sensor\] must be below 0\.00208333 s"),
    "sensor too slow": ({"force_sensor.sampling": 100}, r"15\.\d ms late .* more than the 9 ticks"),
    "release above switch": ({"approach.release": 5.0}, r"release in \[approach\] must be below switch \(5 N\)"),
    "sensor that cannot feel the switch": ({"force_sensor.full_scale": 4.0}, r"\[force_sensor\] must be above switch"),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "told"), TOGETHER.values(), ids=TOGETHER)
def test_numbers_that_do_not_go_together_are_refused(changes, told):
    experiment = with_values(parse(GOOD, "mine.toml"), changes)
    with pytest.raises(InputError, match=told) as caught:
        build(experiment)
    assert "\n" not in str(caught.value)


def test_changed_says_which_change_was_wrong():
    with pytest.raises(InputError, match=r"^run.press: press in \[run\] must be a number above 0, got -1"):
        with_values(load("foam-hybrid"), {"run.press": -1.0})
    with pytest.raises(InputError, match="unknown key 'runn'"):
        with_values(load("foam-hybrid"), {"runn.press": 1.0})
    with pytest.raises(InputError, match="unknown key 'pres'"):
        with_values(load("foam-hybrid"), {"run.pres": 1.0})


def test_names_that_are_none():
    with pytest.raises(InputError, match="unknown experiment 'foam-hybird'; did you mean 'foam-hybrid'"):
        load("foam-hybird")


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load(str(tmp_path / "mine.toml"))
    with pytest.raises(InputError, match="is a folder"):
        load(str(tmp_path))
    binary = tmp_path / "mine.toml"
    binary.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(InputError, match="not a text file"):
        load(str(binary))
