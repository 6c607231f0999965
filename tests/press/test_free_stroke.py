"""The free stroke: what it learns of the force in free motion, what it refuses, and what it meets."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate.logs import read_record
from palpate.press.free_stroke import FreeForce, fit_free_force
from palpate.press.pressing import press
from palpate.press.sequence import Plan
from palpate.press.simulated_arm import PoseForce
from palpate.press.summary import summarise
from press.test_press import prepare_press, question, simulated
from wires.simulated import simulated_arm
from wires.slow_cell import WORDS, cell

STROKE = {"length": 0.02, "slope": (0.0, 1.0), "bend": (0.0, 10.0), "rest": 0.03}
LEVEL = 0.2


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A cell of 100 Hz."""
    made = tmp_path_factory.mktemp("stroke")
    cell(made)
    return made


def rows(seed, slope=0.0, bend=0.0, mass=0.0, drift=0.0):
    """A smooth stroke of 20 mm in a second each way, with noise of 0.1 N."""
    t = np.arange(1000) / 500.0
    phase = 2.0 * math.pi * t
    u = -0.02 * np.where(t < 1.0, t - np.sin(phase) / (2 * math.pi), 2.0 - t + np.sin(phase) / (2 * math.pi))
    a = -0.02 * np.where(t < 1.0, 1.0, -1.0) * 2 * math.pi * np.sin(phase)
    noise = 0.1 * np.random.default_rng(seed).standard_normal(1000)
    return np.column_stack([t, u, 3.0 + slope * u + bend * u * u + mass * a + drift * t + noise])


@pytest.mark.parametrize("world", [{}, {"slope": 30.0, "mass": 1.5, "drift": 0.3}, {"slope": -8.0}])
def test_the_slope_has_an_honest_interval(world):
    """Whatever the tool's mass: its inertia is not in the slope."""
    slopes = [fit_free_force(rows(seed, **world), 0.02).slope for seed in range(400)]
    value, std = np.array(slopes).T
    assert np.mean(np.abs(value - world.get("slope", 0.0)) < 2.0 * std) == pytest.approx(0.95, abs=0.03)


def test_only_what_is_sure_and_matters_is_subtracted():
    assert FreeForce(**STROKE).slope_to_subtract(0.02, LEVEL) == 0.0
    assert (
        FreeForce(**STROKE | {"slope": (9.0, 1.0)}).slope_to_subtract(0.02, LEVEL) == 0.0
    )  # 0.18 N on the way
    assert FreeForce(**STROKE | {"slope": (30.0, 11.0)}).slope_to_subtract(0.02, LEVEL) == 0.0
    assert FreeForce(**STROKE | {"slope": (30.0, 1.0)}).slope_to_subtract(0.02, LEVEL) == 30.0


@pytest.mark.parametrize(
    ("changes", "travel", "reason"),
    [
        ({"bend": (1000.0, 10.0)}, 0.02, r"by 0\.38 N more within the 20 mm .* start within 14 mm"),
        ({"rest": 0.3}, 0.02, "see what pulls at the tool"),
        ({"slope": (30.0, 1.0)}, 0.05, r"over 20 mm, which is not enough for the 50 mm of this press"),
        ({"slope": (60.0, 5.0)}, 0.02, "make --free-stroke longer"),
    ],
)
def test_a_force_that_cannot_be_subtracted_is_refused(changes, travel, reason):
    with pytest.raises(InputError, match=reason):
        FreeForce(**STROKE | changes).slope_to_subtract(travel, LEVEL)


def test_a_cable_is_taken_off_a_simulated_press(tmp_path):
    """Of a soft surface, to whose stiffness the cable would add a fifth."""
    words = (
        "--force",
        "5:N",
        "--surface",
        "K=500,B=5",
        "--seconds",
        "2",
        "--json",
        "--out",
        str(tmp_path / "p"),
    )
    assert main(["press", "--arm", "ur5e", *words, "--free-force", "cable=100:N/m"]) == 0
    summary = json.loads((tmp_path / "p" / "summary.json").read_text())
    assert "which was subtracted" in (tmp_path / "p" / "report.html").read_text()
    assert summary["free_stroke"]["subtracted_N_per_m"] == pytest.approx(100.0, abs=5.0)
    low, high = summary["identified"]["parameters"]["K"]["ci95"]
    assert low < 500.0 < high < 590.0


@pytest.mark.parametrize("free", [PoseForce(ripple=3.0), PoseForce(cable=20.0)])
def test_a_simulated_press_on_air_has_no_stiffness(free):
    request = prepare_press(question()).request
    arm, driver, place = simulated()
    arm.free, arm.cell = free, arm.cell._replace(place=arm.cell.place + 1.0)
    record = press(arm, driver, place, Plan(20.0, 1.0, longest=4.0), driver.loop.gains)
    assert record.meta["end"] in {"no contact", "force not reached"}
    record.meta.update(truth={}, tare_N=0.0, free_stroke=None)
    assert summarise(record, request)["identified"] is None


def pulled(cable=0.0, ripple=0.0, gap=0.002):
    """A fault of a wire: forces on the tool that depend on its place along the press, which is -z."""

    def fault(seconds, rng):
        def shown(values):
            depth = 0.3 + gap - values[8]
            free = cable * depth + ripple * math.sin(2.0 * math.pi * depth / 0.06)
            return (*values[:2], values[2] - free, *values[3:])

        return shown

    return fault


def over_wire(folder, capsys, fault, words, **world):
    """Exit code, printed JSON or refusal, and the arm, of a press over a wire."""
    given = dict(zip(WORDS[::2], WORDS[1::2], strict=True)) | words
    flat = [word for pair in given.items() for word in pair]
    with simulated_arm(folder, fault, **world) as network:
        gains = str(folder / "gains.toml")
        code = main(["press", "--wire", network.address, "--gains", gains, *flat, "--yes", "--json"])
        arm = network._server.arm
    out, err = capsys.readouterr()
    return code, json.loads(out) if out else err, arm


def test_a_cable_sends_no_tip_through_free_motion_too_fast(folder, capsys, tmp_path):
    """Without the stroke the cable passes for a soft surface, and the tip is faster than the approach before it."""
    fastest, fault = {}, pulled(cable=150.0, gap=0.015)
    for stroke in ("0:mm", "18:mm"):
        words = {"--free-stroke": stroke, "--travel-limit": "20:mm", "--record": str(tmp_path / stroke[:-3])}
        code, told, _ = over_wire(folder, capsys, fault, words, gap=0.015)
        record = read_record(tmp_path / stroke[:-3] / "record.parquet")
        fastest[stroke] = record["speed"][record["x_measured"] < 0.014].max()
    assert code == 0
    assert told["free_stroke"]["subtracted_N_per_m"] == pytest.approx(150.0, abs=10.0)
    assert fastest["18:mm"] == record["speed"][record["phase"] == 0.0].max() < 0.8 * fastest["0:mm"]


def test_a_ripple_is_refused_over_a_wire_and_the_arm_rests_at_its_start(folder, capsys):
    code, said, arm = over_wire(folder, capsys, pulled(ripple=3.0), {"--free-stroke": "20:mm"})
    assert code == 2
    assert "in free motion the force changes with the position" in said
    assert len(said.strip().splitlines()) == 1
    assert arm.body.x == pytest.approx(-0.002, abs=5e-4)


@pytest.mark.parametrize("fault", [pulled(ripple=3.0), pulled(cable=20.0)])
def test_a_press_on_air_over_a_wire_says_so(folder, capsys, fault):
    code, told, _ = over_wire(folder, capsys, fault, {}, gap=0.2)
    assert code == 1
    assert not told["touched"]
    assert told["stiffness_N_per_m"] is None
    assert "pressed" not in told["ended"]


def test_a_stroke_that_meets_a_surface_says_so_and_unloads(folder, capsys):
    """The normal points out of the surface, so that the stroke leads into it."""
    code, told, arm = over_wire(
        folder, capsys, pulled(), {"--free-stroke": "20:mm", "--normal": "0,0,1"}, stiffness=9000.0
    )
    assert code == 1
    assert told["ended"].startswith("in the free stroke ")
    assert "--normal" in told["ended"]
    assert not told["touched"]
    assert arm.body.force == 0.0
    assert told["unloaded"]["distance_m"] > 0.0


def test_a_stroke_is_within_the_travel_limit(folder, capsys):
    code, said, _ = over_wire(folder, capsys, pulled(), {"--free-stroke": "29:mm"})
    assert code == 2
    assert "--free-stroke must be from 0 to 0.9 of the travel limit of 30 mm" in said
