"""The page of the whole thesis: an overview first, then the figures in the thesis' order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.report.page import png, render
from palpate.thesis.claims import with_wholes

if TYPE_CHECKING:
    from palpate.thesis.measuring import Done, State


def index_page(state: State, done: Sequence[Done], folder: Path) -> str:
    """The page as HTML, figures included; it opens without a network."""
    claims = [claim for d in done for claim in d.claims]
    return render(
        "index.html",
        "palpate.thesis",
        title="The thesis, measured again",
        done=done,
        images={d.number: png(folder / f"{d.number}.png") for d in done},
        verdicts=Counter(claim.verdict for claim in claims),
        claims=with_wholes(claims),
        figure={claim.id: d.number for d in done for claim in d.claims},
        missing=[n for n in state.wanted if n not in state.done],
        command=state.command,
        seconds=sum(d.seconds for d in done),
    )
