"""The best settings and how sure they are."""

import numpy as np
import pytest
from scipy import stats

from palpate_studies.preview import mean, rankings
from palpate_studies.run_one import Row, table
from studies.small import planned, text

SEEDS = 6
GRID = text(
    '"controller.ki" = [1.0, 2.0, 3.0]\n"surface.damping" = [60.0, 200.0]',
    head=f'seeds = {SEEDS}\nbest = {{ least = "force_rms" }}',
)


def noise(seed):
    """Of a seed, the same for every setting."""
    return float(np.random.default_rng(seed).normal())


def value(at):
    own = 1e-3 * noise(int(1000 * at["controller.ki"] + at["surface.damping"] + 7 * at["seed"]))
    return at["controller.ki"] + (at["surface.damping"] == 60.0) + noise(at["seed"]) + own


def frame_of(plan, formula, failing=lambda at: False):
    rows = []
    for run in range(len(plan)):
        at = plan.setting(run).at
        bad = failing(at)
        rows.append(Row(run, at, "diverged" if bad else "done", "", (None if bad else formula(at),), 0.0))
    return table(plan, rows)


def test_settings_are_ranked_by_their_mean_with_its_interval():
    plan = planned(GRID)
    (ranking,) = rankings(frame_of(plan, value), plan)
    order = [(s.at["controller.ki"], s.at["surface.damping"]) for s in ranking.settings]
    assert order[0] == (1.0, 200.0)
    assert order[-1] == (3.0, 60.0)
    values = [value({"controller.ki": 1.0, "surface.damping": 200.0, "seed": s}) for s in range(SEEDS)]
    low, high = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    best = ranking.settings[0].metric
    assert best.value == pytest.approx(np.mean(values))
    assert (best.value - best.half, best.value + best.half) == pytest.approx((low, high))


def test_the_noise_that_settings_share_does_not_hide_their_difference():
    plan = planned(GRID)
    (ranking,) = rankings(frame_of(plan, value), plan)
    for one in ranking.settings[1:]:
        apart = one.at["controller.ki"] - 1.0 + (one.at["surface.damping"] == 60.0)
        assert one.behind.value == pytest.approx(apart, abs=5e-3)
        assert one.behind.half < 5e-3 < one.metric.half  # the seeds scatter by 1
    assert len(ranking.alike) == 1


def test_what_cannot_be_told_apart_is_said():
    plan = planned(GRID)

    def alike(at):
        return (at["surface.damping"] == 60.0) + 1e-3 * noise(int(1000 * at["controller.ki"] + at["seed"]))

    (ranking,) = rankings(frame_of(plan, alike), plan)
    assert ranking.spans() == {"controller.ki": [1.0, 2.0, 3.0], "surface.damping": [200.0]}


def test_a_setting_with_a_failing_run_is_not_ranked():
    plan = planned(GRID)
    frame = frame_of(plan, value, failing=lambda at: at["controller.ki"] == 1.0 and at["seed"] == 3)
    (ranking,) = rankings(frame, plan)
    assert ranking.failed == 2
    assert ranking.settings[0].at["controller.ki"] == 2.0


def test_a_number_of_a_run_that_failed_does_not_count():
    plan = planned(GRID)
    rows = [
        Row(run, at, "lost contact" if at["controller.ki"] == 1.0 else "done", "", (value(at),), 0.0)
        for run, at in ((run, plan.setting(run).at) for run in range(len(plan)))
    ]
    (ranking,) = rankings(table(plan, rows), plan)
    assert ranking.failed == 2
    assert {one.at["controller.ki"] for one in ranking.settings} == {2.0, 3.0}


def test_the_best_for_each_of_what_is_given():
    plan = planned(GRID.replace('"force_rms" }', '"force_rms", each = ["surface.damping"] }'))
    found = {r.of["surface.damping"]: r for r in rankings(frame_of(plan, value), plan)}
    assert set(found) == {60.0, 200.0}
    for one in found.values():
        assert one.settings[0].at == {"controller.ki": 1.0}
        assert len(one.settings) == 3


def test_the_most_is_the_best_where_it_is_asked_for():
    plan = planned(GRID.replace("least", "most"))
    (ranking,) = rankings(frame_of(plan, value), plan)
    assert ranking.settings[0].at == {"controller.ki": 3.0, "surface.damping": 60.0}
    assert all(one.behind.value >= 0.0 for one in ranking.settings)


def test_one_seed_has_no_interval():
    plan = planned(GRID.replace("seeds = 6", "seeds = 1"))
    (ranking,) = rankings(frame_of(plan, value), plan)
    assert ranking.settings[0].metric.half is None
    assert len(ranking.alike) == len(ranking.settings)


def test_the_interval_covers_the_mean_at_its_rate():
    generator = np.random.default_rng(0)
    found = [mean(list(generator.normal(3.0, 1.0, 4))) for _ in range(2000)]
    covered = np.mean([abs(m.value - 3.0) <= m.half for m in found])
    assert covered == pytest.approx(0.95, abs=0.015)  # three standard deviations of 2000 draws
