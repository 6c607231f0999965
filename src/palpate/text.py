"""Text from outside, made safe to show: names in a log are a stranger's."""

from __future__ import annotations

import unicodedata

_UNSAFE = {
    "Cc",
    "Cf",
    "Cs",
    "Zl",
    "Zp",
}  # controls, formats (they turn the direction of a line), halves of letters
_KEPT = "\n\t\u200c\u200d"  # the last two join letters of several scripts


def printable(text: str) -> str:
    """The text with every control character, escape sequence and undecodable byte as a visible escape.

    Lines and tabs are kept. The result holds nothing that a terminal obeys, and can be encoded as UTF-8.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(_visible(letter) for letter in text)


def _visible(letter: str) -> str:
    if letter in _KEPT or unicodedata.category(letter) not in _UNSAFE:
        return letter
    return letter.encode("unicode_escape", "backslashreplace").decode("ascii")
