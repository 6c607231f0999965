"""Pages as a reader opens them: from a file, by light and by dark, on a wide screen and on a telephone's."""

import shlex
import shutil

import pytest

from opened_pages import open_page
from palpate.cli import main

pytestmark = pytest.mark.long

COLUMNS = "--time time_s --position position_mm:mm --force force_N:N"


@pytest.fixture(scope="module")
def pages(tmp_path_factory, root):
    """Pages of an identification of one log, and of two."""
    folder = tmp_path_factory.mktemp("pages")
    logs = [str(root / "examples" / "data" / "press.csv"), str(folder / "other.csv")]
    shutil.copy(*logs)
    one, two = folder / "one.html", folder / "two.html"
    assert main(["identify", logs[0], *shlex.split(COLUMNS), "--report", str(one)]) == 0
    assert main(["identify", *logs, *shlex.split(COLUMNS), "--report", str(two)]) == 0
    return {"one": one, "two": two}


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("one", 1400, "light"),
        ("two", 400, "dark"),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in (("one", 400, "dark"), ("two", 1400, "light"))
        ),
    ],
)
def test_it_opens_alone_and_is_no_wider_than_the_screen(browser, pages, name, width, scheme):
    with open_page(
        browser, f"file://{pages[name]}", viewport={"width": width, "height": 860}, color_scheme=scheme
    ) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert [url for url in page.asked if not url.startswith(("file:", "data:"))] == []
        assert page.wrong == []
