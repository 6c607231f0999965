"""The page of the thesis as a reader opens it: by light and by dark, on a wide screen and on a telephone's."""

import pytest

from opened_pages import open_page
from palpate.cli import main

pytestmark = pytest.mark.long


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
        page.click("#verdicts summary")
        every = page.locator("#verdicts tbody tr").count()
        assert every == page.locator(".claim").count()
        page.fill("#verdicts .sift", "contradicted")
        assert 0 < page.locator("#verdicts tbody tr:visible").count() < every
        page.fill("#verdicts .sift", "no claim has this")
        assert page.locator("#verdicts tbody tr:visible").count() == 0
