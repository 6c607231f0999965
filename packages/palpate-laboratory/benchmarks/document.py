r"""Puts what `palpate laboratory` found, and what `palpate thesis` makes of it, into a page between its marks.

python packages/palpate-thesis/benchmarks/document.py runs/laboratory --thesis runs/thesis-inferred \
    --markdown docs/laboratory.md
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import msgspec

from palpate_laboratory.findings import DOCUMENT, FOUND
from palpate_laboratory.sentences import sentences
from palpate_thesis.claims import ThesisClaim, count_in_words

MARKS = ("<!-- found: begin -->", "<!-- found: end -->")
BENCH = "hand-chosen bench"


def main() -> None:
    """The document without its first line, which says who made it, and the count of the claims."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("laboratory", type=Path)
    asked.add_argument("--thesis", type=Path)
    asked.add_argument("--markdown", type=Path, required=True)
    words = asked.parse_args()
    found = (words.laboratory / DOCUMENT).read_text("utf-8").partition("\n")[2].strip()
    parts = [MARKS[0], found, *([_thesis(words.laboratory, words.thesis)] if words.thesis else []), MARKS[1]]
    body = "\n\n".join(parts)
    text = words.markdown.read_text("utf-8")
    new, count = re.subn(f"{MARKS[0]}.*?{MARKS[1]}", lambda _: body, text, flags=re.DOTALL)
    assert count == 1, f"{words.markdown} has no marks for what was found"
    words.markdown.write_text(new, "utf-8")


def _thesis(laboratory: Path, thesis: Path) -> str:
    """How many claims `palpate thesis --laboratory inferred` reproduces, beside the bench by the same rules."""
    claims = msgspec.json.decode((thesis / "claims.json").read_bytes(), type=list[ThesisClaim])
    held = msgspec.json.decode((laboratory / FOUND).read_bytes())["sentences"]
    on_bench = {s.id for s in sentences() if s.enough(held[s.id][BENCH], 10)}
    there = {c.id for c in claims if not c.group and c.verdict == "reproduced"}
    counted = (
        f"In the laboratory that comes with palpate: {count_in_words(claims)}; on the hand-chosen bench "
        f"{len(on_bench)} of the same {len(sentences())} are reproduced."
    )
    only = f"Only there: {_listed(there - on_bench)}.", f"Only on the bench: {_listed(on_bench - there)}."
    return "\n\n".join(("### `palpate thesis --laboratory inferred`", counted, *only))


def _listed(ids: set[str]) -> str:
    return ", ".join(f"`{id_}`" for id_ in sorted(ids)) or "none"


if __name__ == "__main__":
    main()
