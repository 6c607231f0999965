"""Text to be shown: names in a log are a stranger's, and are made safe; long lines are wrapped."""

from __future__ import annotations

import re
import shlex
import sys
import unicodedata
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

_UNSAFE = {
    "Cc",
    "Cf",
    "Cs",
    "Zl",
    "Zp",
}  # controls, formats (they turn the direction of a line), halves of letters
_GAP = " ... "
_LAST_PART, _FIRST_PART = re.compile(r"\s\S{0,30}$"), re.compile(r"^\S{0,30}\s")
"""The part of a word at the cut, which is left out; a longer word, such as a path, is cut."""
_KEPT = "\n\t\u200c\u200d"  # the last two join letters of several scripts


_NAMES = (
    "lag lag-std force-filter series-stiffness mass model method calibration tolerance bonded cutoff rate start end "
    "missing delimiter time position force fixed-lag normal wrench-frame force-sign robot-mass robot-stiffness-from"
)
_KEYWORDS = {name: name.replace("-", "_") for name in _NAMES.split()} | {
    "robot-stiffness": "series_stiffness",
    "force-column": "force",
}
"""Options of the command line, and the keywords of `palpate.identify` and `palpate.identify_log` for them."""
OPTION = re.compile(
    rf"(?<![\w-])--({'|'.join(sorted(_KEYWORDS, key=len, reverse=True))})(?![\w-])(?: (\w+):STD\b| [A-Z]+\b)?"
)
"""An option of `palpate identify` in a sentence, with its value's name."""


_COMMAND = re.compile(r"palpate identify ((?:'[^']*'|[^\s'-]\S*)(?: --[\w-]+ (?:'[^']*'|\S+))+)$")


def _call(words: list[str]) -> str:
    pairs = zip(words[1::2], words[2::2], strict=True)
    options = [f"{name.removeprefix('--').replace('-', '_')}={value!r}" for name, value in pairs]
    return f"palpate.identify_log({', '.join([repr(words[0]), *options])})"


def in_python(text: str) -> str:
    """Advice for the command line in Python's words: `--lag 0:STD` is `lag=(0, STD)`, a whole command a call."""
    text = _COMMAND.sub(lambda match: _call(shlex.split(match[1])), text)
    return OPTION.sub(
        lambda match: f"{_KEYWORDS[match[1]]}=" + (f"({match[2]}, STD)" if match[2] else ""), text
    )


def printable(text: str) -> str:
    """The text with every control character, escape sequence and undecodable byte as a visible escape.

    Lines and tabs are kept. The result holds nothing that a terminal obeys, and can be encoded as UTF-8.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(_visible(letter) for letter in text)


def shorten(text: str, most: int) -> str:
    """Leave out the middle of a text that is too long: the beginning states the fault, the end the remedy."""
    if len(text) <= most:
        return text
    letters = most - len(_GAP)
    begin, end = text[: letters - letters // 3], text[-(letters // 3) :]
    return _LAST_PART.sub("", begin) + _GAP + _FIRST_PART.sub("", end)


def print_hanging(lines: Iterable[Text], console: Console) -> None:
    """Print lines; on a terminal, and in a text of Python's, a long one goes on under its own beginning."""
    from rich.text import Text

    narrow = console.is_terminal or console.file is not sys.stdout
    for line in lines:
        indent = line.cell_len - len(line.plain.lstrip())
        if narrow and line.cell_len > console.width > indent + 20:
            for part in line[indent:].wrap(console, console.width - indent):
                console.print(Text(" " * indent).append(part))
        else:
            console.print(line, soft_wrap=True)


def duration(seconds: float) -> str:
    """A time in words of a fitting unit."""
    for size, unit in ((365.25 * 86400.0, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:,.0f} {unit}"
    return f"{seconds:.0f} seconds"


def _visible(letter: str) -> str:
    if letter in _KEPT or unicodedata.category(letter) not in _UNSAFE:
        return letter
    return letter.encode("unicode_escape", "backslashreplace").decode("ascii")
