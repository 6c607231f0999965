"""A slide with a dithered force as a line of a map."""

from __future__ import annotations

import json

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.cli import main
from palpate.force import load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.maps.presses import read_table
from palpate.slide.dither import dither_frequency, stiffness_along
from palpate.slide.ground import ground_of
from palpate.slide.world import figures_of, simulate


@pytest.mark.long
@pytest.mark.parametrize(("arm", "shape", "friction"), [("ur5e", "bowl", 0.6), ("fr3", "saddle", 0.2)])
def test_a_dithered_slide_measures_the_stiffness_along_its_path(
    arm: str, shape: str, friction: float
) -> None:
    gains = replace(
        gains_for(load_arm(arm), 15.0, cap=4e4), slide=Slide(speed=0.012, mu_max=0.9, touches=0.01)
    )
    ground = ground_of(shape, 0.2, 8e3, friction=friction, grade=4.0)
    frequency = dither_frequency(gains)
    ways = directions("line", 10.0, gains.arm.rate, 0.012, 0.12)
    rows = simulate(gains, ground, ways, into=[0.1, 0.0, -1.0], dither=(0.1, frequency))
    found = stiffness_along(rows, gains.arm, frequency)
    truth = 8e3 * (1.0 + 4.0 * found.places[:, 0])
    assert len(truth) >= 4
    assert (np.abs(found.stiffness - truth) < 1.5 * found.half).all()
    assert found.stiffness == pytest.approx(truth, rel=0.04)
    assert np.median(found.half / found.stiffness) < 0.06
    assert figures_of(rows, gains, ground).obeys


@pytest.mark.long
def test_the_places_of_a_dithered_slide_are_read_by_a_map(tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ["slide", "--dither", "0.1", "--speed", "15:mm/s", "--seconds", "8", "--out", str(out), "--json"]
    assert main(words) == 0
    (said,) = json.loads(capsys.readouterr().out)["troubles"]
    assert said.startswith("the dither")  # and no step, no friction above mu_max
    presses = read_table(out / "places.csv")
    assert len(presses.stiffness) >= 2
    assert (np.abs(presses.stiffness - 2e4) < 1.5 * presses.half).all()


@pytest.mark.parametrize("wrong", ["-0.1", "0.5", "nan"])
def test_a_dither_that_is_no_share_is_one_line(wrong: str, tmp_path, capsys) -> None:
    assert main(["slide", "--dither", wrong, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "--dither" in said
    assert said.count("\n") == 1
