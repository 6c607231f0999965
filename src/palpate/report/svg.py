"""A figure as SVG that is read by light and by dark."""

from __future__ import annotations

import io
import re
from hashlib import sha256
from typing import TYPE_CHECKING

from palpate.files import SIGNATURE
from palpate.report.look.assets import PAIRS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BY_DARK = dict(PAIRS[name] for name in ("ink", "quiet", "grid", "line", "card"))


def svg(drawing: Figure, *, signed: bool = False, tight: bool = False) -> bytes:
    """The figure without a background, its colours turned where the reader's page is dark; needs no other file.

    The same figure gives the same bytes. A file of its own is `signed`; what lies in a page need not be. `tight`
    leaves out what is empty around it.
    """
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context(
        {"svg.hashsalt": "palpate", "svg.fonttype": "none", "path.simplify_threshold": 0.3}
    ):
        within = {"bbox_inches": "tight", "pad_inches": 0.04} if tight else {}
        drawing.savefig(buffer, format="svg", transparent=True, metadata={"Date": None}, **within)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*|<!--.*?-->\s*", "", text, flags=re.DOTALL)
    for name, shape in set(re.findall(r'<clipPath id="(\w+)">(.*?)</clipPath>', text, flags=re.DOTALL)):
        # matplotlib's own name is a hash of the unrounded shape
        text = text.replace(name, f"p{sha256(shape.encode()).hexdigest()[:10]}")
    names = {colour: f"--c{i}" for i, colour in enumerate(_BY_DARK)}
    for colour, name in names.items():
        text = text.replace(colour, f"var({name})")
    end = text.index(">") + 1
    mark = f"<!-- Made by {SIGNATURE} -->\n" if signed else ""
    return f"{mark}{text[:end]}\n{_sheet(names)}{text[end:]}".encode()


def _sheet(names: dict[str, str]) -> str:
    light = "".join(f"{name}:{colour};" for colour, name in names.items())
    dark = "".join(f"{names[colour]}:{other};" for colour, other in _BY_DARK.items())
    return f"<style>:root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}</style>"
