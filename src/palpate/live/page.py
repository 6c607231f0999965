"""The live page's text: everything it needs lies in it, and its policy lets nothing else run or be asked."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources

from palpate.live.view import View
from palpate.report.look.assets import ARM, ARM_IN_SPACE, CHARTS, data, policy, scripts
from palpate.report.page import render
from palpate.text import printable

PAGE_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def page(view: View) -> str:
    """The page of a source as HTML."""
    drawing = ARM if view.scene is None else ARM_IN_SPACE
    codes = (*scripts(*CHARTS, *drawing), _own("strip.js"), _own("live.js"))
    shown_view = replace(
        view,
        title=printable(view.title),
        about=printable(view.about),
        notes=tuple(map(printable, view.notes)),
        units={name: printable(unit) for name, unit in view.units.items()},
    )
    return render(
        "live.html",
        "palpate.live",
        view=shown_view,
        data=data(shown_view.to_json()),
        title=f"{shown_view.title} – palpate live",
        command="",
        own_styles=_own("live.css"),
        scripts=codes,
        policy=policy(codes, "connect-src 'self' ws://127.0.0.1:* ws://localhost:*"),
    )


def _own(name: str) -> str:
    return (resources.files("palpate.live") / name).read_text(encoding="utf-8")
