"""Slides as they are shown: the page, the summary, the sentence."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.cli import main
from palpate.force import Gains, load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.press.unload import HELD
from palpate.slide.ground import Ground, ground_of
from palpate.slide.report import sentence, summarise, write_report
from palpate.slide.world import COLUMNS, SlideRun, simulate


def tuned(arm: str = "ur5e", **others: float) -> Gains:
    return replace(gains_for(load_arm(arm), 15.0, cap=4e4), slide=Slide(speed=0.03, mu_max=0.9, **others))


@pytest.fixture(scope="module")
def slid() -> tuple[np.ndarray, Gains, Ground]:
    gains, ground = tuned(), ground_of("bowl", 0.12, 2e4, friction=0.4)
    return simulate(gains, ground, directions("circle", 2.0, gains.arm.rate, 0.03, 0.04)), gains, ground


def test_a_cone_that_holds_any_normal_is_no_number(slid) -> None:
    rows, gains, ground = slid
    wide = rows.copy()
    wide[:, COLUMNS.index("cone")] = 2.0
    assert summarise(wide, gains, ground)["normal"]["cone95_deg"] is None
    assert "normal unknown; friction" in sentence(summarise(wide, gains, ground))
    assert re.search(
        "normal \\S? ?[0-9.]+\N{DEGREE SIGN}; friction", sentence(summarise(rows, gains, ground))
    )


def test_page_of_a_surface_that_was_never_touched(slid, tmp_path) -> None:
    rows, gains, ground = slid
    before = rows[:50]
    assert not before[:, COLUMNS.index("normal_force")].any()
    summary = summarise(before, gains, ground)
    assert summary["end"] == "no contact"
    assert "never touched" in sentence(summary)
    run = SlideRun(before, before[:0], HELD, False)
    write_report(run, gains, summary | {"command": "palpate slide", "seed": 0}, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert '<p class="lead">The surface was never touched' in page
    assert "speed [mm/s]" in page
    assert "friction [1]" not in page  # nothing was estimated


def test_the_first_line_of_the_page_is_the_answer(slid, tmp_path) -> None:
    rows, gains, ground = slid
    summary = summarise(rows, gains, ground) | {"command": "palpate slide", "seed": 0}
    write_report(SlideRun(rows, rows[:0], HELD, False), gains, summary, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert '<p class="lead">15 N held within' in page
    assert page.count('data-panels="') == 2
    low = {"value": -0.001, "ci95": [-0.02, 0.018]}
    assert "friction 0.00 \N{PLUS-MINUS SIGN} 0.02" in sentence(summary | {"friction": low})


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (
            ["--gains", "gains.toml", "--mu-max", "0.5"],
            "--mu-max is set by gains.toml",
        ),
        (["--gains", "gains.toml", "--arm", "fr3"], "--arm is set by gains.toml"),
        (["--gains", "gains.toml", "--path", "line", "--length", "20:mm"], "ends after 0.67 s"),
        (["--gains", "gains.toml", "--surface", "K=2e4,K=5"], "each once"),
        (["--gains", "gains.toml", "--surface", "K=2e4,B=20"], "--surface needs the numbers K and mu"),
        (["--gains", "gains.toml", "--shape", "plane:5:mm"], "--shape plane has no radius; leave out :5:mm"),
        (["--gains", "gains.toml", "--surface", "K=2e4,mu=-1"], "nothing below 0; got friction of -1"),
    ],
)
def test_words_that_contradict_each_other_are_one_line(words, says, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gains.toml").write_text(tuned().to_toml())
    assert main(["slide", *words]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert not (tmp_path / "runs").exists()


def test_a_line_ends_at_its_length(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gains.toml").write_text(tuned().to_toml())
    words = ["--path", "line", "--length", "36:mm", "--shape", "plane", "--surface", "K=2e4,mu=0.3"]
    assert main(["slide", "--gains", "gains.toml", *words, "--out", "out"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert 0.03 < summary["path_m"] < 0.0361  # it starts slowly
