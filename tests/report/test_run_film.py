"""The film of a run: an SVG that moves by itself, and needs nothing else."""

import re

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build
from palpate.records import Record
from palpate.report.film import FRAMES, frames_of
from palpate.report.run.page import BEFORE, film


@pytest.fixture(scope="module")
def record():
    return build(quick("foam-hybrid")).run(1.5, press=0.3)


def test_the_arm_s_tip_ends_where_the_record_says(record):
    picture = film(record)
    points = re.search(r'attributeName="points"[^>]*values="([^"]*)"/></polyline>', picture)[1].split(";")
    assert len(points) == FRAMES
    x = [float(frame.split()[-1].split(",")[0]) for frame in points]
    moved = record["x"][-1] - record["x"][frames_of(record, BEFORE)[0]]
    scale = 0.9 * min(600.0 / 0.62, 270.0 / 0.27)  # of the arm's panel over the extent of the picture
    assert x[-1] - x[0] == pytest.approx(scale * moved, abs=0.2)
    assert "http" not in picture.replace("http://www.w3.org/2000/svg", "")


def test_a_film_begins_a_second_before_contact():
    t = np.arange(0.0, 120.0, 0.01)
    long = Record({"t": t, "phase": np.where(t > 5.0, 1.0, 0.0)}, {"t": "s", "phase": "1"})
    rows = frames_of(long, BEFORE)
    assert len(rows) == FRAMES
    assert t[rows[0]] == pytest.approx(4.0, abs=0.02)
