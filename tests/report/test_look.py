"""Tokens that stand out on every ground, columns that keep their peaks, pages in which nothing else runs."""

import base64
import hashlib
import itertools
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InputError
from palpate.report import style
from palpate.report.look.assets import CHARTS, DATA, PAIRS, SERIES, data, policy, scripts, styles
from palpate.report.page import render

GROUNDS = ("paper", "card")
"""What data is drawn on."""
ALL_GROUNDS = [PAIRS[name][i] for name in GROUNDS for i in (0, 1)]


@pytest.mark.parametrize("name", [*DATA, *SERIES])
def test_what_is_drawn_stands_out_on_every_ground(name):
    assert min(contrast((DATA | SERIES)[name], ground) for ground in ALL_GROUNDS) >= 3.0  # WCAG 2.2, 1.4.11


@pytest.mark.parametrize("dark", [0, 1])
@pytest.mark.parametrize(
    "name", [n for n in PAIRS if n.endswith("-text")] + ["ink", "quiet", "link", "bad", "doubt", "good"]
)
def test_what_is_written_can_be_read(name, dark):
    grounds = [PAIRS[ground][dark] for ground in (*GROUNDS, "fail-ground", "warn-ground", "lift")]
    assert min(contrast(PAIRS[name][dark], ground) for ground in grounds) >= 4.5  # WCAG 2.2, 1.4.3


def contrast(one: str, other: str) -> float:
    """Of two colours, 1 to 21 (WCAG 2.2, contrast ratio)."""
    high, low = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    def linear(byte: int) -> float:
        share = byte / 255
        return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4

    red, green, blue = (linear(int(colour[i : i + 2], 16)) for i in (1, 3, 5))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_a_quantity_shares_its_colour_with_nothing():
    assert len({*DATA.values(), *SERIES.values()}) == len(DATA) + len(SERIES)


def test_no_colour_stands_anywhere_but_among_the_tokens(root):
    """By its code, or by one of matplotlib's names: in figures, pages and scripts, the vendored library aside."""
    known = {code.lower() for code in itertools.chain(*PAIRS.values(), DATA.values())}
    codes = re.compile(r"(?<![&\w])#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b(?!-)|\bcolor=\"(?!none|white)\w+\"")
    strange = [
        (path.name, code)
        for path in sorted((root / "src" / "palpate").rglob("*"))
        if path.suffix in (".py", ".js", ".css", ".html")
        and "vendor" not in path.parts
        and path.parts[-2:] != ("look", "assets.py")
        and path.parts[-2:] != ("contact_frame", "payload.py")  # a file of Franka has a colour of its own
        for code in codes.findall(path.read_text(encoding="utf-8"))
    ]
    assert strange == []
    site = (root / "docs" / "site.css").read_text(encoding="utf-8")
    assert {code.lower() for code in re.findall(r"#[0-9a-fA-F]{6}\b", site)} <= known


@given(st.integers(1, 400), st.integers(4, 60), st.integers(0, 2**31))
def test_thinning_keeps_order_ends_and_peaks(n, most, seed):
    values = np.random.default_rng(seed).standard_normal(n)
    rows = style.rows_shown(values, most)
    assert (np.diff(rows) > 0).all()
    assert len(rows) <= max(most + 2, n if n <= most else 0)
    assert {0, n - 1} <= set(rows.tolist())
    assert values[rows].max() == values.max()
    assert values[rows].min() == values.min()


def test_only_the_page_s_own_scripts_may_run():
    codes = scripts(*CHARTS)
    found = policy(codes)
    assert found.startswith("default-src 'none'")
    digest = base64.b64encode(hashlib.sha256(codes[1].encode()).digest()).decode()
    assert f"'sha256-{digest}'" in found
    assert "unsafe-eval" not in found
    assert "script-src 'none'" in policy(())


@pytest.mark.parametrize("text", ["</script><script>alert(1)</script>", "<!--", "\u2028", "a&b", "]]>"])
def test_no_text_ends_the_element_that_holds_it(text):
    held = data({"name": text})
    assert not set("<>&\u2028") & set(held)
    assert json.loads(held) == {"name": text}


def test_what_stands_in_scripts_and_styles_ends_none():
    assert "</style" not in styles().lower()
    for name, code in zip(
        (*CHARTS, "arm.js", "tables.js"), scripts(*CHARTS, "arm.js", "tables.js"), strict=True
    ):
        assert "</script" not in code.lower(), name
        assert "eval(" not in code
        assert "new Function" not in code
        assert "innerHTML" not in code or "vendor" in name


def test_a_plain_page_has_the_frame():
    html = render(
        "page.html",
        title="<t>",
        about="a",
        tables=[],
        figures=[],
        source="",
        notes=["<n>"],
        command="<c>",
        made="2026-01-02T03:04",
    )
    assert "&lt;t&gt;" in html
    assert "<c>" not in html
    assert "2026-01-02" in html
    scripts_of = re.findall(r"<script[^>]*>(.*?)</script>", html, re.DOTALL)
    hashes = {base64.b64encode(hashlib.sha256(code.encode()).digest()).decode() for code in scripts_of}
    assert hashes == set(re.findall(r"sha256-([^&]+)&#39;", html)), (
        "each script of the page is allowed by its policy"
    )


@pytest.mark.parametrize(
    ("name", "head"), [("a.png", b"\x89PNG"), ("a.SVG", b"<!-- Made by palpate"), ("a.pdf", b"%PDF-")]
)
def test_a_figure_is_what_its_ending_says_and_known_again(tmp_path, name, head):
    from palpate.files import ours

    figure, (axis,) = style.figure()
    axis.plot([0, 1], [0, 1], color=style.K)
    for _ in range(2):  # the second takes the place of the first, which is palpate's own
        style.save(figure, tmp_path / name)
    written = (tmp_path / name).read_bytes()
    assert written.startswith(head)
    assert ours(tmp_path / name)
    (tmp_path / name).write_bytes(written[:40] + b"somebody else's")
    if not name.endswith("SVG"):
        assert not ours(tmp_path / name)


def test_a_finer_picture_has_more_pixels(tmp_path):
    from matplotlib.image import imread

    figure, _ = style.figure()
    coarse, fine = (imread(style.save(figure, tmp_path / f"{dpi}.png", dpi)) for dpi in (50, 100))
    assert fine.shape[0] == 2 * coarse.shape[0]
    for wrong in (0, -5, 100_000):
        with pytest.raises(InputError, match="--dpi must be from 30 to 1200"):
            style.save(figure, tmp_path / "wrong.png", wrong)
    with pytest.raises(InputError, match="a figure ends in"):
        style.save(figure, tmp_path / "wrong.tiff")
    assert not list(tmp_path.glob("wrong*"))
