"""The runs of a study by their number: grids, ranges, points drawn, cases, seeds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.bench import load
from palpate.studies.plan import Sobol, decisive_bytes
from studies.small import SMALL, planned, text


def column(plan, name):
    return [plan.setting(i).at[name] for i in range(len(plan))]


def test_the_grid_is_every_combination_once():
    plan = planned(SMALL)
    runs = [tuple(plan.setting(i).at.values()) for i in range(len(plan))]
    assert len(set(runs)) == len(runs) == 3 * 2 * 2
    assert list(plan.setting(0).at) == ["controller.ki", "surface.damping", "seed"]
    with pytest.raises(IndexError):
        plan.setting(len(plan))


def test_values_arrive_in_the_experiment():
    plan = planned(SMALL)
    one = plan.setting(len(plan) - 1)
    assert one.at == {"controller.ki": 100.0, "surface.damping": 200.0, "seed": 1}
    assert (one.experiment.controller.ki, one.experiment.surface.damping, one.seed) == (100.0, 200.0, 1)
    assert one.experiment.run.press == 0.2  # fixed


def test_a_logarithmic_range_goes_by_equal_factors_from_end_to_end():
    values = sorted(
        set(column(planned(text('"controller.ki" = { log = [0.1, 1000.0], points = 5 }')), "controller.ki"))
    )
    np.testing.assert_allclose(values, [0.1, 1.0, 10.0, 100.0, 1000.0], rtol=1e-12)
    assert (values[0], values[-1]) == (0.1, 1000.0)


def test_what_is_whole_stays_whole_and_is_not_repeated():
    plan = planned(text('"force_sensor.bits" = { range = [8, 12], points = 9 }'))
    assert column(plan, "force_sensor.bits") == [8, 9, 10, 11, 12]
    assert plan.setting(0).experiment.force_sensor.bits == 8


def test_a_component_of_a_list():
    plan = planned(text('"robot.start.0" = [0.460, 0.461]'))
    assert [plan.setting(i).experiment.robot.start for i in range(2)] == [
        (0.460, 0.0, 0.0),
        (0.461, 0.0, 0.0),
    ]


def test_multiplying_and_setting_together():
    plan = planned(text('f = { values = [2.0], times = ["friction.static"], sets = ["controller.ki"] }'))
    plain, changed = load("foam-pi"), plan.setting(0).experiment
    assert changed.friction.static == tuple(2.0 * level for level in plain.friction.static)
    assert changed.controller.ki == 2.0
    assert plan.columns == {"f": float, "seed": int}


def test_lists_and_tables_as_values():
    source = text('"controller.layers" = [[3], [4, 4]]', fixed='[fixed]\ncontroller.weights = "random"')
    plan = planned(source.replace("foam-pi", "foam-neural"))
    assert column(plan, "controller.layers") == ["3", "4-4"]
    assert plan.setting(1).experiment.controller.layers == (4, 4)


def test_cases_bring_other_surfaces_and_other_experiments_which_the_rest_changes():
    plan = planned(
        text(
            """
            "surface.stiffness" = [1000.0]
            world.cases.foam = {}
            world.cases.rubber = { experiment = "rubber-hybrid" }
            [parameters.world.cases.curved.surface]
            kind = "hunt-crossley"
            stiffness = 1.0
            damping = 1.0
            exponent = 2.0
            mass = 0.1
            """
        )
    )
    experiments = {plan.setting(i).at["world"]: plan.setting(i).experiment for i in range(3)}
    assert experiments["rubber"].title == load("rubber-hybrid").title
    assert experiments["rubber"].run.press == 0.2
    assert experiments["rubber"].surface.damping == load("rubber-hybrid").surface.damping
    assert experiments["curved"].surface.exponent == 2.0
    assert {e.surface.stiffness for e in experiments.values()} == {1000.0}


def test_refused_values_are_runs_with_a_reason():
    plan = planned(text('"controller.ki" = [1.0, -1.0]'))
    assert plan.setting(0).experiment is not None
    assert plan.setting(1).experiment is None
    assert "ki in [controller] must be a number at least 0" in plan.setting(1).refused


DRAWN = """
"controller.ki" = { log = [1.0, 100.0], random = true }
"controller.kf" = { range = [0.0, 1.0], random = true }
"""


def test_random_points_fill_the_ranges_and_are_the_same_every_time():
    plan = planned(text(DRAWN + '\n"surface.damping" = [60.0, 200.0]', head="samples = 64"))
    assert len(plan) == 128
    ki, kf = (np.array(column(plan, name)) for name in ("controller.ki", "controller.kf"))
    assert column(
        planned(text(DRAWN + '\n"surface.damping" = [60.0, 200.0]', head="samples = 64")), "controller.ki"
    ) == list(ki)
    # Sobol's 64 points: each 64th of either range has exactly one, which no other generator does.
    for shares in (np.log(ki[::2]) / np.log(100.0), kf[::2]):
        assert sorted(np.floor(64 * shares).astype(int)) == list(range(64))
    other = planned(text(DRAWN, head="samples = 64\nsamples_seed = 1"))
    assert column(other, "controller.kf") != list(kf[::2])


@given(st.lists(st.integers(0, 200), min_size=1, max_size=8))
def test_points_do_not_depend_on_the_order_in_which_they_are_asked_for(order):
    sobol = Sobol(3, seed=5)
    forward = Sobol(3, seed=5)
    points = [forward.point(i) for i in range(max(order) + 1)]
    assert [sobol.point(i) for i in order] == [points[i] for i in order]


def test_a_thousand_million_runs_are_planned_in_no_time():
    million = "{ range = [0.1, 1.0], points = 1000 }"
    plan = planned(
        text(f'"controller.ki" = {million}\n"controller.kf" = {million}\n"controller.kv" = {million}')
    )
    assert len(plan) == 10**9
    assert plan.setting(10**9 - 1).at == {
        "controller.ki": 1.0,
        "controller.kf": 1.0,
        "controller.kv": 1.0,
        "seed": 0,
    }


def test_only_what_decides_the_rows_tells_studies_apart():
    same = SMALL.replace('"Small"', '"Renamed"') + '\n[[curves]]\nx = "controller.ki"\nmetric = "force_rms"\n'
    assert decisive_bytes(planned(same)) == decisive_bytes(planned(SMALL))
    for change in (("seeds = 2", "seeds = 3"), ("points = 3", "points = 4"), ("press = 0.2", "press = 0.3")):
        assert decisive_bytes(planned(SMALL.replace(*change))) != decisive_bytes(planned(SMALL))
