"""Style sheets and scripts that lie in the page itself, and the policy that lets nothing else run.

A data colour draws, and has a contrast of 3:1 or more on every ground (WCAG 2.2, 1.4.11); letters in the
colour of the force take `F-text`, of 4.5:1 or more (1.4.3). `tests/report/test_look.py` measures both.
"""

import base64
import hashlib
import json
from functools import cache
from importlib import resources
from typing import Any

DATA = {
    "K": "#2f8bf2",
    "B": "#d07a05",
    "M": "#9457b8",
    "F": "#268c5e",
    "measured": "#858d99",
    "fail": "#d23b47",
    "warn": "#9a7400",
    "ok": "#2b8a57",
}
"""Colours of stiffness, damping, mass, true force, a sensor's reading, and of failed, doubtful and good results."""

SERIES = {
    "s0": "#6a5ff0",
    "s1": "#a8643f",
    "s2": "#0793ad",
    "s3": "#cc4f9c",
    "s4": "#6f8c00",
    "s5": "#94707f",
}
"""Colours of compared series that are no quantity: laws, settings, seeds; none is a colour of `DATA`."""

OUTCOMES = {
    "follows": "#7fbf94",
    "yes": "#7fbf94",
    "done": "#a9cfb6",
    "slow": "#9fc3e6",
    "rings": "#f2c07c",
    "no": "#e4b7a5",
    "lost contact": "#d9776f",
    "diverged": "#8a4a86",
    "no contact": "#bdbdbd",
    "failed": "#7a7a7a",
    "refused": "#dedede",
}
"""Background colours of the outcomes of a run in a map."""

PAIRS = {
    "paper": ("#ffffff", "#13161a"),
    "card": ("#f5f6f8", "#1b1f25"),
    "lift": ("#ffffff", "#242a31"),
    "line": ("#dce0e6", "#343b44"),
    "grid": ("#e9ecf0", "#272d34"),
    "ink": ("#1a1d21", "#e8eaed"),
    "quiet": ("#59616c", "#a3abb6"),
    "link": ("#1665bd", "#6fb1fa"),
    "F-text": ("#1d6646", "#5cb98a"),
    "bad": ("#b3242f", "#ff8a8f"),
    "doubt": ("#7a5a00", "#dcb13c"),
    "good": ("#1c6e42", "#5cc08b"),
    "fail-ground": ("#fdeeee", "#331b1f"),
    "warn-ground": ("#fbf5e2", "#2c2614"),
}
"""Colours that change on a dark page: backgrounds, lines, letters."""


def style_sheet() -> str:
    """The tokens as custom properties of CSS; paper that is printed on is always light."""
    light = "".join(f"--{name}:{value};" for name, value in (DATA | SERIES).items())
    light += "".join(f"--{name}:{pair[0]};" for name, pair in PAIRS.items())
    dark = "".join(f"--{name}:{pair[1]};" for name, pair in PAIRS.items())
    return (
        f":root{{color-scheme:light dark;{light}}}\n"
        f"@media screen and (prefers-color-scheme:dark){{:root:not([data-print]){{{dark}}}}}\n"
    )


CHARTS = ("vendor/uplot/uPlot.iife.min.js", "charts.js")
"""Library of the interactive charts."""
ARM = ("arm.js",)
ARM_IN_SPACE = (*ARM, "arm3.js")
TABLES = ("tables.js",)


@cache
def text_of(name: str, package: str = "palpate.report.look") -> str:
    """Text of a file of a package, by default of this one."""
    return (resources.files(package) / name).read_text(encoding="utf-8")


@cache
def styles() -> str:
    """The style sheet of every page."""
    licence = "/* uPlot: MIT, (c) 2022 Leon Sorokin */"
    return "\n".join((style_sheet(), text_of("look.css"), licence, text_of("vendor/uplot/uPlot.min.css")))


def scripts(*names: str) -> tuple[str, ...]:
    """Scripts as they stand between their tags."""
    return tuple(text_of(name) for name in names)


def policy(codes: tuple[str, ...], *directives: str) -> str:
    """A content security policy under which exactly these scripts run, and nothing is fetched.

    Args:
        codes: texts of the scripts.
        directives: further rules of the policy.
    """
    hashes = " ".join(f"'sha256-{_digest(code)}'" for code in codes) or "'none'"
    rules = (
        "default-src 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        "img-src data:",
        "style-src 'unsafe-inline'",
        f"script-src {hashes}",
    )
    return "; ".join((*rules, *directives))


def data(value: Any) -> str:
    """A value as JSON that may stand in a script element of a page: no text in it ends the element."""
    plain = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        plain = plain.replace(letter, f"\\u{ord(letter):04x}")
    return plain


def _digest(code: str) -> str:
    return base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
