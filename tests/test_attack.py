"""A slice of `make attack`: some seconds of spoiled files, kills and long runs with every run of the tests."""

import sys
from collections import Counter
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks" / "attack"))

import killing
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
