"""The second judge of identification can tell: answers that are wrong, too wide, or died are counted as such."""

import ast
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from identification.problems import contradictions

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks" / "second_judge"
sys.path.insert(0, str(FOLDER))

import laboratory  # noqa: E402

import judge  # noqa: E402 -- beside the scripts

IDENTIFIED, FORCE = "identified", 1.0


def interval(value, half):
    return {"value": value, "ci95": [value - half, value + half], "unit": "N/m", "verdict": IDENTIFIED}


def answer(value, half, **others):
    """An answer as `--json` prints it: K, and the same at the working point."""
    point = {"stiffness": interval(value, half), "force_N": FORCE, "frequency_Hz": 1.0, "source": "press"}
    return {"parameters": {"K": interval(value, half)}, "working_point": point, "warnings": [], **others}


def counts(log, *answers, codes=(0, 0)):
    """Counts of some answers to a log, by way of the file that a run is resumed from."""
    rows = [json.dumps(judge.judge(log, given, codes)) for given in answers]
    return judge.tally([json.loads(row) for row in rows])


@pytest.fixture(scope="module")
def hand():
    """A log of a linear surface that an estimator that knows it resolves."""
    return laboratory.draw("hand_held", 0, 1)


def test_a_right_and_narrow_answer_holds_and_is_sharp(hand):
    k = hand.scene.p["K"]
    result = counts(hand, answer(k * 1.001, k * 0.002))
    assert (result["answers"], result["answers_hold"], result["answers_wrong"], result["sharp"]) == (
        1,
        1,
        0,
        1,
    )
    assert (result["points"], result["points_hold"], result["known"], result["exit"]) == (1, 1, 1, 0)


def test_a_confidently_wrong_answer_is_counted(hand):
    k = hand.scene.p["K"]
    result = counts(hand, answer(1.04 * k, 0.01 * k), answer(1.02 * k, 0.01 * k))
    assert (result["answers_hold"], result["answers_wrong"], result["points_wrong"]) == (0, 1, 1)


def test_an_interval_that_is_too_wide_is_not_sharp(hand):
    k = hand.scene.p["K"]
    result = counts(hand, answer(k, 0.1 * k))
    assert (result["answers_hold"], result["known"], result["sharp"]) == (1, 1, 0)


def test_any_stiffness_of_a_fluid_is_wrong():
    result = counts(laboratory.draw("fluid_film", 0, 1), answer(500.0, 100.0))
    assert (result["answers_wrong"], result["points_wrong"], result["known"]) == (1, 1, 0)


def test_an_answer_for_two_surfaces_has_to_hold_for_both():
    log = laboratory.draw("two_surfaces", 0, 1)
    k = log.scene.p["K"] * np.array([1.0, 1.0 + log.scene.p["tone"]])
    result = counts(log, answer(k[0], 0.05 * k[0]), answer(k[1], 0.05 * k[1]), answer(k.mean(), k.mean()))
    assert result["answers_hold"] == 1


def test_a_tangent_is_judged_at_the_force_that_it_is_given_for():
    log = laboratory.draw("sphere", 0, 1)
    peak = laboratory.contact_force(log.scene, log.scene.p)[1].max()
    stiffness = laboratory.tangent(peak / 2, log.scene.p, log.scene)
    exact = log.scene.p["K"] * (1.5 * peak / 2 / (log.scene.p["K"] * log.scene.scale)) ** (1 / 3)
    assert stiffness == pytest.approx(exact, rel=1e-4)
    for force, right in ((peak / 2, 1), (peak / 20, 0)):
        given = answer(stiffness, 0.02 * stiffness)
        given["working_point"]["force_N"] = force
        assert counts(log, given)["points_hold"] == right


def test_crashes_and_exit_codes_against_the_verdicts_are_counted(hand):
    nothing = {"parameters": {}, "working_point": None, "warnings": []}
    assert counts(hand, nothing, codes=(0, 0))["exit"] == 1
    assert counts(hand, nothing, codes=(1, 1))["exit"] == 0
    assert counts(hand, answer(1.0, 0.1), codes=(0, 1))["exit"] == 1
    assert counts(hand, answer(1.0, 0.1), codes=(0, 70))["crash"] == 1


def test_precision_of_the_estimator_that_knows_is_that_of_least_squares():
    t = np.arange(0.0, 10.0, 1e-3)
    p = {"K": 1000.0, "B": 0.0, "M": 0.0, "x0": 0.0, "zero": 0.0, "lag": 0.0}
    scene = laboratory.Scene(t, 1e-3 * np.sin(2 * np.pi * t), 100.0, p, 1e-3, bonded=True)
    force = laboratory.read_force(scene, p)
    expected = 1.96 * 0.02 / np.sqrt(np.sum(force**2))  # zero and lag are orthogonal to a sine
    assert laboratory.known_half(scene, 0.5, 0.02, 0.0, 0.0) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("world", "seed", "index"),
    [
        ("fracture", 31, 2),  # a break in a fast press was taken for a tap
        ("fracture", 32, 2),  # the press that was stiffer passed the window too fast, and was left out
        ("muscle_tone", 31, 1),  # a force that changes during one press
        ("slipping_clamp", 31, 2),
        ("two_surfaces", 33, 0),  # the softer surface's press ended below the force of the tangent
    ],
)
def test_no_answer_is_wrong_on_these_logs_again(world, seed, index):
    row = judge.run(world, seed, index, plain=0)
    assert row["answer"]["working_point"]
    assert [r["name"] for r in row["results"] if r["away"] > judge.WRONG] == []


@pytest.mark.long
@pytest.mark.parametrize("name", judge.NAMES)
def test_headline_parameter_and_tangents_agree_at_one_force(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for index in range(3):
        log = laboratory.draw(name, index, 34)
        Path("press.csv").write_text(log.text, encoding="ascii")
        code, out = judge.typed([*judge.command("press.csv", log.options), "--json"])
        assert code < 2
        assert contradictions(json.loads(out)) == []


@pytest.mark.parametrize("name", judge.NAMES)
def test_a_log_is_that_of_its_seed(name):
    log, again, other = (laboratory.draw(name, 3, seed) for seed in (5, 5, 6))
    assert log.text == again.text != other.text
    assert "nan" not in log.text
    assert log.known > 0.0


def test_the_laboratories_import_nothing_of_palpate():
    tree = ast.parse((FOLDER / "laboratory.py").read_text(encoding="utf-8"))
    modules = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
    modules += [alias.name for n in ast.walk(tree) if isinstance(n, ast.Import) for alias in n.names]
    assert modules
    assert not [name for name in modules if name.split(".")[0] == "palpate"]
