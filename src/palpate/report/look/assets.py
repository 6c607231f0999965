"""Style sheets and scripts that lie in the page itself, and the policy that lets nothing else run."""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from importlib import resources
from typing import Any

from palpate.report.look.tokens import style_sheet

CHARTS = ("vendor/uplot/uPlot.iife.min.js", "charts.js")
"""Library of the interactive charts."""
ARM = ("arm.js",)
ARM_IN_SPACE = (*ARM, "arm3.js")
TABLES = ("tables.js",)


@cache
def text_of(name: str, package: str = "palpate.report.look") -> str:
    """A file of a package; of this one, if no other is named."""
    return (resources.files(package) / name).read_text(encoding="utf-8")


@cache
def styles() -> str:
    """The style sheet of every page."""
    licence = "/* uPlot: MIT, (c) 2022 Leon Sorokin */"
    return "\n".join((style_sheet(), text_of("look.css"), licence, text_of("vendor/uplot/uPlot.min.css")))


def scripts(*names: str) -> tuple[str, ...]:
    """Scripts as they stand between their tags."""
    return tuple(text_of(name) for name in names)


def policy(codes: tuple[str, ...], *more: str) -> str:
    """A content security policy under which exactly these scripts run, and nothing is fetched.

    Args:
        codes: the scripts, letter by letter.
        more: further directives.
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
    return "; ".join((*rules, *more))


def data(value: Any) -> str:
    """A value as JSON that may stand in a script element of a page: no text in it ends the element."""
    plain = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        plain = plain.replace(letter, f"\\u{ord(letter):04x}")
    return plain


def _digest(code: str) -> str:
    return base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
