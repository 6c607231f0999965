"""Block diagrams: blocks read from the program, at given places, with wires between them."""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.bench import load
from palpate.report import style
from palpate_thesis.blocks import Block
from palpate_thesis.drawing import Axes, Figure

Place = tuple[float, float]
WIDTH, HEIGHT = 1.74, 0.74
"""Size of a block, in the units of the places."""
WORDS = {
    "see": "inputs of the network",
    "net.forward": "network {sizes}\n(4.23), (4.24)",
    "command": "its force commands",
    "net.want": "errors of its outputs",
    "net.learn": "back-propagation\n(4.28), (4.29)",
    "answer": "network {sizes}",
    "backward": "back-propagation",
    "descend": "new weights",
    "x, v, a": "scaled x, v, a",
}
"""Words for steps whose names say little; {sizes} are the neurons of each layer."""


def label(block: Block, sizes: str) -> str:
    """Text of a block: words, or name, law or formula, and equation."""
    if block.name in WORDS:
        return WORDS[block.name].format(sizes=sizes)
    formula = re.sub(r"(\w+)\([^()]*\)", r"\1", block.formula) if "," in block.formula else block.formula
    for code, sign in (("J.T @", "Jᵀ"), ("1.0", "1"), (" * ", " "), (" - ", " − ")):
        formula = formula.replace(code, sign)
    formula = formula.replace(" + ", "\n+ ") if len(formula) > 24 else formula
    lines = (
        "" if block.name == "return" else block.name,
        block.law.replace("_", " ") or formula,
        block.equation,
    )
    return "\n".join(filter(None, lines))


def surface_name(experiment: str) -> str:
    """Word for the surface of an experiment, by the name of its law in the experiment's file."""
    tag = load(experiment).surface.__struct_config__.tag
    return f"surface ({tag})"


def canvas(width: float, height: float, size: float) -> tuple[Figure, Axes]:
    """A figure of this height [inches] without axes, and its panel of width and height in the units of the places."""
    drawing, (axis,) = style.grid((11.0, size))
    axis.set(xlim=(0.0, width), ylim=(-0.3, height))
    axis.set_axis_off()
    return drawing, axis


def left(place: Place) -> Place:
    """Middle of a block's left edge."""
    return place[0] - WIDTH / 2, place[1]


def right(place: Place) -> Place:
    """Middle of a block's right edge."""
    return place[0] + WIDTH / 2, place[1]


def draw_box(axis: Axes, place: Place, text: str, *, plain: bool = True) -> None:
    """A block with its text; blocks outside of the program's step are grey."""
    from matplotlib.patches import FancyBboxPatch

    corner = (place[0] - WIDTH / 2, place[1] - HEIGHT / 2)
    face = style.CARD if plain else style.GRID
    look: dict[str, Any] = {
        "boxstyle": "round,pad=0,rounding_size=0.08",
        "facecolor": face,
        "edgecolor": style.INK,
    }
    axis.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, linewidth=1.1, zorder=3, **look))
    axis.text(*place, text, ha="center", va="center", fontsize=9.0, color=style.INK, zorder=4)


def draw_wire(axis: Axes, points: Sequence[Place], text: str = "", *, dashed: bool = False) -> None:
    """An arrow along points, its text beside the middle of its longest piece."""
    line: dict[str, Any] = {"color": style.QUIET, "linewidth": 1.1, "linestyle": "--" if dashed else "-"}
    *_, last, end = points
    if len(points) > 2:
        axis.plot(*np.transpose(points[:-1]), **line)
    axis.annotate(
        "", end, last, arrowprops={"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, **line}, zorder=2
    )
    a, b = max(pairwise(points), key=lambda piece: float(np.hypot(*np.subtract(*piece))))
    upright = a[0] == b[0]
    x, y = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    put: dict[str, Any] = {"ha": "left", "va": "center"} if upright else {"ha": "center", "va": "bottom"}
    axis.text(x + 0.07 * upright, y + 0.05 * (not upright), text, fontsize=8.5, color=style.QUIET, **put)


def draw_steps(axis: Axes, blocks: Mapping[str, Block], places: Mapping[str, Place], sizes: str) -> None:
    """All blocks, and a wire from each to those that use its value."""
    for name, block in blocks.items():
        draw_box(axis, places[name], label(block, sizes))
        sources = block.inputs & blocks.keys()
        values = {source for source in sources if blocks[source].law != source}
        for source in sorted(values or sources):  # a memory connects steps that no value connects
            draw_wire(axis, route(places[source], places[name]))


def route(start: Place, end: Place) -> list[Place]:
    """Corners of a wire between two blocks: straight where they share a row or a column, else with one bend."""
    (x0, y0), (x1, y1) = start, end
    vertical = HEIGHT / 2 if y1 > y0 else -HEIGHT / 2
    if x0 == x1:
        return [(x0, y0 + vertical), (x1, y1 - vertical)]
    side = WIDTH / 2 if x1 > x0 else -WIDTH / 2
    if y0 == y1:
        return [(x0 + side, y0), (x1 - side, y1)]
    middle = (x0 + x1) / 2
    return [(x0 + side, y0), (middle, y0), (middle, y1), (x1 - side, y1)]


def loop_diagram(
    blocks: Mapping[str, Block], places: Mapping[str, Place], experiment: str, sizes: str = ""
) -> Figure:
    """Steps of a controller around the arm on the surface of an experiment.

    Args:
        blocks: steps.
        places: of the steps; the arm stands to the right of "return".
        experiment: name of the shipped experiment that has the surface.
        sizes: neurons of the layers of its network, if it has one.
    """
    drawing, axis = canvas(12.0, 4.5, 5.0)
    draw_steps(axis, blocks, places, sizes)
    plant, low = (places["return"][0] + 2.1, places["return"][1]), -0.15
    draw_box(axis, plant, f"arm on a\n{surface_name(experiment)}", plain=False)
    draw_wire(axis, [right(places["return"]), left(plant)])
    rows = {given: [left(places[name]) for name in _users(blocks, given)] for given in ("task", "sense")}
    _bus(axis, [(0.3, 4.1)], [(x, y + 0.12) for x, y in rows["task"]])
    bottom = [(plant[0], plant[1] - HEIGHT / 2), (plant[0], low), (0.9, low)]
    _bus(axis, bottom, [(x, y - 0.12) for x, y in rows["sense"]])
    words: dict[str, Any] = {"va": "bottom", "fontsize": 8.5, "color": style.QUIET}
    axis.text(0.3, 4.15, "desired x, f", **words)
    axis.text(plant[0] - 0.1, low, "measured x, f", ha="right", **words)
    return drawing


def _users(blocks: Mapping[str, Block], given: str) -> list[str]:
    """Blocks that use what the law is given and no torque or command of other blocks: the feed-forward is not drawn."""
    users = (name for name, block in blocks.items() if any(i.startswith(f"{given}.") for i in block.inputs))
    return [name for name in users if not blocks[name].inputs & {"u_x", "u_f"}]


def _bus(axis: Axes, start: Sequence[Place], ends: Sequence[Place]) -> None:
    """A line along `start` and on upright, with a wire to each end."""
    x, y = start[-1]
    furthest = max((row for _, row in ends), key=lambda row: abs(row - y))
    axis.plot(*np.transpose([*start, (x, furthest)]), color=style.QUIET, linewidth=1.1)
    for end, row in ends:
        draw_wire(axis, [(x, row), (end, row)])
