"""The page of the thesis as a reader opens it: by light and by dark, on a wide screen and on a telephone's."""

import numpy as np
import pytest

from opened_pages import open_page
from palpate.cli import main
from palpate.report import style
from palpate_thesis.claims import Done
from palpate_thesis.drawn_panels import panels_of
from palpate_thesis.measure import index_page


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    """The page of one figure."""
    folder = tmp_path_factory.mktemp("pages") / "thesis"
    assert main(["thesis", "3.7", "--out", str(folder)]) == 0
    return folder / "index.html"


@pytest.mark.parametrize(
    ("width", "scheme"), [(400, "dark"), pytest.param(1400, "light", marks=pytest.mark.long)]
)
def test_it_opens_alone_and_is_no_wider_than_the_screen(browser, index, width, scheme):
    with open_page(browser, index, viewport={"width": width, "height": 860}, color_scheme=scheme) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert [url for url in page.asked if not url.startswith(("file:", "data:"))] == []
        assert page.wrong == []


def test_claims_of_one_verdict_are_shown(browser, index):
    with open_page(browser, index) as page:
        every = page.locator(".claim").count()
        page.click("#filter button[value=differs]")
        left = page.locator(".claim:visible").count()
        assert 0 < left < every
        assert page.locator("#shown").text_content() == f"{left} of {every} shown"
        page.fill("#word", "no claim has this")
        assert page.locator(".claim:visible").count() == 0
        assert page.locator("nav .line:visible").count() == 0
        page.fill("#word", "")
        page.click("#filter button[value='']")
        assert page.locator(".claim:visible").count() == every


COVERED = """() => {
    const box = (one) => one.getBoundingClientRect();
    const meets = (a, b) => a.right > b.left && b.right > a.left && a.bottom > b.top && b.bottom > a.top;
    return [...document.querySelectorAll(".chart")].filter((chart) => {
        const list = chart.querySelector(".legend"), button = box(chart.querySelector("header button"));
        return [...list.children].some((entry) => meets(box(entry), button));
    }).length;
}"""
"""Charts whose button for the whole range covers an entry of the legend."""


def test_lines_of_a_figure_are_zoomed_together_and_told(browser, tmp_path):
    t = np.linspace(0.0, 10.0, 5000)
    with style.ink():
        figure, (above, below) = style.figure(rows=2)
        above.plot(t, 20.0 + np.sin(t), color=style.F, label="true")
        for k in range(12):
            above.plot(t, 20.0 + np.sin(t + k), label=f"of trial {k}")
        below.plot(t, np.cos(t), label="angle")
        below.set_xlabel("time [s]")
    path = tmp_path / "index.html"
    done = [Done("6.11", "A title", "What is seen.", [], 1.0)]
    path.write_text(
        index_page(done, {"6.11": panels_of(figure)}, [], "palpate thesis 6.11"), encoding="utf-8"
    )
    with open_page(browser, path, viewport={"width": 1400, "height": 900}) as page:
        plots = page.locator(".panels .plot")
        plots.nth(1).scroll_into_view_if_needed()
        plots.first.hover()
        assert (
            page.locator(".read").all_text_contents()[1].startswith(("4", "5"))
        )  # the other one is told as well
        box = plots.first.bounding_box()
        page.mouse.move(box["x"] + 200, box["y"] + 60)
        page.mouse.down()
        page.mouse.move(box["x"] + 300, box["y"] + 60, steps=4)
        page.mouse.up()
        assert page.locator(".chart.zoomed").count() == 2
        assert page.evaluate(COVERED) == 0
        page.locator(".chart.zoomed button").first.click()
        assert page.locator(".chart.zoomed").count() == 0
        assert page.wrong == []
