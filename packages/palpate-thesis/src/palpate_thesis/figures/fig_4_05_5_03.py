"""Figures 4.5, 4.6, 5.2 and 5.3: block diagrams and networks, drawn from the program's own parts."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import load
from palpate.controllers import Neural, neural
from palpate.identifiers import neural_probe
from palpate.identifiers.neural_probe import CHANNELS, SETTINGS, SIGNALS
from palpate.networks import layers_of
from palpate.report import style
from palpate_thesis.blocks import Block, blocks_of, values_written
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.neural_identifier.network import NetworkChoice
from palpate_thesis.runs import Runs

Place = tuple[float, float]
WIDTH, HEIGHT = 1.74, 0.74
"""Size of a block, in the units of the places."""
CONTROLLER: Mapping[str, Place] = {
    "u_x": (2.3, 3.6),
    "u_f": (2.3, 2.7),
    "torque": (4.6, 3.15),
    "see": (4.6, 1.8),
    "net.forward": (6.6, 1.8),
    "command": (8.6, 1.8),
    "error": (2.3, 0.6),
    "net.want": (4.6, 0.6),
    "net.learn": (6.6, 0.6),
    "return": (8.6, 3.15),
}
"""Places of the steps of `Neural.step`."""
IDENTIFIER: Mapping[str, Place] = {
    "x, v, a": (4.0, 1.6),
    "answer": (6.0, 1.6),
    "error": (8.0, 1.6),
    "backward": (8.0, 0.4),
    "descend": (6.0, 0.4),
}
"""Places of the steps of `absorb`."""
NET = Neural.thesis().network
PLANT = (10.7, 3.15)
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


@dataclass(frozen=True, eq=False)
class Diagram:
    """One figure without a claim; `draw` takes nothing but the program's parts."""

    NUMBER: str
    draw: Any

    def run(self, _: Runs) -> None:
        """Nothing is measured."""

    def check(self, _: None) -> Sequence[ThesisClaim]:
        """No claim: a diagram says how the parts are connected."""
        return []

    def plot(self, _: None) -> Figure:
        """The diagram."""
        drawing: Figure = self.draw()
        return drawing


def controller() -> Figure:
    """Figure 4.5: the steps of the neural controller around the arm on the surface."""
    blocks, sizes = blocks_of(neural, "Neural.step"), _sizes(layers_of(NET.sizes, NET.weights))
    drawing, axis = _canvas(12.0, 4.5, 5.0)
    _steps(axis, blocks, CONTROLLER, sizes)
    _box(axis, PLANT, f"arm on a\n{_surface('foam-neural')}", plain=False)
    _wire(axis, [_right(CONTROLLER["return"]), _left(PLANT)], "torque")
    _bus(axis, blocks, "task", [(0.3, 4.1)], 0.12)
    axis.text(0.3, 4.15, "desired x, f", va="bottom", fontsize=8.5, color=style.QUIET)
    low = -0.15
    _bus(axis, blocks, "sense", [(PLANT[0], PLANT[1] - HEIGHT / 2), (PLANT[0], low), (0.9, low)], -0.12)
    axis.text(PLANT[0] - 0.1, low, "measured x, f", ha="right", va="bottom", fontsize=8.5, color=style.QUIET)
    _wire(axis, [(6.6, 0.6 + HEIGHT / 2), (6.6, 1.8 - HEIGHT / 2)], "weights of the next tick", dashed=True)
    return drawing


def identifier() -> Figure:
    """Figure 5.2: the network beside the surface in the force loop."""
    experiment = load("foam-rls")
    blocks, sizes = blocks_of(neural_probe, "absorb"), _sizes(NetworkChoice().probe("foam", 0).layers)
    drawing, axis = _canvas(10.2, 4.0, 4.4)
    law, arm, surface = (1.2, 3.0), (4.0, 3.0), (6.0, 3.0)
    _box(axis, law, f"{experiment.controller.__struct_config__.tag} controller\n(4.13)", plain=False)
    _box(axis, arm, "arm", plain=False)
    _box(axis, surface, _surface("foam-rls"), plain=False)
    _wire(axis, [_right(law), _left(arm)], "torque")
    _wire(axis, [_right(arm), _left(surface)])
    _wire(axis, [(arm[0], arm[1] - HEIGHT / 2), (arm[0], 1.6 + HEIGHT / 2)], ", ".join(SIGNALS[:3]))
    _wire(axis, [_right(surface), (8.0, 3.0), (8.0, 1.6 + HEIGHT / 2)], SIGNALS[3])
    _wire(axis, [(8.0, 3.0), (9.4, 3.0), (9.4, 3.8), (1.2, 3.8), (1.2, 3.0 + HEIGHT / 2)])
    _steps(axis, blocks, IDENTIFIER, sizes)
    _wire(axis, [(6.0, 0.4 + HEIGHT / 2), (6.0, 1.6 - HEIGHT / 2)], "weights of the next sample", dashed=True)
    return drawing


def control_network() -> Figure:
    """Figure 4.6: the 9-12-3 network of the controller, with the weights that the listing prints."""
    outputs = [
        f"{name}, up to {a:g}"
        for name, a in zip(("f_x [N]", "f_y [N]", "moment [N m]"), NET.amplitude, strict=True)
    ]
    names = {"x": "{axis}", "x_before": "{axis} of the tick before", "torque": "torque of motor {motor}"}
    parts = [value.split(".") for value in values_written(neural, "see")]
    inputs = [
        names[signal].format(axis="φ" if axis == "z" else axis, motor="xyz".index(axis) + 1)
        for signal, axis in parts
    ]
    return _neurons(layers_of(NET.sizes, NET.weights), inputs, outputs, 5.4)


def identifying_network() -> Figure:
    """Figure 5.3: the 3-4-1 network of the identifier, with the weights of its first start."""
    inputs = [
        f"{scale:g} × {channel}" for scale, channel in zip(SETTINGS["foam"].scale, CHANNELS, strict=True)
    ]
    layers = NetworkChoice().probe("foam", 0).layers
    return _neurons(layers, inputs, [f"force [N], up to {NetworkChoice().amplitude:g}"], 3.0)


def _sizes(layers: Sequence[Array]) -> str:
    """Neurons of each layer: "9-12-3"."""
    return "-".join(map(str, [layers[0].shape[1] - 1, *map(len, layers)]))


def _surface(experiment: str) -> str:
    tag = load(experiment).surface.__struct_config__.tag
    return f"surface ({tag})"


def _canvas(width: float, height: float, size: float) -> tuple[Figure, Axes]:
    drawing, (axis,) = style.grid((11.0, size))
    axis.set(xlim=(0.0, width), ylim=(-0.3, height))
    axis.set_axis_off()
    return drawing, axis


def _left(place: Place) -> Place:
    return place[0] - WIDTH / 2, place[1]


def _right(place: Place) -> Place:
    return place[0] + WIDTH / 2, place[1]


def _box(axis: Axes, place: Place, text: str, *, plain: bool = True) -> None:
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


def _wire(axis: Axes, points: Sequence[Place], text: str = "", *, dashed: bool = False) -> None:
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


def _steps(axis: Axes, blocks: Mapping[str, Block], places: Mapping[str, Place], sizes: str) -> None:
    """All blocks, and a wire from each to those that use its value."""
    for name, block in blocks.items():
        _box(axis, places[name], label(block, sizes))
        sources = block.inputs & blocks.keys()
        values = {source for source in sources if blocks[source].law != source}
        for source in sorted(values or sources):  # a memory connects steps that no value connects
            _wire(axis, route(places[source], places[name]))


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


def _bus(axis: Axes, blocks: Mapping[str, Block], given: str, start: Sequence[Place], offset: float) -> None:
    """A line along `start` and on upright, with a wire to each block in the first column, and `see`, that needs it."""
    users = [name for name, block in blocks.items() if any(i.startswith(f"{given}.") for i in block.inputs)]
    ends = [_left(CONTROLLER[name]) for name in users if name != "torque"]  # S and f_d are drawn at u_f
    x, y = start[-1]
    furthest = max((row + offset for _, row in ends), key=lambda row: abs(row - y))
    axis.plot(*np.transpose([*start, (x, furthest)]), color=style.QUIET, linewidth=1.1)
    for end, row in ends:
        _wire(axis, [(x, row + offset), (end, row + offset)])


def _neurons(layers: Sequence[Array], inputs: Sequence[str], outputs: Sequence[str], height: float) -> Figure:
    """A circle a neuron, and a line a weight, darker for a larger one."""
    counts = [layers[0].shape[1] - 1, *map(len, layers)]
    drawing, axis = _canvas(10.0, height, height)
    columns = [
        [(3.0 + 2.0 * i, height * (k + 0.5) / n) for k in reversed(range(n))] for i, n in enumerate(counts)
    ]
    for before, after, weights in zip(columns, columns[1:], layers, strict=False):
        largest = np.abs(weights[:, 1:]).max()
        for j, end in enumerate(after):
            for i, start in enumerate(before):
                strength = float(abs(weights[j, 1 + i]) / largest)
                axis.plot(
                    *zip(start, end, strict=True),
                    color=style.QUIET,
                    linewidth=0.3 + strength,
                    alpha=0.2 + 0.6 * strength,
                )
    for column, face in zip(columns, (style.CARD, style.SERIES[0], style.SERIES[0]), strict=True):
        axis.plot(*zip(*column, strict=True), "o", markersize=11, markerfacecolor=face, color=style.INK)
    for names, column, side in ((inputs, columns[0], -0.25), (outputs, columns[-1], 0.25)):
        for name, (x, y) in zip(names, column, strict=True):
            axis.text(x + side, y, name, ha="right" if side < 0 else "left", va="center", fontsize=8.5)
    return drawing


STUDIES = (
    Diagram("4.5", controller),
    Diagram("4.6", control_network),
    Diagram("5.2", identifier),
    Diagram("5.3", identifying_network),
)
