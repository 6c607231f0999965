"""Results in Python: printed, shown by a notebook, drawn, written, compared; and what `palpate` itself tells."""

import copy
import pickle
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import palpate
from palpate.errors import InputError
from palpate.force import Known, load_arm, tune
from palpate.identification import pool
from palpate.records import same
from palpate.report.identification.words import full_number

HOSTILE = "<script>alert(1)</script>\x1b[31m&\"'"


@pytest.fixture(scope="module")
def record(root):
    log = root / "examples" / "data" / "press.csv"
    return palpate.read_log(log, time="time_s", position="position_mm:mm", force="force_N:N")


@pytest.fixture(scope="module")
def found(record):
    return palpate.identify(record, lag=0.0076, lag_std=0.0002)


@pytest.fixture(scope="module")
def tuned():
    return tune(load_arm("ur5e"), 20.0, Known((1e3, 1e5)), prove_adapting=False)


@pytest.fixture(scope="module")
def pooled(record, found):
    other = palpate.identify(record, lag=0.0076, lag_std=0.0005)
    return pool([found, other, None], names=["left.csv", "right.csv", "broken.csv"])


class Tags(HTMLParser):
    """The tags of a text, and whether they are closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.seen.add(tag)
        if tag != "img":  # it has no end
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_an_identification_is_readable(found):
    text = str(found)
    assert re.match(r"\d+ ± \d+ N/m   stiffness   ✓ identified", text)
    number = full_number(found.K)
    assert re.fullmatch(r"52\d\d ± \d\d N/m", number)
    assert re.search(rf"^K +{number} +✓ identified", text, re.MULTILINE)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= 100
    assert repr(found).startswith(f"<Identification: kelvin-voigt; K {number} identified, B ")
    assert "\n" not in repr(found)


TUNED = pytest.param("tuned", marks=pytest.mark.long)


@pytest.mark.parametrize("name", ["record", "found", "pooled", TUNED])
def test_a_notebook_gets_a_table_and_nothing_that_runs(request, name):
    html = request.getfixturevalue(name)._repr_html_()
    tags = Tags(html)
    assert not tags.open
    assert tags.seen == {"div", "p", "b", "table", "tr", "th", "td", "img"}
    assert html.count('<img src="data:image/svg+xml;base64,') == 1


def test_a_notebook_gets_the_answer_without_its_picture(found):
    html = replace(found, traces=None)._repr_html_()
    assert "identified" in html
    assert "no picture: this identification holds no traces" in html


def test_text_is_whole_in_the_kernel_of_a_notebook(found, monkeypatch):
    """There rich would show each line as an output of its own, and the text would be empty."""
    outside = str(found)
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    assert str(found) == outside


def test_names_of_a_stranger_are_shown_and_do_nothing(found, tmp_path):
    hostile = palpate.Record({HOSTILE: np.arange(3.0)}, {HOSTILE: HOSTILE}, {"source": HOSTILE})
    for text in (hostile._repr_html_(), hostile.report(tmp_path / "r.html").read_text()):
        assert "<script>alert" not in text
        assert "\x1b" not in text
        assert "&lt;script&gt;" in text
    assert "\x1b" not in str(hostile) + repr(hostile)
    hostile.plot(tmp_path / "r.svg")
    assert "<script" not in (tmp_path / "r.svg").read_text()
    reason = replace(found.parameters["K"], reason=HOSTILE)
    told = replace(found, parameters={HOSTILE: reason})
    assert "<script" not in told._repr_html_()
    assert "\x1b" not in str(told)


@pytest.mark.parametrize("name", ["record", "found", "pooled", TUNED])
def test_results_are_drawn_and_written(request, name, tmp_path):
    result = request.getfixturevalue(name)
    figure = result.plot(tmp_path / "it.png")
    assert len(figure.get_axes()) > 0
    assert (tmp_path / "it.png").read_bytes().startswith(b"\x89PNG")
    assert result.report(tmp_path / "it.html") == tmp_path / "it.html"
    page = (tmp_path / "it.html").read_text()
    assert page.lower().startswith("<!doctype html>")
    assert "http://" not in re.sub(r"http://www\.w3\.org\S*", "", page)


def test_what_cannot_be_written_is_one_line(found, record, tmp_path):
    (tmp_path / "mine.html").write_text("mine")
    with pytest.raises(InputError, match="palpate did not write it"):
        found.report(tmp_path / "mine.html")
    with pytest.raises(InputError, match="HTML file"):
        record.report(tmp_path / "it.pdf")
    with pytest.raises(InputError, match="a figure ends in"):
        record.plot(tmp_path / "it.bmp")
    bare = palpate.Record({"time": np.arange(3.0)}, {"time": "s"})
    with pytest.raises(InputError, match="nothing to draw"):
        bare.plot()
    with pytest.raises(InputError, match="palpate did not write it"):  # before anything is drawn
        bare.plot(tmp_path / "mine.html")
    with pytest.raises(InputError, match="no traces"):
        replace(found, traces=None).plot()


def test_equal_is_by_value(record, found):
    assert record == copy.deepcopy(record)
    assert found == copy.deepcopy(found)
    assert found == pickle.loads(pickle.dumps(found))
    assert found == palpate.identify(record, lag=0.0076, lag_std=0.0002)
    assert found != palpate.identify(record, lag=0.0)
    assert found.traces == copy.deepcopy(found.traces)
    assert found.press == copy.deepcopy(found.press)
    changed = {name: column.copy() for name, column in record.columns.items()}
    changed["force"][7] += 1e-12
    assert record != replace(record, columns=changed)
    assert record != replace(record, units={**record.units, "force": "1"})
    assert record != 3
    with pytest.raises(TypeError):
        hash(record)


def test_no_number_equals_no_number():
    gap = palpate.Record(
        {"x": np.array([1.0, np.nan])}, {"x": "m"}, {"gain": float("nan"), "list": [1, (2.0,)]}
    )
    assert gap == copy.deepcopy(gap)
    assert not same([1, 2], [1, 2, 3])
    assert not same({"a": 1}, {"b": 1})
    assert not same(np.zeros(2), [0.0, 0.0])
    assert not same(float("nan"), 1.0)


def test_help_tells_the_rooms_and_the_first_lines(root, tmp_path, monkeypatch, capsys):
    told = palpate.__doc__
    first = [line.strip() for line in told.split("The first three lines:")[1].splitlines() if line.strip()][
        :3
    ]
    assert first[0] == "import palpate"
    (tmp_path / "press.csv").write_bytes((root / "examples" / "data" / "press.csv").read_bytes())
    monkeypatch.chdir(tmp_path)
    exec("\n".join(first), {})
    assert re.fullmatch(r"<Parameter: 52\d\d ± \d\d N/m, identified>\n", capsys.readouterr().out)
    rooms = re.findall(r"^    ([a-z_]+)  +\S", told, re.MULTILINE)
    package = root / "src" / "palpate"
    assert sorted(rooms) == [name for name in dir(palpate) if name not in palpate.__all__ and name[0] != "_"]
    assert all((package / name).is_dir() or (package / f"{name}.py").is_file() for name in rooms)


def test_an_unknown_name_is_told():
    with pytest.raises(AttributeError, match="it has"):
        palpate.identfy  # noqa: B018
