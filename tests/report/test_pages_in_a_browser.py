"""Pages as a reader opens them: from a file, by light and by dark, on a wide screen and on a telephone's."""

import shlex
from contextlib import contextmanager

import numpy as np
import pytest

from palpate.cli import main
from palpate.report import style
from palpate.report.figure_panels.panels import panels_of
from palpate.studies.findings.summary import present
from palpate.studies.running.run_study import Work
from palpate.thesis.claims import Done
from palpate.thesis.page import index_page
from studies.small import Formula, planned, text

EXCITE = (
    "excite --stiffness 3:8:N/mm --damping 100:300 --mass 0.1 --force 15 --peak 20 --duration 4 --no-figure"
)


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A designed excitation that is enough, one that is not, and a figure of the thesis."""
    folder = tmp_path_factory.mktemp("pages")
    enough, little, thesis = folder / "enough.html", folder / "little.html", folder / "thesis"
    assert main([*shlex.split(EXCITE), "--precision", "K=20%", "--report", str(enough)]) == 0
    assert main([*shlex.split(EXCITE), "--precision", "M=1%", "--report", str(little)]) == 1
    assert main(["thesis", "3.7", "--out", str(thesis)]) == 0
    return {"enough": enough, "little": little, "thesis": thesis / "index.html"}


@contextmanager
def opened(browser, path, **context):
    own = browser.new_context(**context)
    page = own.new_page()
    page.set_default_timeout(60_000)
    page.asked, page.wrong = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("console", lambda message: page.wrong.append(message.text))
    page.goto(f"file://{path}")
    try:
        yield page
    finally:
        own.close()


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("enough", 1400, "light"),
        ("little", 400, "dark"),
        ("thesis", 400, "dark"),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in (("enough", 400, "dark"), ("little", 1400, "light"), ("thesis", 1400, "light"))
        ),
    ],
)
def test_it_opens_alone_and_is_no_wider_than_the_screen(browser, pages, name, width, scheme):
    with opened(browser, pages[name], viewport={"width": width, "height": 860}, color_scheme=scheme) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert [url for url in page.asked if not url.startswith(("file:", "data:"))] == []
        assert page.wrong == []


def test_the_charts_of_an_excitation_are_drawn_and_told(browser, pages):
    with opened(browser, pages["little"], viewport={"width": 1400, "height": 1000}) as page:
        titles = page.locator("figure.chart h3").all_text_contents()
        assert titles == ["Desired force", "Spectrum", "Predicted uncertainty"]
        for chart in page.locator("figure.chart canvas").all():
            assert chart.evaluate(
                "c => [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data].some(v => v)"
            )
        page.locator("#chart-precision .plot").hover()
        assert (
            page.locator("#chart-precision .read")
            .text_content()
            .startswith(("1", "2", "3", "4", "5", "6", "7", "8", "9"))
        )
        assert page.get_by_text("The precision cannot be had").is_visible()


def test_claims_of_one_verdict_are_shown(browser, pages):
    with opened(browser, pages["thesis"]) as page:
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


def test_lines_of_a_figure_are_zoomed_together_and_told(browser, tmp_path):
    t = np.linspace(0.0, 10.0, 5000)
    with style.inked():
        figure, (above, below) = style.figure(rows=2)
        above.plot(t, 20.0 + np.sin(t), color=style.F, label="true")
        below.plot(t, np.cos(t), label="angle")
        below.set_xlabel("time [s]")
    path = tmp_path / "index.html"
    done = [Done("6.11", "A title", "What is seen.", [], 1.0)]
    path.write_text(
        index_page(done, {"6.11": panels_of(figure)}, [], "palpate thesis 6.11"), encoding="utf-8"
    )
    with opened(browser, path, viewport={"width": 1400, "height": 900}) as page:
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
        page.locator(".chart.zoomed button").first.click()
        assert page.locator(".chart.zoomed").count() == 0
        assert page.wrong == []


def test_curves_of_a_study_are_read_with_their_range_and_zoomed_together(browser, tmp_path):
    source = text(
        '"controller.ki" = { log = [1.0, 100.0], points = 9 }\n"surface.damping" = [60.0, 200.0]\n'
        '"surface.stiffness" = [1000.0, 5000.0]',
        head="seeds = 2",
        tail='[[curves]]\nx = "controller.ki"\nmetric = "force_rms"\npanels = "surface.stiffness"',
    )
    study, runner = planned(source), Formula(lambda at: at["controller.ki"] + at["surface.damping"])
    frame = Work(study, source, tmp_path, runner).done(force=False)
    present(frame, study, tmp_path, source, "palpate study T")
    with opened(browser, tmp_path / "report.html", viewport={"width": 1400, "height": 900}) as page:
        plots = page.locator(".panel .plot")
        assert plots.count() == 2
        plots.first.scroll_into_view_if_needed()
        box = plots.first.locator(".u-over").bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60)  # the middle of 1 to 100 by the logarithm
        told = page.locator(".panel .read").all_text_contents()
        assert told[0] == told[1]
        assert told[0].startswith("10.000")
        assert told[0].endswith("140.0 (70.00 to 210.0)")
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] - 10, box["y"] + 60, steps=4)
        page.mouse.up()
        assert page.locator(".panel.zoomed").count() == 2
        assert page.wrong == []
