"""The first sentence agrees with the table below it, and both with the log."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "identification"))

import plain_presses
from foreign.logs import CELLS, make_log
from foreign.scoring import record_of

from palpate.errors import InputError
from palpate.identification import Identification, Parameter, Verdict, identify
from palpate.identification.sampling import channels_of
from palpate.identification.strokes import find_strokes
from palpate.logs import read_log
from palpate.report.identification.answer import lines
from palpate.report.identification.words import UNTOUCHED, full_number, sentence

DATA = Path(__file__).parents[3] / "shared/data"
_SURFACES, _NUISANCES = (
    list(dict.fromkeys(names)) for names in zip(*((c.surface, c.nuisance) for c in CELLS), strict=True)
)
SLICE = [c for c in CELLS if (_SURFACES.index(c.surface) + _NUISANCES.index(c.nuisance)) % 11 == 0]
"""An eleventh of the cells: each surface under two or three nuisances, each nuisance on a surface. What a sentence says
depends on the verdicts, the warnings and the working point, and each of them occurs many times among these."""
MEASURED = {
    "skin_indentation/press_*.csv": {"time": "time_s", "position": "position_mm:mm", "force": "force_mN:mN"},
    "lattice_probe/probe_states.csv": {"time": "0", "position": "3:mm", "force": "4:g"},
}


def check(found, record):
    """Everything that a reader sees of an answer, held against each other and against the log."""
    position, force = (own[np.isfinite(own)] for own in (record["position"], record["force"]))
    first, table = sentence(found), "\n".join(line.plain for line in lines(found, "log"))
    for name, p in found.parameters.items():
        if p.verdict is Verdict.REJECTED:
            assert (p.value, p.std, p.ci95) == (None,) * 3, name
    assert found.r2 >= 0 or not found.contacts
    point = found.working_point
    if first.startswith(UNTOUCHED):
        assert not found.contacts
        assert UNTOUCHED.removesuffix("in this log") in table
        assert not follows_strokes(record)
    if point is None:
        return
    number = point.stiffness
    K = found.parameters["K"]
    if number.verdict is Verdict.IDENTIFIED and K.unit == number.unit:
        assert full_number(number) in table.partition("\n\n")[0] or full_number(number) in first
        if point.source == "press" and K.verdict is Verdict.IDENTIFIED:
            # A solid that relaxes is stiffer while it is pressed than at rest: by its branch's stiffness at most.
            branch = found.parameters["K1"].ci95[1] if "K1" in found.parameters else 0.0
            assert overlap(number, replace(K, ci95=(K.ci95[0], K.ci95[1] + branch))), (first, table)
    if re.search(r"m deep and ", first):
        assert point.from_surface
        assert 0 < point.depth_m <= 1.01 * np.ptp(position)
    assert abs(point.force_N) <= 1.01 * max(np.ptp(force), np.abs(force).max())
    slopes = [] if found.press is None else found.press.tangent
    below = [t for t in slopes if t.force <= point.force_N]
    above = [t for t in slopes if t.force >= point.force_N]
    if point.source == "press" and number.verdict is Verdict.IDENTIFIED and below and above:
        ends = [t.stiffness + way * t.half for t in (below[-1], above[0]) for way in (-1, 1)]
        assert number.ci95[0] <= max(ends)
        assert number.ci95[1] >= min(ends)


def overlap(own, other):
    return own.ci95[0] <= other.ci95[1] and other.ci95[0] <= own.ci95[1]


def follows_strokes(record):
    """Whether the force of a press at constant speed goes with the position in every stroke."""
    channels = channels_of(record)
    strokes = find_strokes(channels)
    x, f = channels.position, channels.force
    along = [np.corrcoef(x[s.rows(channels)], f[s.rows(channels)])[0, 1] for s in strokes]
    return bool(along) and min(map(abs, along)) > 0.9


@pytest.mark.parametrize(
    "seed", [4, 5, 12, 25, 59, *(pytest.param(s, marks=pytest.mark.long) for s in range(100, 106))]
)
def test_of_a_press_at_constant_speed(seed):
    world = plain_presses.world_of(seed)
    log = world.log(np.random.default_rng(seed))
    found = identify(log, **world.told)
    assert found.contacts
    check(found, log)


@pytest.mark.long
@pytest.mark.parametrize("cell", SLICE, ids=str)
def test_of_any_surface_motion_and_nuisance(cell):
    log = make_log(cell, 77)
    record = record_of(log)
    try:
        found = identify(record, **log.plan.told)
    except InputError:
        return
    check(found, record)


@pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")
@pytest.mark.parametrize(
    "pattern", [pytest.param(p, marks=pytest.mark.long if "press" in p else ()) for p in MEASURED]
)
def test_of_measured_logs(pattern):
    for path in sorted(DATA.glob(pattern)):
        record = read_log(path, **MEASURED[pattern])
        check(identify(record), record)


def test_a_sentence_that_names_another_number_fails():
    """The check itself: a headline beside a K that it contradicts is found."""
    world = plain_presses.world_of(4)
    log = world.log(np.random.default_rng(4))
    found = identify(log, **world.told)
    K = found.parameters["K"]
    other = replace(K, value=2 * K.value, ci95=(2 * K.ci95[0], 2 * K.ci95[1]))
    assert isinstance(found, Identification)
    assert isinstance(K, Parameter)
    with pytest.raises(AssertionError):
        check(replace(found, parameters=found.parameters | {"K": other}), log)
