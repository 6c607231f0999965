"""Drawn parts of a matplotlib panel, by kind: curves, levels, moments, intervals."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.report.look.assets import DATA, PAIRS, SERIES

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

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


Kind = tuple[str, str, str]

_NAMES = {code: name for name, code in (DATA | SERIES).items()}
_NAMES |= {PAIRS[name][0]: name for name in ("ink", "quiet", "grid", "line", "card")}
_DOTS = {"o": 5.0, ".": 3.5, "s": 5.0, "^": 5.0, "x": 5.0}
"""Marks of matplotlib that a page draws as dots, and their diameters [points] in the style of the figures."""
_DASHES = {"-": [], "--": [6, 4], ":": [2, 3], "-.": [8, 3, 2, 3]}


class NotLines(Exception):
    """The panel holds something that is no line over one axis."""


@dataclass(frozen=True)
class Curve:
    """A line over the panel's x axis.

    Args:
        x, y: its places; x grows.
        label: empty where it has none.
        kind: its colour, style and marks, by which a line is known again in another panel.
        look: how it is drawn, as `palpate.chart` takes a series.
    """

    x: Array
    y: Array
    label: str
    kind: Kind
    look: dict[str, Any]

    @property
    def connected(self) -> bool:
        """Whether there is a line between its places."""
        return not self.look["dots"]


@dataclass(frozen=True)
class Level:
    """A horizontal line through the whole panel, or a band if `low` and `high` differ."""

    low: float
    high: float
    label: str
    look: dict[str, Any]


@dataclass(frozen=True)
class Stretch:
    """Stretches of the x axis; a moment, where both ends are one."""

    spans: list[tuple[float, float]]
    label: str
    colour: str


Drawn = Curve | Level | Stretch


def drawn_in(axes: Axes) -> list[Drawn]:
    """All that a panel shows besides its axes.

    Raises:
        NotLines: something of it is neither a line nor a band across the panel.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon, Rectangle

    if axes.images or axes.tables or any(one.get_text() for one in axes.texts):
        raise NotLines
    found = [_of_line(axes, line) for line in axes.lines]
    for one in (*axes.collections, *axes.patches):
        if not isinstance(one, PolyCollection | Rectangle | Polygon):
            raise NotLines
        found.append(_of_area(axes, one))
    return found


def kind_of(line: Line2D) -> Kind:
    """The colour, the style and the marks of a line."""
    return _code(line.get_color()), str(line.get_linestyle()), str(line.get_marker())


def label_of(one: Artist) -> str:
    """Empty where matplotlib made it up."""
    text = str(one.get_label())
    return "" if text.startswith("_") else plain(text)


def _of_line(axes: Axes, line: Line2D) -> Drawn:
    x, y = (_fill(v) for v in line.get_data(orig=False))
    along, up = _by_data(axes, line)
    label, look = label_of(line), look_of(line)
    if not len(x):
        return Stretch([], label, look["colour"])
    if not along:
        return Level(float(y[0]), float(y[0]), label, look)
    if not up:
        return Stretch([(float(x[0]), float(x[0]))], label, look["colour"])
    known = np.isfinite(x)
    x, y = x[known], y[known]
    if (np.diff(x) < 0.0).any():
        raise NotLines
    return Curve(x, y, label, kind_of(line), look)


def _fill(values: Any) -> Array:
    return np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)


def _of_area(axes: Axes, area: Any) -> Drawn:
    """A band over all of the panel, or stretches of its x axis."""
    along, up = _by_data(axes, area)
    colour = _name(_code(area.get_facecolor()))
    boxes = [path.get_extents() for path in _paths(area)]
    if along and not up:
        return Stretch([(float(box.x0), float(box.x1)) for box in boxes], label_of(area), colour)
    if up and not along and len(boxes) == 1:
        look = {"kind": "band", "colour": colour}
        return Level(float(boxes[0].y0), float(boxes[0].y1), label_of(area), look)
    raise NotLines


def _paths(area: Any) -> list[Any]:
    if hasattr(area, "get_paths"):
        return list(area.get_paths())
    return [area.get_path().transformed(area.get_patch_transform())]


def _by_data(axes: Axes, one: Artist) -> tuple[bool, bool]:
    """Whether its x and its y are those of the data, not shares of the panel."""
    along, up = one.get_transform().contains_branch_seperately(axes.transData)
    return bool(along), bool(up)


def look_of(line: Line2D) -> dict[str, Any]:
    """How a line is drawn, as `palpate.chart` takes a series.

    Raises:
        NotLines: in a colour that is no token, or with marks that a page does not draw.
    """
    style, mark = str(line.get_linestyle()), str(line.get_marker())
    if style == "None" and mark not in _DOTS:
        raise NotLines
    return {
        "colour": _name(_code(line.get_color())),
        "width": 0.0 if style == "None" else round(1.1 * float(line.get_linewidth()), 2),
        "dash": [] if style == "None" else _DASHES.get(style, [5, 4]),
        "alpha": round(float(line.get_alpha() or 1.0), 3),
        "dots": _DOTS.get(mark, 0.0) if style == "None" else 0.0,
    }


def _code(colour: Any) -> str:
    from matplotlib.colors import to_hex

    values = np.asarray(colour, dtype=object)
    return to_hex(colour if values.ndim < 2 else colour[0])


def _name(code: str) -> str:
    """Of a colour among the tokens; a figure that uses another cannot be turned to dark."""
    if code not in _NAMES:
        raise NotLines
    return _NAMES[code]
