"""Labels of a matplotlib panel, as plain text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIGNS = {r"\eta": "η", r"\mu": "µ", r"\theta": "θ", r"\lambda": "λ", r"\cdot": "·", r"\pm": "±"}
_BELOW = str.maketrans("aehijklmnoprstuvx0123456789", "ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ₀₁₂₃₄₅₆₇₈₉")
_UNIT = re.compile(r"\[([^\]]+)\]\s*$")


def plain(text: str) -> str:
    """A label without its formulas: `$K_e$ [N/m]` is Kₑ [N/m]; a letter that is not written so keeps its underscore."""
    return re.sub(r"\$([^$]*)\$", lambda found: _spell(found[1]), text).replace("\n", " ").strip()


def unit(text: str) -> str:
    """The bracketed end of a label."""
    found = _UNIT.search(text)
    return found[1] if found else ""


def title(axes: Axes) -> str:
    """Of a panel; wherever it stands."""
    return plain(axes.get_title(loc="left") or axes.get_title() or axes.get_title(loc="right"))


def _spell(formula: str) -> str:
    for sign, letter in _SIGNS.items():
        formula = formula.replace(sign, letter)
    formula = re.sub(r"_\{?(\w)\}?", _lower, formula)
    return re.sub(r"\\[a-z]+|[{}^]", "", formula)


def _lower(found: re.Match[str]) -> str:
    letter = found[1].translate(_BELOW)
    return found[0] if letter == found[1] else letter
