"""Presses along one direction: their files, their records, and what the shipped ones show."""

import numpy as np
import pytest

from palpate.bench import names, summarise, with_values
from palpate.bench.from_experiment import FILES, build_any, load_any, parse_any
from palpate.bench.one_direction import OneDirection
from palpate.errors import InputError

PRESSES = sorted(set(FILES.names()) - set(names()))
GOOD = """
title = "A press"
arm = "ur5e"

[surface]
stiffness = 5e3
"""


def run(name, **changes):
    experiment = with_values(
        load_any(name), {key.replace("__", "."): value for key, value in changes.items()}
    )
    return build_any(experiment).run(experiment.run.duration, 3, press=experiment.run.press)


@pytest.mark.parametrize("name", PRESSES)
def test_every_shipped_press_says_what_it_is_and_presses_on(name):
    experiment = load_any(name)
    assert isinstance(experiment, OneDirection)
    assert experiment.about
    record = run(name)
    assert record.meta["end"] == "done"
    summary = summarise(record)
    if "priors" not in name:  # told of surfaces ten times softer, a torque arm bounces once
        assert summary["contacts_lost"] == 0
    if "moving" not in name:
        assert abs(summary["force"]["error_N"]) < 0.05 * summary["force"]["desired_N"]  # the settled band
    for column in record.columns.values():
        assert np.isfinite(column).all()


def test_the_same_seed_gives_the_same_numbers_and_another_others():
    bench = build_any(load_any("fr3-touch"))
    first, again, other = (bench.run(9.0, seed, press=0.5) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first["force"], again["force"])
    assert not np.array_equal(first["force_measured"][:300], other["force_measured"][:300])


def test_a_change_keeps_the_force_and_the_surface_is_another_one():
    record = run("fr3-stiffer", noise=0.0)
    start = int(np.argmax(record["phase"] == 1.0))
    around = slice(start + 1990, start + 2050)
    assert (
        np.ptp(record["force"][around]) < 0.4
    )  # of 20 N; a spring of 62 kN/m that did not move with it: 1000 N
    late, x = record["force"][start + 4000 :], record["x"][start + 4000 :]
    slope = np.polyfit(x, late, 1)[0]
    assert slope == pytest.approx(62e3, rel=0.02)  # friction has none here, the damper's share is small


WRONG = {
    "an arm that there is none of": ('"ur5e"', '"ur5"', "unknown arm 'ur5'"),
    "a force below the noise": ("[surface]", "noise = 3.0\n[surface]", "below 8 standard deviations"),
    "a force beyond the sensor": ("[surface]", "force.first = 200.0\n[surface]", "full scale"),
}


@pytest.mark.parametrize(("old", "new", "told"), WRONG.values(), ids=WRONG)
def test_a_wrong_file_is_told_in_its_own_words(old, new, told):
    with pytest.raises(InputError, match=told) as caught:
        build_any(parse_any(GOOD.replace(old, new, 1), "mine.toml"))
    assert "\n" not in str(caught.value)
