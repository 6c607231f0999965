"""Style of figures, the rows that they show, and the same figure as an SVG for a page."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Indices
from palpate.errors import InputError
from palpate.files import SIGNATURE, whole
from palpate.report.look import assets
from palpate.report.look.assets import DATA, PAIRS
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text


_BY_DARK = dict(PAIRS[name] for name in ("ink", "quiet", "grid", "line", "card"))


def with_peaks(x: Array, values: Array, max_points: int) -> tuple[Array, Array]:
    """Thin a line through values over x to about `max_points` points that keep its peaks."""
    rows = rows_shown(values, max_points)
    return x[rows], values[rows]


def rows_shown(values: Array, max_rows: int) -> Indices:
    """Rows to draw, in order: the smallest and the largest value of every stretch.

    Args:
        values: whose peaks stay, shape (n,); NaN are skipped.
        max_rows: approximate number of rows.
    """
    n = len(values)
    if n <= max_rows:
        return np.arange(n)
    starts = np.linspace(0, n, max(max_rows // 2, 1) + 1).astype(int)[:-1]
    stretch = np.repeat(np.arange(len(starts)), np.diff(starts, append=n))
    rows = [np.array([0, n - 1])]
    for extreme in (np.fmin, np.fmax):
        ends = extreme.reduceat(values, starts)
        reached = np.flatnonzero(values == ends[stretch])
        rows += [reached[np.unique(stretch[reached], return_index=True)[1]], starts[np.isnan(ends)]]
    return np.unique(np.concatenate(rows))


def svg(drawing: Figure, *, signed: bool = False) -> bytes:
    """The figure without a background, its colours turned where the reader's page is dark; needs no other file.

    The same figure gives the same bytes. A file of its own is `signed`; what lies in a page need not be.
    """
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context(
        {"svg.hashsalt": "palpate", "svg.fonttype": "none", "path.simplify_threshold": 0.3}
    ):
        drawing.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*|<!--.*?-->\s*", "", text, flags=re.DOTALL)
    for name, shape in set(re.findall(r'<clipPath id="(\w+)">(.*?)</clipPath>', text, flags=re.DOTALL)):
        # matplotlib's own name is a hash of the unrounded shape
        text = text.replace(name, f"p{sha256(shape.encode()).hexdigest()[:10]}")
    names = {colour: f"--c{i}" for i, colour in enumerate(_BY_DARK)}
    for colour, name in names.items():
        text = text.replace(colour, f"var({name})")
    end = text.index(">") + 1
    mark = f"<!-- Made by {SIGNATURE} -->\n" if signed else ""
    return f"{mark}{text[:end]}\n{_sheet(names)}{text[end:]}".encode()


def _sheet(names: dict[str, str]) -> str:
    light = "".join(f"{name}:{colour};" for colour, name in names.items())
    dark = "".join(f"{names[colour]}:{other};" for colour, other in _BY_DARK.items())
    return f"<style>:root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}</style>"


INK, QUIET, GRID, LINE, CARD = (PAIRS[name][0] for name in ("ink", "quiet", "grid", "line", "card"))
K, B, M, F = (DATA[name] for name in ("K", "B", "M", "F"))
"""One colour a quantity, the same by light and by dark: stiffness, damping, mass; true force and contact."""
MEASURED, FAIL, OK = (DATA[name] for name in ("measured", "fail", "ok"))
SERIES = tuple(assets.SERIES.values())
"""Colours of compared series that are no quantity."""
KNOWN: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (5, 4))}
"""The line of what is asked for, or known to be true."""
FORMATS = (".png", ".svg", ".pdf")
DPI = 110
_COARSEST, _FINEST = 30, 1200


@contextmanager
def ink(size: float | None = None) -> Iterator[None]:
    """Draw letters, ticks and frames in ink instead of black, so that a dark page can turn them.

    Lines without a colour take those of `SERIES` in turn.

    Args:
        size: of the letters [pt]; matplotlib's own if none is given.
    """
    import matplotlib
    from cycler import cycler

    parts: dict[str, Any] = dict.fromkeys(
        ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK
    )
    sizes = ("font.size", "axes.labelsize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize")
    cycle: dict[str, Any] = {"axes.prop_cycle": cycler(color=SERIES)}
    with matplotlib.rc_context(parts | cycle | (dict.fromkeys(sizes, size) if size else {})):
        yield


def figure(rows: int = 1, *, height: float = 2.6, **subplots: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels above each other that share their x axis; each `height` inches high."""
    return grid((9.0, height * rows + 0.5), rows, sharex=True, **subplots)


def empty(width: float, height: float) -> Figure:
    """A figure of this width and height [inches], without a panel."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def grid(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **subplots: Any
) -> tuple[Figure, list[Axes]]:
    """A figure of this width and height [inches], and its panels row by row."""
    drawing = empty(*size)
    axes = list(drawing.subplots(rows, columns, squeeze=False, **subplots).flat)
    for axis in axes:
        plain(axis)
    return drawing, axes


def plain(axis: Axes) -> None:
    """A light grid behind the data, and no frame above and to the right."""
    axis.grid(visible=True, color=GRID, linewidth=0.8)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def logarithmic(axis: Axes, which: str) -> None:
    """Powers of ten along `x` or `y` as plain numbers, with steps between where they are few; limits first."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set(**{f"{which}scale": "log"})
    scale = axis.xaxis if which == "x" else axis.yaxis
    low, high = axis.get_xlim() if which == "x" else axis.get_ylim()
    scale.set_major_locator(LogLocator(subs=(1.0,) if high > 100 * low else (1.0, 2.0, 5.0)))
    scale.set_major_formatter("{x:g}")
    scale.set_minor_formatter(NullFormatter())


def legend(axis: Axes, **options: Any) -> None:
    """The legend above the panel, out of the way of the data."""
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 6, "frameon": False}
    spaces = {"fontsize": 8.5, "borderaxespad": 0.2, "columnspacing": 1.2, "handlelength": 1.5}
    axis.legend(**place | spaces | options)


def literal(text: str) -> str:
    """A text from outside as it is to be drawn: dollars are dollars, not formulas."""
    return printable(text).replace("$", r"\$")


def save(drawing: Figure, path: Path, dpi: int | None = None) -> Path:
    """Write the figure atomically.

    Args:
        drawing: the figure.
        path: it ends in one of `FORMATS`.
        dpi: of a PNG; `DPI` if none is given.

    Raises:
        InputError: another ending, or a resolution that makes no picture.
    """
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"{path}: a figure ends in {', '.join(FORMATS)}; name it so")
    check_dpi(dpi)
    _spell_out(drawing)
    with whole(path) as draft:
        if kind == ".svg":
            draft.write_bytes(svg(drawing, signed=True))
            return path
        about = {"Software": SIGNATURE} if kind == ".png" else {"Creator": SIGNATURE, "CreationDate": None}
        drawing.savefig(draft, format=kind[1:], metadata=about, dpi=dpi or DPI)
    return path


def check_dpi(dpi: int | None) -> None:
    """Refuse a resolution that makes no picture, or one too large for the memory.

    Raises:
        InputError: it is one.
    """
    if dpi is not None and not _COARSEST <= dpi <= _FINEST:
        raise InputError(f"--dpi must be from {_COARSEST} to {_FINEST}, got {dpi}")


def _spell_out(drawing: Figure) -> None:
    """Draw a user's label as it is written if it is no formula."""
    from matplotlib.mathtext import MathTextParser

    for text in _labels(drawing):
        if text.get_text().count("$") > 1:
            try:
                MathTextParser("path").parse(text.get_text())
            except ValueError:
                text.set_parse_math(False)


def _labels(drawing: Figure) -> Iterator[Text]:
    """Titles, labels and legends; not the ticks, which are numbers."""
    from matplotlib.text import Text

    yield from drawing.texts
    for axis in drawing.axes:
        yield from (axis.xaxis.label, axis.yaxis.label)
        yield from (child for child in axis.get_children() if isinstance(child, Text))
        legend = axis.get_legend()
        if legend is not None:
            yield from legend.get_texts()
