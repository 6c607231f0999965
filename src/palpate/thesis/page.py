"""The page of the whole thesis: an overview first, then the figures in the thesis' order."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.thesis.claims import with_wholes

if TYPE_CHECKING:
    from palpate.thesis.measuring import Done, State


def index_page(state: State, done: Sequence[Done], folder: Path) -> str:
    """The page as HTML, figures included; it opens without a network."""
    from jinja2 import Environment, PackageLoader

    from palpate import __version__

    loader = PackageLoader("palpate.thesis", "")
    template = Environment(loader=loader, autoescape=True).get_template("index.html")
    claims = [claim for d in done for claim in d.claims]
    return template.render(
        done=done,
        images={d.number: _data(folder / f"{d.number}.png") for d in done},
        verdicts=Counter(claim.verdict for claim in claims),
        claims=with_wholes(claims),
        figure={claim.id: d.number for d in done for claim in d.claims},
        missing=[n for n in state.wanted if n not in state.done],
        command=state.command,
        version=__version__,
        seconds=sum(d.seconds for d in done),
    )


def _data(image: Path) -> str:
    return base64.b64encode(image.read_bytes()).decode()
