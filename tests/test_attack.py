"""A slice of `make attack`: some seconds of spoiled files, kills and long runs with every run of the tests."""

import os
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks" / "attack"))

import faults
import grammar
import killing
import reading
import run
from lasting import lasted
from mutate import mutated
from reading import Told, attack
from samples import SAMPLES

EACH = {"experiment": 100, "study": 100, "journal": 100, "CSV": 25, "MCAP": 10, "SQLite bag": 10}
"""Of the kinds of which some tens take little time."""


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.long if k in {"CSV", "SQLite bag"} else ()) for k in EACH]
)
def test_a_spoiled_file_is_read_or_refused_in_one_line(kind, tmp_path):
    told = attack(kind, range(EACH[kind]), tmp_path)
    assert not told.defects
    assert told.inputs == EACH[kind]
    assert told.counts["refused"]


def test_the_attack_sees_a_defect(tmp_path, monkeypatch):
    """One that dies and one that hangs are counted, and the next goes on behind them."""
    monkeypatch.setitem(SAMPLES, "none", (".csv", lambda path: path.write_text("")))
    told = attack("none", range(2), tmp_path, seconds=1.0)  # the child knows no such kind
    assert told.inputs == 2
    assert told.bad == 2
    assert all("died" in defect for defect in told.defects)


def test_the_attack_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    """What is found is kept slice by slice, and found again; what was found of other sources is not."""
    monkeypatch.setattr(run, "STATE", tmp_path / "attack.json")
    done = []
    parts = [
        run.Part("killed", "a 0", lambda _: done.append("a") or Counter(times=2)),
        run.Part("read", "b 0", lambda _: done.append("b") or Told(Counter(read=3), 0.5, ["b 1: hung"])),
    ]
    run.run(run.gone_on(), parts[:1])
    run.run(run.gone_on(), parts)
    assert done == ["a", "b"]
    found = run.gone_on()
    assert found.killed["a 0"]["times"] == 2
    assert found.read["b 0"].bad == 0
    assert found.read["b 0"].defects == ["b 1: hung"]
    monkeypatch.setattr(run, "sources", lambda: "others")
    assert not run.gone_on().read


def test_mutations_are_the_same_for_the_same_seed_and_differ():
    data = b"time_s,position_mm,force_N\n0,1,2\n" * 20
    assert mutated(data, 3) == mutated(data, 3)
    assert len({mutated(data, seed) for seed in range(50)} - {data}) > 40


FEW = {
    "flags": 12,
    "logs of instruments": 25,
    "models of arms": 10,
    "experiment, edited": 30,
    "arm of TOML": 25,
    "options": 10,
    "FOUND, tuned": 6,
    "certificate, checked": 25,
    "environments": 12,
    "plug-ins": 25,
    "tables of places": 25,
}
"""Inputs of kinds that take little time; the slow ones are `long`."""


@pytest.mark.long
@pytest.mark.parametrize("kind", FEW)
def test_an_input_of_a_grammar_is_read_or_refused_in_one_line(kind, tmp_path):
    told = attack(kind, range(FEW[kind]), tmp_path)
    assert not told.defects
    assert told.inputs == FEW[kind]


def test_a_grammar_makes_the_same_input_for_the_same_seed_and_others_for_others(tmp_path):
    trees = [
        grammar.edited({"a": 1, "b": [1, {"c": "x"}]}, random.Random(seed)) for seed in (1, 1, *range(40))
    ]
    assert repr(trees[0]) == repr(trees[1])
    assert len(set(map(repr, trees))) > 25
    commands = [grammar.flags(random.Random(seed), tmp_path) for seed in (1, 1, *range(40))]
    assert commands[0] == commands[1]
    assert len({one[0][0] for one in commands}) > 6


def test_coverage_keeps_inputs_that_reach_new_lines(tmp_path):
    inputs = reading.Spoiled("experiment by coverage", tmp_path)
    for seed in range(20):
        inputs.read(seed)
    assert len(inputs.reached) > 50
    assert 1 < len(inputs.corpus) < 21


def test_each_share_of_time_begins_with_other_inputs():
    first, second = (run.parts(run.Amount(400, 0, 4, 0.0, seed)) for seed in (1, 2))
    assert not {part.name for part in first} & {part.name for part in second}
    assert {part.kept for part in first} == {"read", "killed"}


@pytest.mark.long
@pytest.mark.parametrize("command", ["certify", "export"])
def test_a_fault_at_a_change_of_the_disk_leaves_whole_files(command, tmp_path):
    told = faults.faulted(command, 10, tmp_path)
    if "no C compiler" in told:
        pytest.skip("there is no C compiler")
    assert told["times"] == 10
    assert not [word for word in told if word.startswith("defect")], told


def test_a_file_that_is_written_in_place_is_a_defect(tmp_path):
    """What the faults are to find: a command that opens its file and writes it piece by piece."""
    library = faults.compiled(tmp_path)
    if library is None:
        pytest.skip("there is no C compiler")
    count, place = tmp_path / "count", tmp_path / "place"
    place.mkdir()
    found = {}
    for how in ("", *faults.HOWS):
        count.unlink(missing_ok=True)
        code = "f = open('place/x', 'wb', buffering=0); f.write(b'12345678'); f.write(b'abcdefgh')"
        own = {
            "ATTACK_FOLDER": f"{place}/",
            "ATTACK_FAIL": "3" if how else "0",
            "ATTACK_HOW": how,
            "ATTACK_COUNT": str(count),
        }
        ran = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env={**os.environ, **own, "LD_PRELOAD": str(library)},
            capture_output=True,
            check=False,
        )
        found[how] = (ran.returncode, (place / "x").read_bytes(), len(count.read_bytes()))
    assert found.pop("") == (0, b"12345678abcdefgh", 3)
    assert found.pop("kill") == (-9, b"12345678", 3)
    assert found.pop("short") == (0, b"12345678abcd", 3)
    assert {(code, data) for code, data, _ in found.values()} == {(1, b"12345678")}


@pytest.mark.long
def test_a_run_that_is_killed_leaves_whole_results(tmp_path):
    told = killing.run_killed(1, tmp_path)
    assert not [word for word in told if word.startswith("defect")], told


@pytest.mark.long
def test_a_full_disk_leaves_whole_files(tmp_path):
    told = killing.disks_full(2, tmp_path)
    assert not [word for word in told if word.startswith("defect")], told


@pytest.mark.parametrize("name", [pytest.param("foam-hybrid", marks=pytest.mark.long), "foam-neural"])
def test_a_minute_of_an_experiment_keeps_its_promises(name):
    one = lasted(name, 60.0)
    assert one.finite
    assert 0.0 < one.over <= 1.0
