"""A study's file: what it may say, and how it is refused."""

import pytest

from palpate.errors import InputError
from palpate.studies.study import load, names, parse
from studies.small import NEAR, planned, text

LOG = '"controller.ki" = { log = [1.0, 10.0], points = 3 }'


@pytest.mark.parametrize("name", names())
def test_the_studies_that_come_with_palpate_make_plans(name):
    plan = planned_named(name)
    assert 20 < len(plan) < 2000
    for run in range(0, len(plan), 97):
        assert not plan.setting(run).refused
    assert plan.study.maps or plan.study.curves or plan.study.samples
    assert not plan.plugins


def planned_named(name):
    from palpate.studies.plan import plan_runs

    return plan_runs(load(name), name)


def test_the_example_is_a_study(root):
    path = root / "examples" / "study.toml"
    assert len(planned(path.read_text(encoding="utf-8"))) == 13 * 3 * 2 * 3


def test_paths_in_quotes_and_nested_tables_are_the_same():
    quoted = parse(text('"controller.ki" = [1.0, 2.0]'), "T")
    nested = parse(text("controller.ki = [1.0, 2.0]"), "T")
    also = parse(text("[parameters.controller]\nki = [1.0, 2.0]"), "T")
    assert quoted == nested == also


BAD = {
    "not TOML": ("title = ", "not TOML"),
    "no metrics": (text(LOG, metrics="[]"), "metrics is empty"),
    "unknown metric": (
        text(LOG, metrics='["force_rsm"]'),
        "unknown metric 'force_rsm'; did you mean 'force_rms'?",
    ),
    "unknown key": (text(LOG, head="seed = 3"), "unknown key 'seed'; did you mean 'seeds'?"),
    "unknown key of a parameter": (
        text('"controller.ki" = { lgo = [1.0, 2.0], points = 2 }'),
        "unknown key 'lgo'; did you mean 'log'?",
    ),
    "no parameters": (
        f'title = "T"\nexperiment = "foam-pi"\nmetrics = ["force_rms"]\nparameters = {{}}\n{NEAR}',
        "empty",
    ),
    "unknown parameter": (
        text('"controller.kii" = [1.0]'),
        "unknown parameter 'controller.kii'; did you mean 'controller.ki'?",
    ),
    "unknown table": (text('"surfaces.damping" = [1.0]'), "did you mean 'surface.damping'?"),
    "key without its table": (text("damping = [1.0]"), "did you mean 'surface.damping'?"),
    "empty list": (text('"controller.ki" = []'), "has no values: the grid is empty"),
    "range of nothing": (text('"controller.ki" = { range = [2.0, 1.0], points = 3 }'), "from low to high"),
    "no points": (text('"controller.ki" = { range = [1.0, 2.0], points = 0 }'), "at least 1"),
    "neither points nor random": (
        text('"controller.ki" = { range = [1.0, 2.0] }'),
        "one of points and random",
    ),
    "two kinds of values": (
        text('"controller.ki" = { range = [1.0, 2.0], points = 2, values = [1.0] }'),
        "needs one of",
    ),
    "logarithm of zero": (text('"controller.ki" = { log = [0.0, 2.0], points = 2 }'), "above 0"),
    "not a number": (text('"controller.ki" = { range = [nan, 2.0], points = 2 }'), "must be finite"),
    "random without samples": (text('"controller.ki" = { range = [1.0, 2.0], random = true }'), "samples"),
    "samples without random": (text(LOG, head="samples = 8"), "there are none; leave it out"),
    "no seeds": (text(LOG, head="seeds = []"), "seeds is empty"),
    "not a list": (text('"controller.ki" = 3.0'), "constants belong to [fixed]"),
    "no value is good": (
        text('"controller.ki" = [-1.0, -2.0]'),
        "ki in [controller] must be a number at least 0",
    ),
    "wrong kind of value": (text('"controller.ki" = ["much"]'), "must be a number"),
    "window backwards": (text(LOG, head="window = [2.0, 1.0]"), "window"),
    "best of nothing": (text(LOG, head="best = {}"), "one of least and most"),
    "best of what is not measured": (
        text(LOG, head='best = { least = "peak_force" }'),
        "not among the metrics",
    ),
    "map of no parameter": (
        text(LOG, tail='[[maps]]\nx = "controller.ki"\ny = "controller.kff"\nmetric = "force_rms"'),
        "unknown parameter 'controller.kff'",
    ),
    "unknown key of a map": (
        text(LOG, tail='[[maps]]\nx = "controller.ki"\ny = "controller.ki"\nmetrics = "force_rms"'),
        "[[maps]]: unknown key 'metrics'; did you mean 'metric'?",
    ),
    "map that is no table": (text(LOG, head="maps = [3]"), "[[maps]] must be a table"),
    "unknown experiment": (
        text(LOG).replace("foam-pi", "foam-pj"),
        "unknown experiment 'foam-pj'; did you mean 'foam-pi'?",
    ),
    "fixed that is unknown": (text(LOG, fixed="[fixed]\nrun.pres = 1.0"), "did you mean 'run.press'?"),
    "case that is unknown": (
        text('s.cases.a = { "surface.dampin" = 1.0 }'),
        "did you mean 'surface.damping'?",
    ),
    "times a word": (text('f = { times = ["controller.ki"], values = ["a"] }'), "its values are numbers"),
    "times a word of the experiment": (
        text('f = { times = ["surface.kind"], values = [2.0] }'),
        "cannot be multiplied",
    ),
}


@pytest.mark.parametrize(("source", "told"), BAD.values(), ids=BAD)
def test_what_is_wrong_is_told_in_a_line(source, told):
    with pytest.raises(InputError) as refused:
        planned(source)
    message = str(refused.value)
    assert told in message
    assert "\n" not in message
