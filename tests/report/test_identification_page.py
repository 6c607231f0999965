"""The page of an identification: whole, true to the numbers, and readable without a network."""

import json
import re
from functools import cache
from html import unescape
from html.parser import HTMLParser

import pytest

from palpate.identification.causes import Code
from palpate.report.identification.charts import build_charts
from palpate.report.identification.page import page
from palpate.report.identification.words import ADVICE, Source, as_json, full_number, sentence
from report.outcomes import OUTCOMES

NASTY = "<script>alert(1)</script>"
SOURCE = Source(
    f"logs/press <1> & more{NASTY[1:]}.csv".replace("/script", "script"),
    {"position": f"x{NASTY}:mm"},
    "0" * 64,
    f"palpate identify 'press <1>.csv' {NASTY}",
    "2026-01-02T03:04:05+00:00",
    (f"normal: {NASTY}",),
)
VOID = {"source", "meta", "br", "img", "hr", "link", "input"}


class Reader(HTMLParser):
    """Checks that every element is closed in its turn, and keeps what is looked at."""

    def __init__(self, text):
        super().__init__()
        self.open, self.elements, self.words = [], [], []
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> out of its turn"

    def handle_data(self, data):
        if self.open and self.open[-1] not in {"style", "script"}:
            self.words.append(data)

    def of(self, tag):
        return [attrs for name, attrs in self.elements if name == tag]

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


@cache
def drawn(outcome):
    """An outcome and its page, which takes a second."""
    found = OUTCOMES[outcome]()
    return found, page(found, SOURCE)


OFTEN = ("identified", "no_contact")


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=() if name in OFTEN else pytest.mark.long) for name in OUTCOMES],
)
def outcome(request):
    return drawn(request.param)


@pytest.fixture(scope="module")
def found(outcome):
    return outcome[0]


@pytest.fixture(scope="module")
def html(outcome):
    return outcome[1]


@pytest.fixture(scope="module")
def read(html):
    return Reader(html)


def test_every_outcome_has_its_verdicts_and_reasons(found, read):
    for name, p in found.parameters.items():
        assert name in read.text
        assert str(p.verdict) in read.text
        assert " ".join(p.reason.split()) in read.text
    assert "press <1> & more" in read.text, "escaped, and read back"


def panels_of(html):
    """The charts of the page by their titles."""
    match = re.search(r'<script type="application/json" id="panels">(.*?)</script>', html, re.DOTALL)
    figures = json.loads(match[1]) if match else {}
    return {panel["spec"]["title"]: panel for panels in figures.values() for panel in panels}


def test_the_answer_stands_first(found, read):
    said = " ".join(sentence(found).split())
    assert said in read.text
    for later in ("Parameters", "Models compared", "The same as JSON"):
        if later in read.text:
            assert read.text.index(said) < read.text.index(later)


def test_the_numbers_are_those_of_the_json(found, html, read):
    point = found.working_point
    stiffness = [] if point is None else [point.stiffness]
    for p in (*stiffness, *found.parameters.values()):
        assert full_number(p) in read.text
    shown = re.search(r"<pre>(\{.*\})</pre>", html, re.DOTALL).group(1)
    assert json.loads(unescape(shown)) == json.loads(json.dumps(as_json(found, SOURCE)))


def test_what_has_no_number_shows_none(found, html):
    point = [found.working_point.stiffness] if found.working_point else []
    count = sum(p.value is None for p in (*found.parameters.values(), *point))
    assert len(re.findall(r"<td[^>]*>no number", html)) == count


def test_the_footer_says_how_to_make_it_again(read):
    for part in ("0" * 64, "palpate identify 'press <1>.csv'", "2026-01-02T03:04:05+00:00", "position x"):
        assert part in read.text


def test_nothing_of_a_log_escapes_into_the_page(html, read):
    """Names, notes, options and the command hold a script; the page runs none of them."""
    assert "<script>alert" not in html
    assert all(not name.startswith("on") for _, attrs in read.elements for name in attrs)
    policy = next(attrs["content"] for attrs in read.of("meta") if "http-equiv" in attrs)
    assert "default-src 'none'" in policy
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", html, re.DOTALL)
    assert not [code for code in scripts if "alert(1)" in code and not code.startswith("{")]


def test_controls_of_a_name_are_shown_as_text():
    text = page(OUTCOMES["no_contact"](), Source("a\x1b[31m\u202e$x_{1.csv"))
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert "$x_{1" in text


def test_every_warning_says_what_to_do(found, read):
    for warn in found.warnings:
        assert warn.code.word in read.text
        assert ADVICE[warn.code] in read.text


def test_nothing_is_fetched(html, read):
    bare = re.sub(r"<script>.*?</script>|<style>.*?</style>", "", html, flags=re.DOTALL)
    assert "http:" not in bare
    assert "https:" not in bare
    assert not [tag for tag, attrs in read.elements if tag in {"link", "iframe"} or "src" in attrs]


def test_it_is_read_aloud_too(read):
    """Headers of tables say what they head."""
    assert dict(read.elements)["html"] == {"lang": "en"}
    for head in read.of("th"):
        assert head["scope"] in {"col", "row"}


def test_the_charts_are_those_of_the_figure(found, html):
    charts = build_charts(found, found.traces)
    panels = panels_of(html)
    assert list(panels) == [chart.title for chart in charts]
    for chart in charts:
        spec = panels[chart.title]["spec"]
        labels = [one["label"] for one in spec["series"] if one["label"]]
        assert set(labels) >= {series.label for series in chart.series if series.label}


@pytest.mark.long
def test_the_same_identification_gives_the_same_page():
    found, once = drawn("not_identifiable")
    assert page(found, SOURCE) == once


def test_there_is_advice_for_every_warning():
    assert set(ADVICE) == set(Code)


def test_how_the_log_was_read_is_told():
    source = Source("log", notes=("normal: <x>", "tool: 1 kg"))
    text = Reader(page(OUTCOMES["no_contact"](), source)).text
    assert "normal: <x>. tool: 1 kg." in text
