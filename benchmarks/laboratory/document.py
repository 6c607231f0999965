"""Puts what `palpate laboratory` found into its page of the documentation, between the marks there.

python benchmarks/laboratory/document.py runs/laboratory/found.md --markdown docs/laboratory.md
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

MARKS = ("<!-- found: begin -->", "<!-- found: end -->")


def main() -> None:
    """The document without its first line, which says who made it."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("found", type=Path)
    asked.add_argument("--markdown", type=Path, required=True)
    words = asked.parse_args()
    found = words.found.read_text("utf-8").partition("\n")[2].strip()
    body = f"{MARKS[0]}\n\n{found}\n\n{MARKS[1]}"
    text = words.markdown.read_text("utf-8")
    new, count = re.subn(f"{MARKS[0]}.*?{MARKS[1]}", lambda _: body, text, flags=re.DOTALL)
    assert count == 1, f"{words.markdown} has no marks for what was found"
    words.markdown.write_text(new, "utf-8")


if __name__ == "__main__":
    main()
