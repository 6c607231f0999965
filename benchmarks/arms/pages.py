"""Tables that stand between two marks of a page, so that the command that made them makes them again."""

import re
from pathlib import Path


def standing(page: Path | None, name: str) -> list[str]:
    """The lines of a table that stands between the marks of its name; none without a page."""
    if page is None:
        return []
    text = page.read_text(encoding="utf-8").partition(f"<!-- {name}: ")[2].partition("<!-- end of ")[0]
    return [line for line in text.splitlines() if line.startswith("|")]


def put(page: Path | None, name: str, lines: list[str]) -> None:
    """Put a table between the marks of its name; nothing without a page."""
    if page is None:
        return
    first, last = f"<!-- {name}: made by benchmarks/arms/{name}.py -->", f"<!-- end of {name} -->"
    body = f"{first}\n\n" + "\n".join(lines) + f"\n\n{last}"
    text = page.read_text(encoding="utf-8")
    new, count = re.subn(re.escape(first) + ".*?" + re.escape(last), lambda _: body, text, flags=re.DOTALL)
    assert count == 1, f"{page} has no marks for the table"
    page.write_text(new, encoding="utf-8")
