"""The effect of each factor by itself, from tables made by hand; failures and their cause first."""

import numpy as np
import polars
import pytest

from palpate.errors import InputError
from palpate_studies.effects import effect_sentence, effects, effects_table
from palpate_studies.plan import plan
from palpate_studies.preview import check_cases, rankings
from palpate_studies.study import parse
from palpate_studies.summary import headline, tables

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


def table(metric="force_rms", seeds=10, failing=()):
    """Each factor adds its own: 16 is 2 N better than 1 in ki, 1 is 0.5 N better than 0 in kf; the noise is shared."""
    noise = np.random.default_rng(0).normal(0.0, 3.0, seeds)
    planned = plan(parse(STUDY.format(metric=metric, seeds=seeds), "s"), "s")
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


def test_each_factor_is_apart_and_the_largest_effect_is_first():
    frame, planned = table()
    first, second = effects(frame, planned)
    assert effect_sentence(first, "pairs of runs") == (
        "controller.ki 16 has the smallest force_rms: 2.00 N (95 %: 2.00 to 2.00) better than with controller.ki 1, "
        "the worst, and better on 20 of 20 pairs of runs."
    )
    assert effect_sentence(second, "pairs of runs") == (
        "controller.kf 1 has the smaller force_rms on 30 of 30 pairs of runs, by 0.500 N (95 %: 0.500 to 0.500)."
    )
    rows = effects_table([first, second]).rows
    assert [row[:3] for row in rows] == [("controller.ki", "16", "1"), ("controller.kf", "1", "0")]


def test_a_factor_without_an_effect_is_said_to_have_none():
    frame, planned = table()
    coin = polars.Series(np.random.default_rng(1).normal(0.0, 1.0, len(frame)))
    told = {
        next(iter(one.of)): effect_sentence(one, "pairs")
        for one in effects(frame.with_columns(force_rms=coin), planned)
    }
    assert told["controller.kf"].startswith("controller.kf does not change force_rms significantly")


def test_a_signed_error_is_judged_by_its_magnitude():
    """-20 N is no smaller error than 1 N."""
    frame, planned = table("force_error")
    signed = frame.with_columns(
        force_error=polars.when(polars.col("controller.kf") == 1.0).then(-20.0).otherwise(1.0)
    )
    told = next(one for one in effects(signed, planned) if "controller.kf" in one.of)
    assert effect_sentence(told, "pairs").startswith(
        "controller.kf 0 has the smaller force_error by magnitude on 30 of 30"
    )
    assert rankings(signed, planned)[0].settings[0].at["controller.kf"] == 0.0


def test_failures_come_first_where_they_are_a_fifth():
    frame, planned = table(failing=(1.0,))
    apart, ranked = effects(frame, planned), rankings(frame, planned)
    assert headline(frame, planned, ranked, [], apart)[0] == "20 of 60 runs failed: it is too far."
    assert "with controller.ki 1 most runs fail" in headline(frame, planned, ranked, [], apart)[1]
    frame, planned = table()
    assert "failed" not in headline(frame, planned, rankings(frame, planned), [], effects(frame, planned))[0]
    assert tables(frame, planned, rankings(frame, planned))


FAR = """
title = "Too far"
experiment = "foam-pi"
seeds = 100
metrics = ["force_rms"]

[fixed]
run = {{ press = 0.1, duration = {duration} }}

[parameters.law.cases]
PI = {{}}
hybrid = {{ experiment = "foam-hybrid" }}
"""


def test_a_case_that_touches_nothing_is_refused_before_hundreds_of_runs():
    far = plan(parse(FAR.format(duration=2.0), "far"), "far")
    with pytest.raises(
        InputError, match=r"with law PI, a try before 200 runs.* 11 mm .* the approach takes 14 s"
    ):
        check_cases(far)
    check_cases(plan(parse(FAR.format(duration=2.0).replace("100", "10"), "few"), "few"))


def test_a_study_whose_cases_touch_is_begun():
    check_cases(plan(parse(FAR.format(duration=30.0), "near"), "near"))
