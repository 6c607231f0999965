"""Many identifications on paper: rows, the forest plot, the page and the terminal."""

import json
import re
from html import unescape

import numpy as np
import pytest

from palpate.identification.pooling import pool
from palpate.identification.result import Identification, Traces, WorkingPoint
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification.words import Source
from palpate.report.many.page import draw_logs as draw
from palpate.report.many.page import page_of_logs as page
from palpate.report.many.table import LogRow, failures, pooled_json, sentence
from report.test_identification_page import Reader

NONE = np.empty(0)
NASTY = "a<script>$x_{1 \x1b[31m.csv"


def row(name, stiffness, half=40.0):
    own = Parameter(
        stiffness, half / 1.96, (stiffness - half, stiffness + half), "N/m", Verdict.IDENTIFIED, "so"
    )
    point = WorkingPoint(own, 10.0 + stiffness / 1000, 2e-3, 1.5, "octave")
    traces = Traces(NONE, NONE, NONE, NONE, NONE, NONE)
    found = Identification(
        "kelvin-voigt", {"K": own}, ((0.0, 1.0),), None, 0.99, 0.1, 9, (), traces=traces, working_point=point
    )
    return LogRow(Source(name, {"time": "t"}, "f" * 64, f"palpate identify {NASTY}"), found)


@pytest.fixture
def rows():
    failed = LogRow(Source(NASTY), None, "there is no file <b>; check the path")
    return [row(f"press_{i}.csv", k) for i, k in enumerate((5000.0, 5300.0, 4800.0, 5100.0))] + [failed]


@pytest.fixture
def pooled(rows):
    return pool([own.result for own in rows])


def test_the_sentence_holds_mean_next_press_place_and_cause(rows, pooled):
    own = pooled.working_point.stiffness
    text = sentence(rows, pooled)
    assert text.startswith("Over 4 of 5 logs the stiffness is 50")
    for part in (
        "the next press is predicted at",
        "14.8 N to 15.3 N",
        "2 mm deep",
        "1.5 Hz",
        "its uncertainty is mostly due to",
    ):
        assert part in text
    assert own.prediction95[0] < own.parameter.ci95[0]
    assert failures(rows) == "1 of 5 logs could not be identified; their rows say why."


def test_without_a_number_it_says_so():
    none = [LogRow(Source("a.csv"), None, "no")]
    assert "None of 1 logs" in sentence(none, pool([None]))


def test_the_json_has_a_row_each_and_what_is_pooled(rows, pooled):
    own = json.loads(json.dumps(pooled_json(rows, pooled), allow_nan=False))
    assert [log["file"] for log in own["logs"]] == [r.source.file for r in rows]
    assert own["logs"][-1]["error"].startswith("there is no file")
    assert own["logs"][0]["parameters"]["K"]["value"] == 5000
    assert own["pooled"]["parameters"]["K"]["logs"] == [0, 1, 2, 3]
    assert own["pooled"]["working_point"]["stiffness"]["prediction95"]


def test_the_page_shows_each_log_and_the_mean(rows, pooled):
    html = page(rows, pooled)
    read = Reader(html)
    assert sentence(rows, pooled) in read.text
    for r in rows[:-1]:
        assert r.source.title in read.text
    assert "there is no file <b>; check the path" in read.text
    assert len(read.of("img")) == 1
    assert "a<script" not in html
    assert html.count("<script") == 1, "the page's own, which sorts its table"
    assert "\x1b" not in html
    shown = re.search(r"<pre>(\{.*\})</pre>", html, re.DOTALL).group(1)
    assert json.loads(unescape(shown)) == json.loads(json.dumps(pooled_json(rows, pooled)))


def test_the_forest_has_a_row_a_log_and_the_pooled_one(rows, pooled):
    figure = draw(rows, pooled)
    figure.canvas.draw()
    axis = figure.axes[0]
    names = [label.get_text() for label in axis.get_yticklabels()]
    assert names[0] == "pooled"
    assert names[::-1][:4] == [f"press_{i}.csv" for i in range(4)]
    points = [float(line.get_xdata()[0]) for line in axis.lines if line.get_marker() == "o"]
    assert points == [5000, 5300, 4800, 5100]
    diamond = axis.patches[-1].get_xy()
    low, high = pooled.working_point.stiffness.parameter.ci95
    assert (diamond[:, 0].min(), diamond[:, 0].max()) == pytest.approx((low, high))
