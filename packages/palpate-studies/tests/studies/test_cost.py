"""What a study takes is said before it is begun."""

import time

import pytest

from palpate.bench.speed import cores
from palpate.text import duration
from palpate_studies.preview import seconds_a_run, too_much
from palpate_studies.run_one import Local, RunJob
from studies.small import SMALL, planned, text


@pytest.fixture(autouse=True)
def own_time(monkeypatch):
    """Time of this process alone, which other programs do not take."""
    monkeypatch.setattr(time, "perf_counter", time.process_time)


def test_the_cost_of_a_run_is_about_what_runs_take():
    plan = planned(SMALL.replace("press = 0.2", "press = 1.0").replace("duration = 1.5", "duration = 3.0"))
    seconds = seconds_a_run(plan)
    jobs = [RunJob(plan.setting(i), ("force_rms",), None, False) for i in range(len(plan))]
    begun = time.perf_counter()
    list(Local(1).run(jobs))
    taken = (time.perf_counter() - begun) / len(jobs)
    assert 0.2 * taken < seconds < 5.0 * taken


def test_a_long_run_is_judged_by_its_beginning():
    plan = planned(
        SMALL.replace("press = 0.2", "press = 3000.0").replace("duration = 1.5", "duration = 3000.0")
    )
    begun = time.perf_counter()
    seconds = seconds_a_run(plan)
    assert time.perf_counter() - begun < 0.1 * seconds


def test_where_the_first_settings_are_refused_the_next_ones_count():
    assert seconds_a_run(planned(text('"controller.ki" = [-1.0, -2.0, 5.0]'))) > 0.0


def test_only_what_takes_long_is_warned_of():
    assert too_much(planned(SMALL), 1.0) == ""
    day = too_much(planned(SMALL), 86400.0)
    assert day.startswith("the study has 12 runs, which take some ")
    assert f"on the {cores()} cores here" in day
    many = "{ range = [0.1, 1.0], points = 1000 }"
    huge = planned(text(f'"controller.ki" = {many}\n"controller.kf" = {many}'))
    assert "1,000,000 runs" in too_much(huge, 1e-9)


def test_times_are_told_in_a_fitting_unit():
    assert duration(50.0) == "50 seconds"
    assert duration(600.0) == "10 minutes"
    assert duration(7200.0) == "2 hours"
    assert duration(3.2e9) == "101 years"
