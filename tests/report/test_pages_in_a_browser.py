"""Pages as a reader opens them: from a file, by light and by dark, on a wide screen and on a telephone's."""

import shlex

import pytest

from opened_pages import open_page
from palpate.cli import main

EXCITE = (
    "excite --stiffness 3:8:N/mm --damping 100:300 --mass 0.1 --force 15 --peak 20 --duration 4 --no-figure"
)


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A designed excitation that is enough, and one that is not."""
    folder = tmp_path_factory.mktemp("pages")
    enough, little = folder / "enough.html", folder / "little.html"
    assert main([*shlex.split(EXCITE), "--precision", "K=20%", "--report", str(enough)]) == 0
    assert main([*shlex.split(EXCITE), "--precision", "M=1%", "--report", str(little)]) == 1
    return {"enough": enough, "little": little}


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("enough", 1400, "light"),
        ("little", 400, "dark"),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in (("enough", 400, "dark"), ("little", 1400, "light"))
        ),
    ],
)
def test_it_opens_alone_and_is_no_wider_than_the_screen(browser, pages, name, width, scheme):
    with open_page(
        browser, pages[name], viewport={"width": width, "height": 860}, color_scheme=scheme
    ) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert [url for url in page.asked if not url.startswith(("file:", "data:"))] == []
        assert page.wrong == []


def test_the_charts_of_an_excitation_are_drawn_and_told(browser, pages):
    with open_page(browser, pages["little"], viewport={"width": 1400, "height": 1000}) as page:
        titles = page.locator(".chart h3").all_text_contents()
        assert titles == ["Desired force", "Spectrum", "Predicted uncertainty"]
        for chart in page.locator(".chart canvas").all():
            assert chart.evaluate(
                "c => [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data].some(v => v)"
            )
        page.locator(".chart .plot").nth(2).hover()
        assert (
            page.locator(".chart .read")
            .nth(2)
            .text_content()
            .startswith(("1", "2", "3", "4", "5", "6", "7", "8", "9"))
        )
        assert page.get_by_text("The precision cannot be had").is_visible()
