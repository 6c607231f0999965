"""Maps, curves and clouds: what is drawn is what the table holds."""

import matplotlib.pyplot
import msgspec
import numpy as np
import pytest

from palpate.bench import load
from palpate.errors import InputError
from palpate_studies import figures
from palpate_studies.figures import bounds, cells, equivalent, lines, points, references
from palpate_studies.metrics import METRICS
from palpate_studies.pairing import StudyRows
from palpate_studies.plan import MAIN
from palpate_studies.preview import MetricMean, rankings
from palpate_studies.report.lines import Scale
from palpate_studies.run_one import Row, table
from palpate_studies.study import Map
from palpate_studies.summary import interval, present, tables
from studies.small import planned, text

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

[against.pure]
shares = ["world"]
fixed.controller = { kind = "hybrid", ki = 0.0 }
""",
)


def formula(at):
    return at.get("controller.ki", 50.0) + at["seed"] + 1000.0 * (at.get("world") == "rubber")


def results(plan, failing=lambda at: False):
    rows = []
    for run in range(len(plan)):
        at = plan.setting(run).at
        values = (None, None) if failing(at) else (formula(at), 0.0)
        values = values[: len(plan.study.metrics)]
        rows.append(Row(run, at, "lost contact" if failing(at) else "done", "", values, 0.0))
    return table(plan, rows)


@pytest.fixture
def plan():
    return planned(GRID)


def lost(at):
    return at.get("controller.ki") == 100.0 and at["world"] == "foam" and at["seed"] > 0


def test_every_figure_that_is_asked_for_is_drawn_and_none_is_left_open(plan, tmp_path):
    files = figures.draw(list(figures.figures(results(plan, lost), plan)), tmp_path)
    assert [path.name for path in files] == ["map1.png", "map2.png", "curves1.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files)
    assert all(caption.endswith(".") for caption in files.values())
    assert not matplotlib.pyplot.get_fignums()


def test_a_cell_is_the_median_of_its_runs_and_crossed_where_most_failed(plan):
    frame = StudyRows(results(plan, lost), plan)
    asked = plan.study.maps[0]
    x, y = frame.scale(asked.x), frame.scale(asked.y)
    (_, _, foam), (title, value, rubber) = frame.panels(asked)
    values, failed = cells(foam, asked, METRICS[asked.metric], x, y)
    np.testing.assert_array_equal(values, [[2.0, 11.0, 100.0]] * 2)
    np.testing.assert_array_equal(failed, [[False, False, True]] * 2)
    values, failed = cells(rubber, asked, METRICS[asked.metric], x, y)
    np.testing.assert_array_equal(values, [[1002.0, 1011.0, 1101.0]] * 2)
    assert not failed.any()
    assert (title, value) == ("world: rubber", "rubber")
    assert x.label == "K_i [1/s]"


def test_words_are_what_most_runs_came_to(plan):
    frame = StudyRows(results(plan, lost), plan)
    asked = plan.study.maps[1]
    words = cells(frame.part(), asked, METRICS["outcome"], frame.scale("world"), frame.scale("controller.ki"))
    assert words[0].tolist() == [["follows", "follows"], ["follows", "follows"], ["lost contact", "follows"]]


def test_lines_have_median_and_range_and_stop_where_a_run_failed(plan):
    frame = StudyRows(results(plan, lost), plan)
    asked, x = plan.study.curves[0], frame.scale("controller.ki")
    _, foam, rows = frame.panels(asked)[0]
    drawn = list(lines(frame, rows, asked, x))
    assert [line.label for line in drawn] == ["surface.damping 60", "surface.damping 200"]
    np.testing.assert_array_equal(drawn[0].middle, [2.0, 11.0, np.nan])
    np.testing.assert_array_equal(drawn[0].low, [1.0, 10.0, np.nan])
    np.testing.assert_array_equal(drawn[0].high, [3.0, 12.0, np.nan])
    (pure,) = references(frame, asked, x, foam)
    assert pure.reference
    np.testing.assert_array_equal(
        pure.middle, [51.0, 51.0]
    )  # a level from end to end: it has no such parameter
    np.testing.assert_array_equal(pure.x, [1.0, 100.0])


def test_points_that_were_drawn_make_clouds(tmp_path):
    source = text(
        '"controller.ki" = { log = [1.0, 100.0], random = true }\nworld.cases.a = {}\nworld.cases.b = {}',
        head="samples = 16",
        metrics='["force_rms", "outcome"]',
    )
    drawn = planned(source)
    frame = results(drawn)
    assert [f.name for f in figures.draw(list(figures.figures(frame, drawn)), tmp_path)] == [
        "clouds-force_rms.png",
        "clouds-outcome.png",
    ]
    own = StudyRows(frame, drawn)
    found = list(points(own, METRICS["force_rms"], "controller.ki", own.axis("world")))
    assert [one.label for one in found] == ["a", "b"]
    for one in found:
        np.testing.assert_allclose(one.y, one.x)


def test_figures_are_suggested_where_none_are_asked_for(plan, tmp_path):
    plain = planned(GRID[: GRID.index("[[maps]]")] + GRID[GRID.index("[parameters]") :])
    names = [one.name for one in figures.figures(results(plain), plain)]
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


def test_a_figure_may_be_about_some_of_the_runs(plan):
    frame = StudyRows(results(plan), plan)
    some = msgspec.structs.replace(plan.study.curves[0], panels="", where={"world": "rubber"})
    ((_, _, rows),) = frame.panels(some)
    assert set(rows["world"]) == {"rubber"}
    (pure,) = references(frame, some, frame.scale("controller.ki"), None)
    np.testing.assert_array_equal(pure.middle, [1051.0, 1051.0])
    with pytest.raises(InputError, match="unknown value of world 'ruber'; did you mean 'rubber'"):
        frame.panels(msgspec.structs.replace(some, where={"world": "ruber"}))


def test_cells_lie_around_their_values():
    np.testing.assert_allclose(
        Scale("x", [1.0, 10.0, 100.0], log=True).edges(), 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5])
    )
    np.testing.assert_allclose(Scale("x", [1.0, 2.0, 4.0]).edges(), [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(Scale("x", ["a", "b"]).edges(), [-0.5, 0.5, 1.5])
    low, high = Scale("x", [5.0]).edges()
    assert low < 5.0 < high


@pytest.mark.parametrize(
    ("values", "logarithmic"),
    [("[1, 2, 5, 10, 20]", True), ("[1, 2, 3, 4]", False), ("[0, 1, 10]", False), ("[1, 100]", False)],
)
def test_values_that_go_by_factors_are_drawn_so(values, logarithmic):
    plan = planned(text(f'"controller.ki" = {values}'))
    assert StudyRows(results(plan), plan).scale("controller.ki").log == logarithmic


def test_the_tables_have_the_best_for_each_surface_and_of_what_it_is_compared_with(plan):
    frame = results(plan, lost)
    own, pure, came = tables(frame, plan, rankings(frame, plan, MAIN))
    assert own.head[:4] == ("world", "K_i [1/s]", "surface.damping [N s/m]", "force_rms [N]")
    assert [row[:2] for row in own.rows] == [("foam", "1"), ("rubber", "1")]
    assert own.rows[0][-1] == "2"  # settings with a failed run
    assert [row[0] for row in pure.rows] == ["foam", "rubber"]
    assert came.rows == [("done", "38"), ("lost contact", "4")]


@pytest.mark.parametrize(
    ("mean", "told"),
    [
        (MetricMean(1.23456, 0.0123), "1.235 ± 0.012"),
        (MetricMean(123.4, 15.0), "123 ± 15"),
        (MetricMean(0.5, None), "0.5"),
    ],
)
def test_a_mean_has_the_digits_of_its_interval(mean, told):
    assert interval(mean) == told


def test_the_equivalent_of_the_neural_controller_is_its_integrator():
    neural = load("foam-neural")
    plain = equivalent(neural)
    assert plain.controller.ki == pytest.approx(5.0)  # eta (A/2)²/Ts = 5e-5 * 100 / 1 ms
    assert plain.controller.kf == neural.controller.kf
    assert plain.surface == neural.surface
    assert equivalent(plain) == plain


@pytest.mark.long
def test_the_bound_is_where_the_linear_model_turns_unstable():
    from palpate_studies.analysis import linearise

    source = text(
        '"surface.stiffness" = { log = [2000.0, 100000.0], points = 3 }\n"surface.damping" = [60.0]', fixed=""
    )
    part = planned(source.replace("foam-pi", "foam-hybrid")).parts[0]
    asked = Map("surface.stiffness", "surface.damping", "force_rms", bound="linear")
    x, y = (Scale(a.name, a.labels(), log=i == 0) for i, a in enumerate(part.axes))
    (line,) = bounds(part, asked, None, x, y)
    assert list(line.y) == [60.0]
    for factor, stable in ((0.97, True), (1.03, False)):
        one = part.experiment({"surface.stiffness": factor * line.x[0], "surface.damping": 60.0})
        assert linearise(one).stable == stable
