"""Colours, each with one meaning everywhere: on pages, in figures, on the live page; and the same by light and dark.

A data colour draws, and has a contrast of 3:1 or more on every ground (WCAG 2.2, 1.4.11); what is written in a
quantity's colour takes its `-text`, of 4.5:1 or more (1.4.3). `tests/report/test_look.py` measures both.
"""

from __future__ import annotations

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
"""Stiffness, damping, mass, true force; what a sensor said; it failed, it is in doubt, it holds."""

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

MAPS = {"map-low": "#e6f3c9", "map-high": "#173f6b", "map-mark": "#14181d", "map-halo": "#ffffff"}
"""Of a map: the ends of its scale, what is marked on it, and the rim that keeps a mark legible on any field."""

PAIRS = {
    "paper": ("#ffffff", "#13161a"),
    "card": ("#f5f6f8", "#1b1f25"),
    "lift": ("#ffffff", "#242a31"),
    "line": ("#dce0e6", "#343b44"),
    "grid": ("#e9ecf0", "#272d34"),
    "ink": ("#1a1d21", "#e8eaed"),
    "quiet": ("#59616c", "#a3abb6"),
    "link": ("#1665bd", "#6fb1fa"),
    "K-text": ("#1665bd", "#6fb1fa"),
    "B-text": ("#96560a", "#e9a24a"),
    "M-text": ("#7a3f9f", "#c294de"),
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
    light = "".join(f"--{name}:{value};" for name, value in (DATA | SERIES | MAPS).items())
    light += "".join(f"--{name}:{pair[0]};" for name, pair in PAIRS.items())
    dark = "".join(f"--{name}:{pair[1]};" for name, pair in PAIRS.items())
    return (
        f":root{{color-scheme:light dark;{light}}}\n"
        f"@media screen and (prefers-color-scheme:dark){{:root:not([data-print]){{{dark}}}}}\n"
    )
