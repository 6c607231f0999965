"""Maps and curves: what is drawn is what the table holds."""

import matplotlib.pyplot
import numpy as np
import pytest

from palpate.studies.comparison import rankings
from palpate.studies.figures import (
    cells,
    draw,
    figures,
    lines_of,
    panels_of,
    scale_of,
    trend_lines,
)
from palpate.studies.journal import Row
from palpate.studies.metrics import METRICS
from palpate.studies.run_study import table
from palpate.studies.summary import present, ranking_table
from studies.small import planned, table_of, text

GRID = text(
    """
    "controller.ki" = { log = [1.0, 100.0], points = 3, label = "K_i [1/s]" }
    "surface.damping" = [60.0, 200.0]
    world.cases.foam = {}
    world.cases.rubber = { experiment = "rubber-hybrid", controller = { kind = "proportional-integral" } }
    """,
    head='seeds = 3\nbest = { least = "force_rms", each = ["world"] }',
    metrics='["force_rms", "outcome"]',
    tail="""
[[maps]]
x = "controller.ki"
y = "surface.damping"
metric = "force_rms"
panels = "world"

[[maps]]
x = "world"
y = "controller.ki"
metric = "outcome"

[[curves]]
x = "controller.ki"
metric = "force_rms"
lines = "surface.damping"
panels = "world"
""",
)


def formula(at):
    return at["controller.ki"] + at["seed"] + 1000.0 * (at.get("world") == "rubber")


def results(plan, failing=lambda at: False):
    return table_of(plan, lambda at: (formula(at), 0.0)[: len(plan.study.metrics)], failing)


@pytest.fixture
def plan():
    return planned(GRID)


def lost(at):
    return at["controller.ki"] == 100.0 and at["world"] == "foam" and at["seed"] > 0


def test_every_figure_that_is_asked_for_is_drawn_and_none_is_left_open(plan, tmp_path):
    files = draw(results(plan, lost), plan, tmp_path)
    assert [path.name for path in files] == ["map1.png", "map2.png", "curves1.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files)
    assert all(caption.endswith(".") for caption in files.values())
    assert not matplotlib.pyplot.get_fignums()


def test_a_cell_is_the_median_of_its_runs_and_crossed_where_most_failed(plan):
    asked = plan.study.maps[0]
    x, y = scale_of(plan.axis(asked.x)), scale_of(plan.axis(asked.y))
    (_, foam), (title, rubber) = panels_of(results(plan, lost), plan, asked.panels)
    values, failed = cells(foam, asked, METRICS[asked.metric], x, y)
    np.testing.assert_array_equal(values, [[2.0, 11.0, 100.0]] * 2)
    np.testing.assert_array_equal(failed, [[False, False, True]] * 2)
    values, failed = cells(rubber, asked, METRICS[asked.metric], x, y)
    np.testing.assert_array_equal(values, [[1002.0, 1011.0, 1101.0]] * 2)
    assert not failed.any()
    assert title == "world: rubber"
    assert x.label == "K_i [1/s]"


def test_words_are_what_most_runs_came_to(plan):
    x, y = scale_of(plan.axis("world")), scale_of(plan.axis("controller.ki"))
    words = cells(results(plan, lost), plan.study.maps[1], METRICS["outcome"], x, y)
    assert words[0].tolist() == [["follows", "follows"], ["follows", "follows"], ["lost contact", "follows"]]


def test_lines_have_median_and_range_and_stop_where_a_run_failed(plan):
    asked, x = plan.study.curves[0], scale_of(plan.axis("controller.ki"))
    _, rows = panels_of(results(plan, lost), plan, asked.panels)[0]
    drawn = list(lines_of(rows, plan, asked, x))
    assert [line.label for line in drawn] == ["surface.damping: 60", "surface.damping: 200"]
    np.testing.assert_array_equal(drawn[0].middle, [2.0, 11.0, np.nan])
    np.testing.assert_array_equal(drawn[0].low, [1.0, 10.0, np.nan])
    np.testing.assert_array_equal(drawn[0].high, [3.0, 12.0, np.nan])


def test_a_trend_over_a_random_parameter_for_each_case(tmp_path):
    source = text(
        '"controller.ki" = { log = [1.0, 100.0], random = true }\nworld.cases.a = {}\nworld.cases.b = {}',
        head="samples = 16",
        metrics='["force_rms", "outcome"]',
    )
    drawn = planned(source)
    frame = results(drawn)
    names = [path.name for path in draw(frame, drawn, tmp_path)]
    assert names == ["trends-force_rms.png", "trends-outcome.png"]
    found = list(trend_lines(frame, drawn, METRICS["force_rms"], "controller.ki", "world"))
    assert [line.label for line in found] == ["world: a", "world: b"]
    for line in found:
        assert len(line.x) == 8
        np.testing.assert_allclose(line.middle, line.x)  # the formula is the parameter itself
        assert (line.low < line.middle).all()
        assert (line.middle < line.high).all()


def test_figures_are_suggested_where_none_are_asked_for(plan, tmp_path):
    plain = planned(GRID[: GRID.index("[[maps]]")] + GRID[GRID.index("[parameters]") :])
    names = [one.name for one in figures(results(plain), plain)]
    assert names == ["map1", "map2", "curves1"]  # a map of each metric; curves of quantities only


@pytest.mark.parametrize(
    "parameters", ['"controller.ki" = { log = [1.0, 100.0], points = 3 }\n"surface.damping" = [60.0, 200.0]']
)
def test_runs_that_feel_no_surface_are_a_report_too(tmp_path, parameters):
    """Nothing can be drawn over the logarithm of nothing; the figures are empty, and the rest is told."""
    plan = planned(text(parameters, head="seeds = 2"))
    rows = [
        Row(i, plan.setting(i).at, "no contact", "no surface was felt", (None,), 0.1)
        for i in range(len(plan))
    ]
    found = present(table(plan, rows), plan, tmp_path, "", "palpate study")
    assert found.summary["results"] == {"no contact": len(plan)}
    assert {path.name for path in tmp_path.iterdir()} >= {
        "report.html",
        "summary.json",
        "curves1.png",
        "map1.png",
    }


def test_the_table_has_the_best_settings_for_each_surface(plan):
    frame = results(plan, lost)
    ranked = rankings(frame, plan)
    best = ranking_table(plan, ranked)
    assert best.head[:4] == ("world", "K_i [1/s]", "surface.damping", "force_rms [N]")
    assert [row[:2] for row in best.rows] == [("foam", "1")] * 2 + [("foam", "10")] * 2 + [
        ("rubber", value) for value in ("1", "1", "10", "10", "100", "100")
    ]
    assert [ranking.failed for ranking in ranked] == [2, 0]
