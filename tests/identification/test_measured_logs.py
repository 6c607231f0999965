"""Measured logs, all the way: what is claimed of them, and what is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.problems import contradictions
from identification.synthetic_contacts import coloured, record
from palpate.identification import Verdict, identify
from palpate.logs import read_log

DATA = Path(__file__).parents[3] / "shared/data"
measured = pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")


def skin(force):
    path = DATA / f"skin_indentation/press_{force}mN.csv"
    return read_log(path, time="time_s", position="position_mm:mm", force="force_mN:mN")


@measured
@pytest.mark.parametrize("force", [800, *(pytest.param(f, marks=pytest.mark.long) for f in (400, 600))])
def test_a_press_on_skin_leaves_with_a_stiffness_and_what_it_belongs_to(force):
    """It stiffens and relaxes: no parameter of a model but a stiffness as the press has it, which is there anyway."""
    found = identify(skin(force))
    assert 0 < found.working_point.force_N < force / 1000
    slopes = [own.stiffness for own in found.press.tangent]
    assert 100 < max(slopes) < 1000
    told = {name: p for name, p in found.parameters.items() if p.verdict is Verdict.IDENTIFIED}
    assert set(told) <= {"K"}
    assert all(p.ci95[0] < max(slopes) and p.ci95[1] > min(slopes) for p in told.values())
    loss = found.press.hysteresis_loss
    assert loss is None or 0 < loss < 1


@measured
@pytest.mark.parametrize(
    "force", [800, *(pytest.param(f, marks=pytest.mark.long) for f in (20, 40, 400, 600))]
)
def test_no_log_gives_a_confident_negative_mass_or_damping(force):
    for model in (None, "kelvin-voigt-mass"):
        found = identify(skin(force), model=model)
        for name in ("B", "M", "K", "K1"):
            p = found.parameters.get(name)
            assert p is None or p.verdict is not Verdict.IDENTIFIED or p.value > 0


@measured
@pytest.mark.parametrize(
    "force", [40, *(pytest.param(f, marks=pytest.mark.long) for f in (20, 400, 600, 800))]
)
def test_a_press_has_one_stiffness_and_one_curve(force):
    """Headline, K and tangents agree at one force, and the loading that is drawn lies on the rows of the contact."""
    found = identify(skin(force))
    assert contradictions(found.to_json()) == []
    rows = np.stack([found.traces.fitted_position, found.traces.fitted_force])
    reach = np.ptp(rows, axis=1)[:, None]
    loading = found.press.loading
    upper = loading[:, loading[1] > loading[1].max() / 2]  # the fit may leave out the touch
    distances = [np.abs((rows - point[:, None]) / reach).max(axis=0).min() for point in upper.T]
    assert max(distances) < 0.01


@measured
def test_the_lattice_has_no_damping_and_no_lag_of_half_a_second():
    log = read_log(DATA / "lattice_probe/probe_states.csv", time="0", position="3:mm", force="4:g")
    found = identify(log)
    for name in ("B", "M"):
        assert found.parameters[name].verdict is not Verdict.IDENTIFIED
    assert found.lag is None or abs(found.lag.value) < 0.1


@pytest.mark.parametrize(
    ("size", "bonded"),
    [
        (2.5e-3, None),
        (1.2e-3, True),
        *(pytest.param(*o, marks=pytest.mark.long) for o in ((1.2e-3, None), (2.5e-3, True))),
    ],
)
def test_a_bistable_structure_has_no_confident_stiffness(size, bonded):
    time = np.arange(6000) / 1000
    x = size * np.sin(np.pi * time) + 0.2 * size * np.sin(14 * np.pi * time)
    f = -4000 * x + 4000 / 1.5e-3**2 * x**3 + 5 * np.gradient(x, 1e-3)
    log = record(time, x, f + coloured(len(x), 0.03, 0.9, np.random.default_rng(0)))
    for lag in (None, 0.0):
        found = identify(log, bonded=bonded, lag=lag)
        assert found.parameters["K"].verdict is not Verdict.IDENTIFIED
