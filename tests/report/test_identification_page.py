"""The page of an identification: whole, true to the numbers, and readable without a network."""

import base64
import json
import re
from dataclasses import replace
from functools import cache
from html import unescape
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from palpate.errors import InputError
from palpate.files import check_place, write_text
from palpate.identification.causes import Code
from palpate.report import style
from palpate.report.identification.page import page
from palpate.report.identification.words import ADVICE, Source, as_json, interval, sentence
from palpate.report.page import advice
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
NAMESPACES = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}  # names, not fetched


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


def pictures(read):
    for image in read.of("img"):
        yield decoded(image["src"])
    for source in read.of("source"):
        yield decoded(source["srcset"])


def decoded(address):
    kind, data = address.split(";base64,")
    assert kind == "data:image/svg+xml"
    return base64.b64decode(data).decode()


def test_every_outcome_has_its_verdicts_and_reasons(found, read):
    for name, p in found.parameters.items():
        assert name in read.text
        assert str(p.verdict) in read.text
        assert " ".join(p.reason.split()) in read.text
    assert "press <1> & more" in read.text, "escaped, and read back"


def test_the_first_screen_answers(found, read):
    """Name, sentence and working point stand before everything else."""
    told = " ".join(sentence(found).split())
    assert told in read.text
    for later in ("What limits it:", "Dynamic stiffness", "The model's parameters", "Models compared"):
        if later in read.text:
            assert read.text.index(told) < read.text.index(later)
    if found.contacts:
        assert read.text.index("Dynamic stiffness") < read.text.index("The model's parameters")


def test_the_numbers_are_those_of_the_json(found, html, read):
    point = found.working_point
    values = [p.value for p in found.parameters.values() if p.value is not None]
    if point is not None and point.stiffness.value is not None:
        values.insert(0, point.stiffness.value)
    assert [float(data["value"]) for data in read.of("data")] == values
    shown = re.search(r"<pre>(\{.*\})</pre>", html, re.DOTALL).group(1)
    assert json.loads(unescape(shown)) == json.loads(json.dumps(as_json(found, SOURCE)))


def test_what_has_no_number_shows_none(found, html):
    point = [found.working_point.stiffness] if found.working_point else []
    own = [*found.parameters.values(), *point]
    assert html.count(">no number</p>") == sum(p.value is None for p in own)


def test_both_intervals_and_the_budget_stand_with_each_parameter(found, read):
    for p in found.parameters.values():
        if p.ci95_if_model_holds is not None and p.value is not None:
            assert interval(p.ci95_if_model_holds, p.unit) in read.text
        for cause in p.budget:
            assert cause in read.text


def test_the_footer_says_how_to_make_it_again(read):
    for part in ("0" * 64, "palpate identify 'press <1>.csv'", "2026-01-02T03:04:05+00:00", "position x"):
        assert part in read.text


def test_nothing_of_a_log_escapes_into_the_page(html, read):
    """Names, notes, options and the command hold a script; the page holds none, and would run none."""
    assert "<script" not in html
    assert not read.of("script")
    assert all(not name.startswith("on") for _, attrs in read.elements for name in attrs)
    policy = next(attrs["content"] for attrs in read.of("meta") if "http-equiv" in attrs)
    assert "default-src 'none'" in policy


def test_controls_of_a_name_are_shown_as_text():
    text = page(OUTCOMES["no_contact"](), Source("a\x1b[31m\u202e$x_{1.csv"))
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert "$x_{1" in text


def test_every_warning_says_what_to_do(found, read):
    assert read.text.count("What to do:") == len(found.warnings)
    for warn in found.warnings:
        assert warn.code.word in read.text
        assert ADVICE[warn.code] in re.sub(r"\s*\(option of\s+palpate identify\s*\)", "", read.text)


def test_an_option_on_a_page_names_its_command_once_a_sentence():
    text = advice("give --lag, <b> or --mass KG")
    assert text == (
        "give <code>--lag</code> (option of <code>palpate identify</code>), &lt;b&gt; or <code>--mass KG</code>"
    )
    assert advice("palpate identify LOG --lag S") == "palpate identify LOG <code>--lag S</code>"
    assert advice("press more often") == "press more often"


def test_nothing_is_fetched(html, read):
    assert "http:" not in html
    assert "https:" not in html
    assert not [tag for tag, _ in read.elements if tag in {"script", "link", "iframe"}]
    for drawing in pictures(read):
        assert set(re.findall(r'"(http[^"]*)"', drawing)) <= NAMESPACES
        assert drawing.count("http") == len(re.findall(r'"http', drawing))
        assert not re.findall(r'href="(?!#|data:)', drawing)
        assert not re.findall(r"url\((?!#)", drawing)


def test_it_is_read_aloud_too(read):
    """Pictures tell in words what they show, and headers of tables say what they head."""
    assert dict(read.elements)["html"] == {"lang": "en"}
    for image in read.of("img"):
        assert len(image["alt"]) > 40
    for head in read.of("th"):
        assert head["scope"] in {"col", "row"}
    for bar in (attrs for attrs in read.of("div") if attrs.get("class") == "bar"):
        assert "95 % interval" in bar["aria-label"]


def test_the_pictures_are_whole_and_have_a_dark_side_and_a_narrow_one(found, read):
    drawings = list(pictures(read))
    assert len(drawings) == 2 * (1 if not found.n else 5)
    for drawing in drawings:
        ElementTree.fromstring(drawing)
        assert "prefers-color-scheme:dark" in drawing
        for name in set(re.findall(r"var\((--c\d+)\)", drawing)):
            assert len(re.findall(rf"{name}:#", drawing)) == 2, "a colour by light and one by dark"
        assert style.INK not in drawing.replace(f"--c0:{style.INK}", ""), "ink is turned everywhere"


def test_the_models_and_contacts_are_listed(found, read):
    for comparison in found.comparison:
        assert f"{comparison.rmse:.3g}" in read.text
    assert read.text.count("(chosen)") == (1 if found.comparison else 0)
    more = len(found.contacts) - 20
    assert (f"and {more} more" in read.text) == (more > 0)


@pytest.mark.long
def test_the_same_identification_gives_the_same_page():
    found, once = drawn("not_identifiable")
    assert page(found, SOURCE) == once


def test_without_a_unit_none_is_shown():
    text = Reader(drawn("volts")[1]).text
    for unit in ("[N]", "N/m", " kg", "[mm]"):
        assert unit not in text.split("The same as JSON")[0]


def test_there_is_advice_for_every_warning():
    assert set(ADVICE) == set(Code)


def test_an_identification_without_traces_has_a_page_without_pictures():
    bare = replace(OUTCOMES["no_contact"](), traces=None)
    assert not Reader(page(bare, SOURCE)).of("img")


def test_how_the_log_was_read_is_told():
    source = Source("log", notes=("normal: <x>", "tool: 1 kg"))
    text = Reader(page(OUTCOMES["no_contact"](), source)).text
    assert "normal: <x> tool: 1 kg" in text


def test_a_page_may_replace_an_older_one_and_nothing_else(tmp_path):
    path = tmp_path / "a.html"
    write_text(path, page(OUTCOMES["no_contact"](), SOURCE))
    check_place(path, "--report")
    other = tmp_path / "b.html"
    other.write_text("<!doctype html><title>palpate identify, a diary</title>", encoding="utf-8")
    for taken in (other, tmp_path):
        with pytest.raises(InputError, match="--report"):
            check_place(taken, "--report")
