"""The page of an identification: whole, true to the numbers, and readable without a network."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from palpate.errors import InputError
from palpate.files import check_place
from palpate.identification.warning_codes import Code, Warn
from palpate.report.identification_page import page, write_page
from palpate.report.identification_words import ADVICE, headline
from report.outcomes import OUTCOMES

VOID = {"meta", "br", "img", "hr", "link", "input"}
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


@pytest.fixture(scope="module", params=OUTCOMES)
def found(request):
    return OUTCOMES[request.param]()


@pytest.fixture(scope="module")
def html(found):
    return page(found, "press <1> & more.csv")


@pytest.fixture(scope="module")
def read(html):
    return Reader(html)


def pictures(read):
    for image in read.of("img"):
        kind, data = image["src"].split(";base64,")
        assert kind == "data:image/svg+xml"
        yield base64.b64decode(data).decode()


def test_every_outcome_has_its_verdicts_and_reasons(found, read):
    for name, p in found.parameters.items():
        assert name in read.text
        assert str(p.verdict) in read.text
        assert " ".join(p.reason.split()) in read.text
    assert "press <1> & more.csv" in read.text, "escaped, and read back"


def test_the_numbers_are_those_of_the_json(found, html, read):
    values = [p.value for p in found.parameters.values() if p.value is not None]
    assert [float(data["value"]) for data in read.of("data")] == values
    shown = re.search(r"<pre>(\{.*\})</pre>", html, re.DOTALL).group(1)
    assert json.loads(shown.replace("&#34;", '"').replace("&gt;", ">").replace("&lt;", "<").replace(
        "&#39;", "'").replace("&amp;", "&")) == json.loads(json.dumps(found.to_json()))  # fmt: skip


def test_what_has_no_number_shows_none(found, html):
    without = [p for p in found.parameters.values() if p.value is None]
    assert html.count('<p class="number">no number</p>') == len(without)
    assert html.count('<p class="number">') == len(found.parameters)


def test_every_warning_says_what_to_do(found, read):
    assert read.text.count("What to do:") == len(found.warnings)
    for warn in found.warnings:
        assert warn.code.word in read.text
        assert ADVICE[warn.code] in read.text


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
    for drawing in read.of("svg"):
        assert drawing["role"] == "img"
        assert "95 % interval" in drawing["aria-label"]


def test_the_pictures_are_whole_and_have_a_dark_side(found, read):
    drawn = list(pictures(read))
    assert len(drawn) == (1 if not found.n else 6)
    for drawing in drawn:
        ElementTree.fromstring(drawing)
        assert "prefers-color-scheme:dark" in drawing
        for name in set(re.findall(r"var\((--c\d+)\)", drawing)):
            assert len(re.findall(rf"{name}:#", drawing)) == 2, "a colour by light and one by dark"
        assert "#222222" not in drawing.replace("--c0:#222222", ""), "ink is turned everywhere"


def test_the_models_and_contacts_are_listed(found, read):
    for comparison in found.comparison:
        assert f"{comparison.rmse:.3g}" in read.text
    assert read.text.count("(chosen)") == (1 if found.comparison else 0)
    more = len(found.contacts) - 20
    assert (f"and {more} more" in read.text) == (more > 0)


def test_the_same_identification_gives_the_same_page():
    found = OUTCOMES["not_identifiable"]()
    assert page(found, "log") == page(found, "log")


@pytest.mark.parametrize(
    ("outcome", "told"),
    [
        ("identified", "Stiffness, damping and mass are identified."),
        ("not_identifiable", "Stiffness and damping are identified; mass is not identifiable."),
        ("rejected", "No model describes this log."),
        ("no_contact", "Nothing is touched in this log."),
    ],
)
def test_the_first_line_tells_the_outcome(outcome, told):
    assert told in headline(OUTCOMES[outcome]())


def test_without_a_unit_none_is_shown():
    text = Reader(page(OUTCOMES["volts"](), "log")).text
    for unit in ("[N]", "N/m", "kg", "[mm]"):
        assert unit not in text


def test_there_is_advice_for_every_warning():
    assert set(ADVICE) == set(Code)


def test_an_identification_without_traces_has_a_page_without_pictures():
    bare = replace(OUTCOMES["no_contact"](), traces=None)
    assert not Reader(page(bare, "log")).of("img")


def test_how_the_log_was_read_stands_at_the_top(tmp_path):
    path = write_page(
        OUTCOMES["no_contact"](), tmp_path / "a.html", "log", notes=("normal: <x>", "tool: 1 kg")
    )
    text = Reader(path.read_text(encoding="utf-8")).text
    assert "normal: <x> tool: 1 kg" in text


def test_a_page_may_replace_an_older_one_and_nothing_else(tmp_path):
    path = write_page(OUTCOMES["no_contact"](), tmp_path / "a.html", "log")
    check_place(path, "--report")
    other = tmp_path / "b.html"
    other.write_text("<!doctype html><title>palpate identify, a diary</title>", encoding="utf-8")
    for taken in (other, tmp_path):
        with pytest.raises(InputError, match="--report"):
            check_place(taken, "--report")


def test_a_page_that_fails_leaves_the_old_one(tmp_path):
    found = OUTCOMES["no_contact"]()
    path = write_page(found, tmp_path / "press.html", "press.csv")
    before = path.read_bytes()
    assert before.decode() == page(found, "press.csv")
    broken = replace(found, warnings=(Warn("no code", "no text"),))
    with pytest.raises(AttributeError):
        write_page(broken, path, "press.csv")
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
