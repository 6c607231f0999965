"""A simulated slide is led out of the surface, whatever ended it; its figures and its log are those of the slide."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from msgspec.structs import replace

from palpate.bench.summary import RETREAT
from palpate.cli import main
from palpate.errors import InputError
from palpate.force import Gains, load_arm
from palpate.force.arm import Arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.logs import read_record, write_record
from palpate.logs.signals import SLIDE_END, Signals
from palpate.records import Record
from palpate.slide import world
from palpate.slide.ground import ground_of
from palpate.slide.jointed_arm import HeldTip, jointed_arm
from palpate.slide.world import COLUMNS, PointSlide, SlideRun, run_slide, simulate

FORCE = COLUMNS.index("normal_force")


def tuned(arm: Arm) -> Gains:
    return replace(gains_for(arm, 15.0, cap=4e4), slide=Slide(speed=0.03, mu_max=0.9))


def check_unloaded(run: SlideRun) -> None:
    """From a force on the surface to free motion, in rows of the retreat's phase."""
    assert run.rows[-1, FORCE] > 5.0
    assert run.retreat[-1, FORCE] == 0.0
    assert run.unloading.free
    assert run.unloading.completed
    assert (run.phases == RETREAT).sum() == len(run.retreat) > 0


@pytest.mark.parametrize("arm", ["ur5e", "fr3"])
@pytest.mark.parametrize("shape", ["bowl", "sphere"])
def test_a_slide_that_is_done_is_unloaded(arm: str, shape: str) -> None:
    gains, ground = tuned(load_arm(arm)), ground_of(shape, 0.12, 2e3, friction=0.4)
    ways = directions("circle", 1.0, gains.arm.rate, 0.03, 0.04)
    run = run_slide(PointSlide(gains, ground, ways, seed=3))
    check_unloaded(run)
    assert not run.interrupted
    assert np.array_equal(run.rows, simulate(gains, ground, ways, seed=3), equal_nan=True)


def test_an_interrupted_slide_is_unloaded() -> None:
    gains, ground = tuned(load_arm("ur5e")), ground_of("plane", 0.2, 2e3, friction=0.4)

    def interrupt(_: float, phase: str) -> None:
        if phase == "contact":
            raise KeyboardInterrupt

    ways = directions("line", 5.0, gains.arm.rate, 0.03, 0.2)
    run = run_slide(PointSlide(gains, ground, ways), interrupt)
    assert run.interrupted
    check_unloaded(run)


def test_a_slide_that_touched_nothing_goes_back_to_its_start(monkeypatch) -> None:
    monkeypatch.setattr(world, "TICKS_AT_A_TIME", 50)
    gains, ground = tuned(load_arm("ur5e")), ground_of("plane", 0.2, 2e3)

    def interrupt(time: float, _: str) -> None:
        raise KeyboardInterrupt

    slide = PointSlide(gains, ground, directions("line", 1.0, gains.arm.rate, 0.03, 0.1))
    run = run_slide(slide, interrupt)
    assert not run.rows[:, FORCE].any()
    assert not run.unloading.free
    assert slide.read().position @ slide.into <= slide.start @ slide.into + 1e-4


@pytest.mark.long
@pytest.mark.parametrize("tool", [None, HeldTip(0.02)])
def test_a_slide_of_an_arm_with_joints_is_unloaded(tool: HeldTip | None) -> None:
    arm = jointed_arm("fr3")
    gains, ground = tuned(arm.inner), ground_of("bowl", 0.12, 1e4, friction=0.4)
    ways = directions("circle", 0.5, gains.arm.rate, 0.03, 0.04)
    check_unloaded(run_slide(arm.prepare(gains, ground, ways, physics="own", tool=tool)))


def test_the_record_has_the_retreat_and_identification_leaves_it_out(tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ["--seconds", "1", "--touches", "0:mm", "--tilt", "3", "--surface", "K=20000,mu=0.3"]
    assert main(["slide", *words, "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["unloaded"].endswith("to free motion")
    path = out / "record.parquet"
    record = read_record(path)
    retreat = record["phase"] == RETREAT
    assert retreat[-1]
    assert record["normal_force"][-1] == 0.0
    assert record.meta["unloaded"] == answer["unloaded"]
    signals, _ = Signals().complete(path)
    assert len(signals.read(path)) == np.count_nonzero(~retreat)
    whole = Signals(end=1e3).complete(path)[0]
    assert len(whole.read(path)) == len(record)


def test_an_interrupted_command_keeps_the_slide_and_its_retreat(tmp_path, monkeypatch, capsys) -> None:
    @contextmanager
    def interrupting(*_: object) -> Iterator[Callable[[float, str], None]]:
        def show(_: float, phase: str) -> None:
            if phase == "contact":
                raise KeyboardInterrupt

        yield show

    monkeypatch.setattr("palpate.cli.slide.simulation_progress", interrupting)
    monkeypatch.setattr(world, "TICKS_AT_A_TIME", 50)
    out = tmp_path / "out"
    assert main(["slide", "--touches", "0:mm", "--tilt", "3", "--out", str(out), "--json"]) == 130
    answer = json.loads(capsys.readouterr().out)
    assert (answer["end"], answer["force"]) == ("interrupted", None)
    assert answer["unloaded"].endswith("to free motion")
    assert "was interrupted" in (out / "report.html").read_text()
    assert read_record(out / "record.parquet")["phase"][-1] == RETREAT


def test_a_damaged_end_of_the_slide_is_one_line(tmp_path) -> None:
    record = Record({"t": np.arange(3.0)}, {"t": "s"}, {SLIDE_END: "soon"})
    path = write_record(record, tmp_path / "record.parquet")
    with pytest.raises(InputError, match="the end of its slide is no number of seconds; slide again"):
        Signals().complete(path)
