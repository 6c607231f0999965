"""Texts of strangers on a terminal."""

from __future__ import annotations

import unicodedata


def plain(text: str) -> str:
    """A text without what a terminal would obey: control and format characters are shown as their codes."""
    return "".join(
        letter
        if letter in "\n\t" or unicodedata.category(letter) not in {"Cc", "Cf", "Cs"}
        else f"\\x{ord(letter):02x}"
        for letter in text
    )
