"""What docs/json.md says of each command's object."""

import re


def documented(root):
    """By heading, the keys of its list."""
    text = (root / "docs" / "json.md").read_text(encoding="utf-8")
    parts = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    return {
        part.partition("\n")[0].strip(): {
            key
            for line in re.findall(r"^- (`[^:\n]*)", part, re.MULTILINE)
            for key in re.findall(r"`(\w+)`", line)
        }
        for part in parts
    }
