"""What docs/json.md says of each command's object."""

import re


def documented(root):
    """By heading, the keys of its table."""
    text = (root / "docs" / "json.md").read_text(encoding="utf-8")
    parts = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    return {
        part.partition("\n")[0].strip(): set(re.findall(r"^\| `(\w+)` \|", part, re.MULTILINE))
        for part in parts
    }
