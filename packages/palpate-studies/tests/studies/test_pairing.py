"""Settings on the same surfaces: the easiest surface does not win, a failure is no missing number."""

import math

import numpy as np
import pytest
from scipy import stats

from palpate.errors import InputError
from palpate_studies.effects import comparison_sentence, comparison_table
from palpate_studies.pairing import Entrant, compare, comparisons, median_interval
from palpate_studies.run_one import Row, table
from palpate_studies.summary import present
from studies.small import planned, text

N = 64
RANDOM = text(
    '"surface.stiffness" = { log = [1000.0, 50000.0], random = true }\n'
    '[parameters.law.cases]\nA = {}\nB = { "controller.ki" = 2.0 }\nC = { "controller.ki" = 3.0 }',
    head=f'samples = {N}\nbest = {{ least = "force_rms" }}',
    metrics='["force_rms", "overshoot", "K_matched"]',
)
LAWS = {"A": 0.0, "B": 0.05, "C": -0.3}


def value(at):
    """How hard the surface is counts twenty times as much as the law."""
    hard = math.log(at["surface.stiffness"]) + 0.02 * math.sin(17.0 * at["surface.stiffness"])
    return hard + LAWS[at["law"]]


def frame_of(plan, failing=lambda at: False):
    rows = []
    for run in range(len(plan)):
        at = plan.setting(run).at
        bad = failing(at)
        numbers = (None, None, None) if bad else (value(at), 2.0, 5000.0)
        rows.append(Row(run, at, "lost contact" if bad else "done", "", numbers, 0.0))
    return table(plan, rows)


def entrant(values):
    values = np.asarray(values, float)
    return Entrant("one", {}, values, ~np.isfinite(values))


def test_the_law_wins_and_not_the_easiest_surface():
    plan = planned(RANDOM)
    found = comparisons(frame_of(plan), plan)
    assert [one.metric for one in found] == ["force_rms", "overshoot"]  # K has no better side
    first = found[0]
    assert [e.name for e in first.entrants] == ["C", "A", "B"]
    assert first.ranks == (1.0, 2.0, 3.0)
    pair = first.behind[1]
    assert pair.median == pytest.approx(0.3)
    assert pair.won == 0.0
    assert pair.decided
    assert (pair.won_low, pair.won_high) == pytest.approx(stats.binomtest(0, N).proportion_ci(0.95))
    assert comparison_sentence(first).startswith("C has the smaller force_rms")
    assert "on 64 of 64 surfaces, by" in comparison_sentence(first)


def test_the_interval_of_the_median_is_that_of_the_sign_test():
    for n in (6, 7, 20, 101):
        values = np.random.default_rng(n).standard_exponential(n)
        theirs = stats.quantile_test(values, q=0.0, p=0.5).confidence_interval(0.95)
        assert median_interval(values) == pytest.approx((theirs.low, theirs.high))
    assert median_interval(np.arange(5.0)) == (None, None)  # five signs cannot reach 95 %


def test_it_covers_the_median_at_its_rate():
    """Of a skewed distribution too; 2000 draws know a rate of 95 % to 0.5 %."""
    random = np.random.default_rng(0)
    ends = np.array([median_interval(random.standard_exponential(40)) for _ in range(2000)])
    assert np.mean((ends[:, 0] < math.log(2.0)) & (math.log(2.0) < ends[:, 1])) >= 0.945


def test_a_run_that_failed_is_worse_than_any():
    one, other = entrant([1.0, 1.0, math.nan, math.nan]), entrant([2.0, math.nan, 2.0, math.nan])
    pair = compare(one, other, most=False)
    assert (pair.won, pair.lost, pair.surfaces) == (pytest.approx(2 / 3), pytest.approx(1 / 3), 3)
    assert compare(other, one, most=True).lost == pytest.approx(1 / 3)


def test_failures_count_where_contact_is_lost_on_most_surfaces():
    plan = planned(RANDOM)
    (first, _) = comparisons(
        frame_of(plan, lambda at: at["law"] == "C" and at["surface.stiffness"] > 3000.0), plan
    )
    assert first.entrants[0].name == "A"
    last = first.behind[[e.name for e in first.entrants].index("C")]
    assert math.isinf(last.median)
    assert last.decided
    row = next(r for r in comparison_table(first).rows if r[0] == "C")
    assert row[3] == "fails on most"


def test_laws_that_do_not_differ_are_not_told_apart():
    random = np.random.default_rng(3)
    values = random.standard_normal(200)
    pair = compare(entrant(values + 0.1 * random.standard_normal(200)), entrant(values), most=False)
    assert not pair.decided
    assert 0.4 < pair.won < 0.6


def test_values_of_a_grid_are_surfaces_where_best_says_so():
    grid = text(
        '"surface.damping" = [60.0, 120.0, 200.0, 300.0, 350.0, 400.0]\n"controller.ki" = [1.0, 2.0]',
        head='best = { least = "force_rms", over = ["surface.damping"] }',
    )
    plan = planned(grid)
    rows = [
        Row(run, at, "done", "", (at["surface.damping"] + at["controller.ki"],), 0.0)
        for run, at in ((run, plan.setting(run).at) for run in range(len(plan)))
    ]
    (found,) = comparisons(table(plan, rows), plan)
    assert [e.at for e in found.entrants] == [{"controller.ki": 1.0}, {"controller.ki": 2.0}]
    assert found.behind[1].median == pytest.approx(1.0)
    with pytest.raises(InputError, match="unknown parameter 'damp'"):
        planned(grid.replace('over = ["surface.damping"]', 'over = ["damp"]'))


def test_page_and_summary_say_which_is_better(tmp_path):
    plan = planned(RANDOM)
    found = present(frame_of(plan), plan, tmp_path, RANDOM, "palpate study x")
    page = (tmp_path / "report.html").read_text()
    assert "C has the smallest force_rms" in page
    assert found.summary["compared"][0]["settings"][0]["name"] == "C"
    assert {"clouds-force_rms.png", "clouds-overshoot.png", "clouds-K_matched.png"} <= {
        p.name for p in tmp_path.iterdir()
    }
