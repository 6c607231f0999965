"""Which setting is better: on the same surfaces, or by its mean over the seeds; and the answer in a sentence."""

import math

import numpy as np
import polars
import pytest
from scipy import stats

from palpate.studies.comparison import Entrant, compare, comparisons, median_interval, rankings
from palpate.studies.plan import plan_runs as plan_of
from palpate.studies.study import parse
from palpate.studies.summary import comparison_sentence, comparison_table, headline
from studies.small import planned, table_of, text

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
    return table_of(plan, lambda at: (value(at), 2.0, 5000.0), failing)


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


SEEDS = 6
GRID = text(
    '"controller.ki" = [1.0, 2.0, 3.0]\n"surface.damping" = [60.0, 200.0]',
    head=f'seeds = {SEEDS}\nbest = {{ least = "force_rms" }}',
)


def noise(seed):
    """Of a seed, the same for every setting."""
    return float(np.random.default_rng(seed).normal())


def value_on_grid(at):
    own = 1e-3 * noise(int(1000 * at["controller.ki"] + at["surface.damping"] + 7 * at["seed"]))
    return (at["controller.ki"] + (at["surface.damping"] == 60.0) + noise(at["seed"]) + own,)


def test_settings_are_ranked_by_their_mean_with_its_interval():
    plan = planned(GRID)
    (ranking,) = rankings(table_of(plan, value_on_grid), plan)
    order = [(s.at["controller.ki"], s.at["surface.damping"]) for s in ranking.settings]
    assert order[0] == (1.0, 200.0)
    assert order[-1] == (3.0, 60.0)
    values = [
        value_on_grid({"controller.ki": 1.0, "surface.damping": 200.0, "seed": s})[0] for s in range(SEEDS)
    ]
    low, high = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    best = ranking.settings[0].metric
    assert best.value == pytest.approx(np.mean(values))
    assert (best.value - best.half, best.value + best.half) == pytest.approx((low, high))


def test_the_noise_that_settings_share_does_not_hide_their_difference():
    plan = planned(GRID)
    (ranking,) = rankings(table_of(plan, value_on_grid), plan)
    for one in ranking.settings[1:]:
        apart = one.at["controller.ki"] - 1.0 + (one.at["surface.damping"] == 60.0)
        assert one.behind.value == pytest.approx(apart, abs=5e-3)
        assert one.behind.half < 5e-3 < one.metric.half  # the seeds scatter by 1
    assert ranking.as_good == 0


def test_a_setting_with_a_failing_run_is_not_ranked():
    plan = planned(GRID)
    frame = table_of(plan, value_on_grid, failing=lambda at: at["controller.ki"] == 1.0 and at["seed"] == 3)
    (ranking,) = rankings(frame, plan)
    assert ranking.failed == 2
    assert ranking.settings[0].at["controller.ki"] == 2.0


def test_the_best_for_each_of_what_is_given():
    plan = planned(GRID.replace('"force_rms" }', '"force_rms", each = ["surface.damping"] }'))
    found = {r.of["surface.damping"]: r for r in rankings(table_of(plan, value_on_grid), plan)}
    assert set(found) == {60.0, 200.0}
    for one in found.values():
        assert one.settings[0].at == {"controller.ki": 1.0}
        assert len(one.settings) == 3


def test_one_seed_has_no_interval():
    plan = planned(GRID.replace("seeds = 6", "seeds = 1"))
    (ranking,) = rankings(table_of(plan, value_on_grid), plan)
    assert ranking.settings[0].metric.half is None
    assert ranking.as_good == len(ranking.settings) - 1


STUDY = """
title = "Two factors"
experiment = "foam-pi"
seeds = {seeds}
metrics = ["{metric}"]
best = {{ least = "{metric}" }}

[parameters]
"controller.ki" = [1.0, 4.0, 16.0]
"controller.kf" = [0.0, 1.0]
"""


def headline_frame(metric="force_rms", seeds=10, failing=()):
    """Each factor adds its own: 16 is 2 N better than 1 in ki, 1 is 0.5 N better than 0 in kf; the noise is shared."""
    noise = np.random.default_rng(0).normal(0.0, 3.0, seeds)
    planned = plan_of(parse(STUDY.format(metric=metric, seeds=seeds), "s"), "s")
    rows = []
    for i in range(len(planned)):
        at = planned.setting(i).at
        value = 10.0 - np.log2(at["controller.ki"]) / 2.0 - 0.5 * at["controller.kf"] + noise[at["seed"]]
        bad = at["controller.ki"] in failing
        result = {
            "result": "no contact" if bad else "done",
            "why": "it is too far" if bad else "as asked for",
        }
        rows.append({"run": i, **at, **result, metric: None if bad else value})
    return polars.DataFrame(rows), planned


def test_a_signed_error_is_judged_by_its_magnitude():
    """-20 N is no smaller error than 1 N."""
    frame, planned = headline_frame("K_error_matched")
    signed = frame.with_columns(
        K_error_matched=polars.when(polars.col("controller.kf") == 1.0).then(-20.0).otherwise(1.0)
    )
    assert rankings(signed, planned)[0].settings[0].at["controller.kf"] == 0.0


def test_failures_come_first_where_they_are_a_fifth():
    frame, planned = headline_frame(failing=(1.0,))
    failures, best = headline(frame, planned, rankings(frame, planned), [])
    assert failures == "20 of 60 runs failed: it is too far."
    assert best.startswith("The least force_rms [N] is ")
    assert best.endswith("with controller.ki 16, controller.kf 1.")
    frame, planned = headline_frame()
    (best,) = headline(frame, planned, rankings(frame, planned), [])
    assert "failed" not in best
