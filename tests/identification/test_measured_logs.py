"""Measured logs, all the way: what is claimed of them, and what is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.synthetic_contacts import coloured, press_path, record, shaken
from palpate.errors import InputError
from palpate.identification import Verdict, identify
from palpate.logs import read_log

DATA = Path(__file__).parents[3] / "shared/data"
measured = pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")


def skin(force):
    path = DATA / f"skin_indentation/press_{force}mN.csv"
    return read_log(path, time="time_s", position="position_mm:mm", force="force_mN:mN")


@measured
@pytest.mark.parametrize("force", [400, 600, 800])
def test_skin(force):
    found = identify(skin(force))
    assert found.model == "hunt-crossley"
    assert "model-rejected" in found.codes  # it relaxes while it is held
    assert found.r2 >= 0.97
    n, x0 = found.parameters["n"], found.parameters["x0"]
    assert 1.3 <= n.value <= 1.7
    assert n.ci95[0] < n.value < n.ci95[1]
    assert 0.5e-3 < x0.value < 1.5e-3  # the lever rests on the skin at 0.92 to 1.27 mm before
    assert "n and x0 are told together only" in n.reason
    assert all(p.verdict is Verdict.REJECTED for name, p in found.parameters.items() if name != "M")
    rivals = {c.model: c for c in found.comparison}
    assert rivals["hunt-crossley"].held_out < rivals["kelvin-voigt"].held_out
    assert rivals["hunt-crossley with relaxation"].r2 > 0.996


@measured
@pytest.mark.parametrize("force", [20, 40, 400, 600, 800])
def test_no_log_gives_a_confident_negative_mass_or_damping(force):
    for model in (None, "kelvin-voigt-mass"):
        found = identify(skin(force), model=model)
        for name in ("B", "M", "K", "K1"):
            p = found.parameters.get(name)
            assert p is None or p.verdict is not Verdict.IDENTIFIED or p.value > 0


@measured
def test_the_lattice_has_a_least_lag_and_no_damping():
    log = read_log(DATA / "lattice_probe/probe_states.csv", time="0", position="3:mm", force="4:g")
    found = identify(log)
    assert found.parameters["B"].verdict is Verdict.REJECTED
    assert 0.4 < found.lag[0] < 0.6
    text = next(w.text for w in found.warnings if w.code.word == "force-lags-position")
    assert "at least 0.51" in text
    assert "flat (to a thousandth) from 0.29 to 0.75 s" in text


def test_friction_is_found_where_it_is_needed():
    time = np.arange(6000) / 1000
    x = press_path(time, 0.2)
    v = np.gradient(x, 1e-3)
    noise = coloured(len(x), 0.03, 0.9, np.random.default_rng(0))
    found = identify(
        record(time, x, np.where(x > 0, 5000 * x + 20 * v + 1.5 * np.sign(v), 0) + noise), lag=0.0
    )
    friction = found.parameters["Fc"]
    assert friction.verdict is Verdict.IDENTIFIED
    assert friction.unit == "N"
    assert friction.value == pytest.approx(1.5, rel=0.1)
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.02)
    assert "Fc" not in identify(shaken(n=2500), lag=0.0).parameters


@pytest.mark.parametrize("size", [1.2e-3, 2.5e-3])
@pytest.mark.parametrize("bonded", [None, True])
def test_a_bistable_structure_has_no_confident_stiffness(size, bonded):
    time = np.arange(6000) / 1000
    x = size * np.sin(np.pi * time) + 0.2 * size * np.sin(14 * np.pi * time)
    f = -4000 * x + 4000 / 1.5e-3**2 * x**3 + 5 * np.gradient(x, 1e-3)
    log = record(time, x, f + coloured(len(x), 0.03, 0.9, np.random.default_rng(0)))
    for lag in (None, 0.0):
        found = identify(log, bonded=bonded, lag=lag)
        assert "model-rejected" in found.codes
        assert all(p.value is None for p in found.parameters.values())


@pytest.mark.parametrize("method", ["instrumental-variables", "output-error"])
def test_other_estimators_stand_noise_of_the_position(method):
    log = shaken(n=3000, noise=1e-3, position_noise=1e-4)
    asked = {"lag": 0.0, "bonded": True, "cutoff": 60.0, "model": "kelvin-voigt-mass"}
    found = identify(log, method=method, **asked)
    mass = found.parameters["M"]
    assert mass.ci95[0] < 0.5 < mass.ci95[1]
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.02)


def test_methods_that_there_are_none_of():
    with pytest.raises(InputError, match="unknown method 'guessing'"):
        identify(shaken(n=2500), method="guessing")
    with pytest.raises(InputError, match="a known force filter is for least-squares"):
        identify(shaken(n=2500), method="output-error", force_filter="butterworth3:120")
