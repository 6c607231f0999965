"""Figures of the documents: each between its marks, from a command, and of today's sources."""

import re
import sys
from pathlib import Path

import pytest
from msgspec import structs

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import figures  # noqa: E402 -- beside the scripts that it runs

FIGURES = figures.figures()
PAGES = sorted(path.relative_to(ROOT).as_posix() for path in [ROOT / "README.md", *ROOT.glob("docs/*.md")])
OWN_MARKS = {"docs/reliability.md"}
"""Pages of campaigns that put their own result there, with its day: no digest tells when an attack is of the past."""
UNMARKED: dict[str, int] = {}
"""Tables with measured numbers outside of marks, by page: copied by hand from what a command printed. They may only
become fewer."""


def test_a_mark_is_of_a_figure_that_a_command_makes():
    for page in PAGES:
        text = (ROOT / page).read_text(encoding="utf-8")
        for name in re.findall(r"<!-- figure (\S+): begin -->", text):
            assert name in FIGURES, f"{page}: {name} is not in benchmarks/figures.toml"
            assert FIGURES[name].page == page


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_kept_with_its_small_run(name):
    """`make figures-fast` compares what the small run prints today with what it printed when the figure was made."""
    figure = FIGURES[name]
    assert (ROOT / figure.script).is_file()
    assert all((ROOT / source).exists() for source in figure.sources), figure.sources
    assert not figure.page or figures.text_of(figure), (
        f"nothing but its command stands in {name}: python benchmarks/figures.py --only {name}"
    )
    assert figures.kept(figure), f"the small run of {name} has never been kept"


@pytest.mark.parametrize("page", PAGES)
def test_a_number_of_a_sentence_is_in_the_figure_that_the_sentence_is_from(page):
    """A paragraph under `<!-- from NAME ... -->` has no number but of those figures or of their commands."""
    for names, paragraph in re.findall(
        r"<!-- from ([\w -]+?) -->\n(.+?)(?:\n\n|\Z)", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL
    ):
        known = " ".join(
            re.sub(r"sources \w+, [\d-]+", "", figures.body_of(FIGURES[name])) for name in names.split()
        )
        strange = [text for text in numbers(paragraph) if not stands_in(text, known)]
        assert not strange, f"{page}: {', '.join(strange)} is not in {names}: {paragraph[:60]}"


def numbers(paragraph):
    """Numbers of a sentence, without code, the targets of links, powers and names such as p95."""
    text = re.sub(r"`[^`]*`|\]\([^)]*\)", " ", paragraph)
    return [
        found.replace(" ", "")
        for found in re.findall(r"(?<![\w.^*-])\d+(?: \d{3})*(?:\.\d+)?(?![\w.]*[a-z]\w*\d)", text)
    ]


def stands_in(text, known):
    """Whether a number, rounded as it is written, is among those of a text."""
    digits = len(text.partition(".")[2])
    return any(f"{float(own):.{digits}f}" == text for own in re.findall(r"\d+(?:\.\d+)?", known))


def test_a_sentence_with_a_number_that_its_figure_has_not_is_found():
    sentence = "Of 1 000 presses p95 is 0.23 s, 5.3 % over ([`f 9`](page.md#a-7)), on the UR5e and p^1.5."
    assert numbers(sentence) == ["1000", "0.23", "5.3"]
    known = "presses 1000  0.228  over 5.2 %"
    assert [stands_in(text, known) for text in numbers(sentence)] == [True, True, False]


@pytest.mark.parametrize("page", PAGES)
def test_blank_lines_surround_a_table(page):
    """Without them a page of the site shows it as a paragraph."""
    text = re.sub(r"(?ms)^```.*?^```$", "```", (ROOT / page).read_text(encoding="utf-8"))
    assert not re.findall(r"(?m)^(?!\||$).+\n\|.*|^\|.*\n(?!\||$).+", text)


@pytest.mark.parametrize("page", PAGES)
def test_no_table_more_is_copied_by_hand(page):
    found = len(copied(ROOT / page))
    assert found <= UNMARKED.get(page, 0), f"{page}: put it between marks (benchmarks/figures.toml)"


def copied(page):
    """Tables outside of marks most of whose cells are numbers with a point or a unit: measured, not settings."""
    text = re.sub(
        r"<!-- figure (\S+): begin -->.*?<!-- figure \1: end -->",
        "",
        page.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    if page.relative_to(ROOT).as_posix() in OWN_MARKS:
        text = re.sub(r"<!-- ([\w, ]+): begin -->.*?<!-- \1: end -->", "", text, flags=re.DOTALL)
    tables = re.findall(r"^\|.*(?:\n\|.*)+", text, flags=re.MULTILINE)
    return [table for table in tables if is_measured(table)]


def is_measured(table):
    """Whether half of a table's cells beside its first column are numbers with decimals, a share or a unit."""
    rows = [row.strip("|").split("|")[1:] for row in table.splitlines()[2:]]
    cells = [cell.strip() for row in rows for cell in row if cell.strip()]
    numbers = [
        cell
        for cell in cells
        if re.match(r"[-+<*~]*\d[\d ,]*(\.\d+)?", cell)
        and re.search(r"\d\.\d|%|\d ?(ms|us|ns|s|N|x|times)\b|;", cell)
    ]
    return len(numbers) >= 0.5 * max(len(cells), 1)


def test_what_is_measured_is_told_from_what_is_set():
    assert is_measured("| a | b |\n|---|---|\n| one | 0.23 s |\n| two | 5 % |")
    assert not is_measured("| key | what |\n|---|---|\n| rate | of the loop, 500 Hz |\n| force | desired |")


def test_comments_and_docstrings_change_no_digest(tmp_path):
    texts = ('"""One."""\nx = 1\n', '"""Two."""\n# a word\nx = (1)\n', "x = 2\n")
    contents = []
    for k, text in enumerate(texts):
        path = tmp_path / f"{k}.py"
        path.write_text(text)
        contents.append(figures.content(path))
    assert contents[0] == contents[1] != contents[2]


def test_a_stale_figure_is_known(monkeypatch, tmp_path):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    (tmp_path / "law.py").write_text("x = 1\n")
    (tmp_path / "script.py").write_text("print('| a | 1.0 |')\n")
    (tmp_path / "page.md").write_text("before\n<!-- figure f: begin --><!-- figure f: end -->\nafter\n")
    figure = figures.Figure("f", "page.md", "script.py", "", ("law.py",))
    figures.put(figure, figures.output(figure.command))
    text = (tmp_path / "page.md").read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "| a | 1.0 |\n\n`python script.py`, palpate " in text
    assert figures.is_fresh(figure)
    figures.put(figure, "")
    assert not figures.text_of(figure)
    assert not figures.is_fresh(figure)
    figures.put(figure, "| a | 1.0 |")
    assert figures.is_fresh(figure)
    (tmp_path / "law.py").write_text("x = 2\n")
    assert not figures.is_fresh(figure)


def test_a_script_that_fails_is_named_with_its_last_line(monkeypatch, tmp_path):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    (tmp_path / "script.py").write_text("raise SystemExit('no arm')\n")
    with pytest.raises(RuntimeError, match=r"script\.py.*exit code 1: no arm"):
        figures.output("script.py")
    (tmp_path / "script.py").write_text("")
    with pytest.raises(RuntimeError, match=r"script\.py.*printed nothing"):
        figures.output("script.py")


def test_a_figure_is_not_made_where_a_program_is_lacking(monkeypatch):
    needy = structs.replace(next(iter(FIGURES.values())), needs=("sh", "no-such-compiler"))
    monkeypatch.setattr(figures, "smoke", lambda figure: pytest.fail("it was run"))
    with pytest.raises(RuntimeError, match="needs no-such-compiler"):
        figures.renew(needy, forced=True)


def test_a_script_without_a_page_keeps_its_small_run_alone(monkeypatch, tmp_path):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "SMOKES", tmp_path / "smokes")
    (tmp_path / "script.py").write_text("import sys\nprint(sys.argv[1])\n")
    figure = figures.Figure("f", "", "script.py whole", "small")
    assert figures.renew(figure, forced=False) == "made"
    assert figures.kept(figure) == "small"
    assert not figures.difference(figure)
    (tmp_path / "script.py").write_text("print('another')\n")
    assert "+another" in figures.difference(figure)
    needy = structs.replace(figure, needs=("no-such-log.csv",))
    assert not figures.difference(needy)
