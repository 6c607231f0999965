"""Slides as they are shown: the page and the live page."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.cli import main
from palpate.errors import InputError
from palpate.force import Gains, load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.live.sliding import SlidingArm
from palpate.live.view import AT
from palpate.press.unload import HELD
from palpate.slide.ground import Ground, ground_of
from palpate.slide.jointed_arm import jointed_arm
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
            "--mu-max is of the gains, and gains.toml has its own",
        ),
        (["--gains", "gains.toml", "--arm", "fr3"], "--arm is of the gains"),
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


def test_a_watched_slide_shows_what_it_does_and_takes_sliders() -> None:
    pytest.importorskip("mujoco", reason="the extra `arms` is not installed")
    arm, gains = jointed_arm("fr3"), tuned("fr3")
    gains = replace(gains, arm=arm.inner)
    watched = SlidingArm(arm, gains, ground_of("bowl", 0.15, 2e4, friction=0.3), 0.03, (0.0, 0.0, -1.0))
    rows = watched.advance(0.2)
    assert len(rows) == 40
    assert "touches" not in watched.view.about
    touching = replace(gains, slide=Slide(speed=0.03, mu_max=0.9, touches=0.01))
    watching = SlidingArm(arm, touching, ground_of("plane", 0.2, 2e4), 0.03, (0.0, 0.0, -1.0))
    assert "three touches for the normal, then the law" in watching.view.about
    watching.advance(0.2)
    assert (watching.state.stage, watched.state.stage) == ("touching, 1 of 3", "")
    assert np.diff(rows[:, AT["t"]]) == pytest.approx(0.005)
    assert np.isfinite(rows[:, AT["q1"] : AT["q7"] + 1]).all()
    watched.set("friction", 0.5)
    watched.set("force", 10.0)
    row = watched.advance(0.01)[-1]
    assert (row[AT["B_true"]], row[AT["K_true"]]) == (0.5, 2e4)
    for wrong in (("friction", 2.0), ("gain", 1.0)):
        with pytest.raises(InputError):
            watched.set(*wrong)
    watched.reset(3)
    assert watched.advance(0.01)[0, AT["t"]] < 0.01


@pytest.mark.long
def test_a_watched_slide_holds_the_force_around_its_circle() -> None:
    pytest.importorskip("mujoco", reason="the extra `arms` is not installed")
    arm, gains = jointed_arm("fr3"), tuned("fr3")
    watched = SlidingArm(
        arm, replace(gains, arm=arm.inner), ground_of("bowl", 0.15, 2e4, friction=0.3), 0.03, (0.0, 0.0, -1.0)
    )
    rows = watched.advance(5.0)
    last = rows[-200:]
    assert last[:, AT["force"]] == pytest.approx(15.0, rel=0.03)
    assert (np.abs(last[:, AT["B"]] - 0.3) < last[:, AT["B_half"]]).mean() > 0.9
    assert any(one.text == "slides" for one in watched.state.events)
