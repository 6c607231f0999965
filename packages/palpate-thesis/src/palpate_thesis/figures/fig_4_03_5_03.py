"""Figures 4.3, 4.5, 4.6, 5.2 and 5.3: block diagrams and networks, drawn from the program's own parts."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import load
from palpate.controllers import Neural, hybrid, neural
from palpate.identifiers import neural_probe
from palpate.identifiers.neural_probe import CHANNELS, SETTINGS, SIGNALS
from palpate.networks import layers_of
from palpate.report import style
from palpate_thesis.blocks import Block, blocks_of
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.neural_identifier.network import NetworkChoice
from palpate_thesis.runs import Runs

Place = tuple[float, float]
WIDTH, HEIGHT = 1.74, 0.74
"""Size of a block, in the units of the places."""
HYBRID: Mapping[str, Place] = {
    "u_x": (2.3, 3.6),
    "error": (2.3, 2.2),
    "integral": (4.6, 1.2),
    "u_f": (6.6, 2.2),
    "return": (8.6, 3.2),
}
"""Places of the steps of `Hybrid.step`."""
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
SIGNS = {"J.T @": "Jᵀ", "1.0": "1", " * ": " ", " - ": " − "}
NET = Neural.thesis().network


@dataclass(frozen=True, eq=False)
class Diagram:
    """One figure without a claim; `draw` takes nothing but the program's parts."""

    NUMBER: str
    draw: Callable[[], Figure]

    def run(self, _: Runs) -> None:
        """Nothing has to be measured."""

    def check(self, _: None) -> Sequence[ThesisClaim]:
        """No claim: a diagram says how the parts are connected."""
        return []

    def plot(self, _: None) -> Figure:
        """The diagram of its number."""
        return self.draw()


def label(block: Block, sizes: str) -> str:
    """Text of a block: words, or name, law or formula, and equation."""
    if block.name in WORDS:
        return WORDS[block.name].format(sizes=sizes)
    formula = re.sub(r"(\w+)\([^()]*\)", r"\1", block.formula) if "," in block.formula else block.formula
    for code, sign in SIGNS.items():
        formula = formula.replace(code, sign)
    formula = formula.replace(" + ", "\n+ ") if len(formula) > 24 else formula
    name = "" if block.name == "return" else block.name
    return "\n".join(filter(None, (name, block.law.replace("_", " ") or formula, block.equation)))


def _surface_name(experiment: str) -> str:
    """Word for the surface of an experiment, by the name of its law in the experiment's file."""
    return f"surface ({load(experiment).surface.__struct_config__.tag})"


def _canvas(width: float, height: float, size: float) -> tuple[Figure, Axes]:
    """A figure of this height [inches] without axes, and its panel of width and height in the units of the places."""
    drawing, (axis,) = style.grid((11.0, size))
    axis.set(xlim=(0.0, width), ylim=(-0.3, height))
    axis.set_axis_off()
    return drawing, axis


def _left(place: Place) -> Place:
    return place[0] - WIDTH / 2, place[1]


def _right(place: Place) -> Place:
    return place[0] + WIDTH / 2, place[1]


def _draw_box(axis: Axes, place: Place, text: str, face: str = style.GRID) -> None:
    """A block with its text; blocks outside of the program's step are grey."""
    from matplotlib.patches import FancyBboxPatch

    corner, shape = (place[0] - WIDTH / 2, place[1] - HEIGHT / 2), "round,pad=0,rounding_size=0.08"
    look: dict[str, Any] = {"facecolor": face, "edgecolor": style.INK, "linewidth": 1.1, "zorder": 3}
    axis.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, boxstyle=shape, **look))
    axis.text(*place, text, ha="center", va="center", fontsize=9.0, color=style.INK, zorder=4)


def _draw_wire(axis: Axes, points: Sequence[Place], text: str = "", *, dashed: bool = False) -> None:
    """An arrow along points, its text beside the middle of its longest piece."""
    line: dict[str, Any] = {"color": style.QUIET, "linewidth": 1.1, "linestyle": "--" if dashed else "-"}
    *_, last, end = points
    if len(points) > 2:
        axis.plot(*np.transpose(points[:-1]), **line)
    arrow = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, **line}
    axis.annotate("", end, last, arrowprops=arrow, zorder=2)
    a, b = max(pairwise(points), key=lambda piece: float(np.hypot(*np.subtract(*piece))))
    upright = a[0] == b[0]
    x, y = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    put: dict[str, Any] = {"ha": "left", "va": "center"} if upright else {"ha": "center", "va": "bottom"}
    axis.text(x + 0.07 * upright, y + 0.05 * (not upright), text, fontsize=8.5, color=style.QUIET, **put)


def _draw_steps(axis: Axes, blocks: Mapping[str, Block], places: Mapping[str, Place], sizes: str) -> None:
    """All blocks, and a wire from each to those that use its value."""
    for name, block in blocks.items():
        _draw_box(axis, places[name], label(block, sizes), style.CARD)
        sources = block.inputs & blocks.keys()
        values = {source for source in sources if blocks[source].law != source}
        for source in sorted(values or sources):  # a memory connects steps that no value connects
            _draw_wire(axis, _route(places[source], places[name]))


def _route(start: Place, end: Place) -> list[Place]:
    """Corners of a wire between two blocks: straight where they share a row or a column, else with one bend."""
    (x0, y0), (x1, y1) = start, end
    vertical = HEIGHT / 2 if y1 > y0 else -HEIGHT / 2
    if x0 == x1:
        return [(x0, y0 + vertical), (x1, y1 - vertical)]
    side, middle = WIDTH / 2 if x1 > x0 else -WIDTH / 2, (x0 + x1) / 2
    bend = [] if y0 == y1 else [(middle, y0), (middle, y1)]
    return [(x0 + side, y0), *bend, (x1 - side, y1)]


def _loop(
    blocks: Mapping[str, Block], places: Mapping[str, Place], experiment: str, sizes: str = ""
) -> Figure:
    """Steps of a controller around the arm, to the right of "return", on the surface of a shipped experiment."""
    drawing, axis = _canvas(12.0, 4.5, 5.0)
    _draw_steps(axis, blocks, places, sizes)
    plant, low = (places["return"][0] + 2.1, places["return"][1]), -0.15
    _draw_box(axis, plant, f"arm on a\n{_surface_name(experiment)}")
    _draw_wire(axis, [_right(places["return"]), _left(plant)])
    rows = {given: [_left(places[name]) for name in _users(blocks, given)] for given in ("task", "sense")}
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
        _draw_wire(axis, [(x, row), (end, row)])


def _next_weights(axis: Axes, learning: Place, network: Place) -> None:
    x, low, high = learning[0], learning[1] + HEIGHT / 2, network[1] - HEIGHT / 2
    _draw_wire(axis, [(x, low), (x, high)], "weights of the next tick", dashed=True)


def _hybrid_controller() -> Figure:
    return _loop(blocks_of(hybrid, "Hybrid.step"), HYBRID, "foam-hybrid")


def _neural_controller() -> Figure:
    sizes = _sizes(layers_of(NET.sizes, NET.weights))
    drawing = _loop(blocks_of(neural, "Neural.step"), CONTROLLER, "foam-neural", sizes)
    _next_weights(drawing.axes[0], CONTROLLER["net.learn"], CONTROLLER["net.forward"])
    return drawing


def _identifier() -> Figure:
    """The network beside the surface in the force loop."""
    tag = load("foam-rls").controller.__struct_config__.tag
    drawing, axis = _canvas(10.2, 4.0, 4.4)
    law, arm, surface, corner = (1.2, 3.0), (4.0, 3.0), (6.0, 3.0), (8.0, 3.0)
    boxes = {law: f"{tag} controller\n(4.13)", arm: "arm", surface: _surface_name("foam-rls")}
    for place, text in boxes.items():
        _draw_box(axis, place, text)
    _draw_wire(axis, [_right(law), _left(arm)], "torque")
    _draw_wire(axis, [_right(arm), _left(surface)])
    _draw_wire(axis, [(arm[0], arm[1] - HEIGHT / 2), (arm[0], 1.6 + HEIGHT / 2)], ", ".join(SIGNALS[:3]))
    _draw_wire(axis, [_right(surface), corner, (8.0, 1.6 + HEIGHT / 2)], SIGNALS[3])
    _draw_wire(axis, [corner, (9.4, 3.0), (9.4, 3.8), (1.2, 3.8), (1.2, 3.0 + HEIGHT / 2)])
    sizes = _sizes(NetworkChoice().probe("foam", 0).layers)
    _draw_steps(axis, blocks_of(neural_probe, "absorb"), IDENTIFIER, sizes)
    _next_weights(axis, IDENTIFIER["descend"], IDENTIFIER["answer"])
    return drawing


def _control_network() -> Figure:
    """The 9-12-3 network of the controller, with the weights that the listing prints."""
    pose, motors = ("x", "y", "φ"), (1, 2, 3)
    before, torques = (f"{axis} of the tick before" for axis in pose), (f"torque {motor}" for motor in motors)
    names = zip(("f_x [N]", "f_y [N]", "moment [N m]"), NET.amplitude, strict=True)
    outputs = [f"{name}, up to {amplitude:g}" for name, amplitude in names]
    return _neurons(layers_of(NET.sizes, NET.weights), [*pose, *before, *torques], outputs, 5.4)


def _identifier_network() -> Figure:
    """The 3-4-1 network of the identifier, with the weights of its first start."""
    scales = zip(SETTINGS["foam"].scale, CHANNELS, strict=True)
    inputs, choice = [f"{scale:g} × {channel}" for scale, channel in scales], NetworkChoice()
    outputs = [f"force [N], up to {choice.amplitude:g}"]
    return _neurons(choice.probe("foam", 0).layers, inputs, outputs, 3.0)


def _sizes(layers: Sequence[Array]) -> str:
    """Neurons of each layer: "9-12-3"."""
    return "-".join(map(str, [layers[0].shape[1] - 1, *map(len, layers)]))


def _neurons(layers: Sequence[Array], inputs: Sequence[str], outputs: Sequence[str], height: float) -> Figure:
    """A circle a neuron, and a line a weight, darker for a larger one."""
    drawing, axis = _canvas(10.0, height, height)
    columns = [
        [(3.0 + 2.0 * i, height * (k + 0.5) / n) for k in reversed(range(n))]
        for i, n in enumerate([layers[0].shape[1] - 1, *map(len, layers)])
    ]
    for (before, after), weights in zip(pairwise(columns), layers, strict=True):
        strengths = np.abs(weights[:, 1:]) / np.abs(weights[:, 1:]).max()
        for (j, i), strength in np.ndenumerate(strengths):
            look = {"linewidth": 0.3 + strength, "alpha": 0.2 + 0.6 * strength}
            axis.plot(*np.transpose([before[i], after[j]]), color=style.QUIET, **look)
    for column, face in zip(columns, (style.CARD, style.SERIES[0], style.SERIES[0]), strict=True):
        axis.plot(*np.transpose(column), "o", markersize=11, markerfacecolor=face, color=style.INK)
    for names, column, side in ((inputs, columns[0], -0.25), (outputs, columns[-1], 0.25)):
        for name, (x, y) in zip(names, column, strict=True):
            axis.text(x + side, y, name, ha="right" if side < 0 else "left", va="center", fontsize=8.5)
    return drawing


STUDIES = (
    Diagram("4.3", _hybrid_controller),
    Diagram("4.5", _neural_controller),
    Diagram("4.6", _control_network),
    Diagram("5.2", _identifier),
    Diagram("5.3", _identifier_network),
)
