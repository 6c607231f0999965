"""Figures 4.5, 4.6, 5.2 and 5.3: block diagrams and networks, drawn from the program's own parts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench import load
from palpate.controllers import Neural, neural
from palpate.identifiers import neural_probe
from palpate.identifiers.neural_probe import CHANNELS, SETTINGS, SIGNALS
from palpate.networks import layers_of
from palpate.report import style
from palpate_thesis.blocks import blocks_of, values_written
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.diagram import (
    HEIGHT,
    Place,
    canvas,
    draw_box,
    draw_steps,
    draw_wire,
    left,
    loop_diagram,
    right,
    surface_name,
)
from palpate_thesis.drawing import Axes, Figure
from palpate_thesis.neural_identifier.network import NetworkChoice
from palpate_thesis.runs import Runs

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


@dataclass(frozen=True, eq=False)
class Diagram:
    """One figure without a claim; `draw` takes nothing but the program's parts."""

    NUMBER: str
    draw: Any

    def run(self, _: Runs) -> None:
        """Nothing has to be measured."""

    def check(self, _: None) -> Sequence[ThesisClaim]:
        """No claim: a diagram says how the parts are connected."""
        return []

    def plot(self, _: None) -> Figure:
        """The diagram of its number."""
        drawing: Figure = self.draw()
        return drawing


def controller() -> Figure:
    """Figure 4.5: the steps of the neural controller around the arm on the surface."""
    sizes = _sizes(layers_of(NET.sizes, NET.weights))
    drawing = loop_diagram(blocks_of(neural, "Neural.step"), CONTROLLER, "foam-neural", sizes)
    _next_weights(drawing.axes[0], CONTROLLER["net.learn"], CONTROLLER["net.forward"])
    return drawing


def _next_weights(axis: Axes, learning: Place, network: Place) -> None:
    x, low, high = learning[0], learning[1] + HEIGHT / 2, network[1] - HEIGHT / 2
    draw_wire(axis, [(x, low), (x, high)], "weights of the next tick", dashed=True)


def identifier() -> Figure:
    """Figure 5.2: the network beside the surface in the force loop."""
    experiment = load("foam-rls")
    blocks, sizes = blocks_of(neural_probe, "absorb"), _sizes(NetworkChoice().probe("foam", 0).layers)
    drawing, axis = canvas(10.2, 4.0, 4.4)
    law, arm, surface = (1.2, 3.0), (4.0, 3.0), (6.0, 3.0)
    draw_box(axis, law, f"{experiment.controller.__struct_config__.tag} controller\n(4.13)", plain=False)
    draw_box(axis, arm, "arm", plain=False)
    draw_box(axis, surface, surface_name("foam-rls"), plain=False)
    draw_wire(axis, [right(law), left(arm)], "torque")
    draw_wire(axis, [right(arm), left(surface)])
    draw_wire(axis, [(arm[0], arm[1] - HEIGHT / 2), (arm[0], 1.6 + HEIGHT / 2)], ", ".join(SIGNALS[:3]))
    draw_wire(axis, [right(surface), (8.0, 3.0), (8.0, 1.6 + HEIGHT / 2)], SIGNALS[3])
    draw_wire(axis, [(8.0, 3.0), (9.4, 3.0), (9.4, 3.8), (1.2, 3.8), (1.2, 3.0 + HEIGHT / 2)])
    draw_steps(axis, blocks, IDENTIFIER, sizes)
    _next_weights(axis, IDENTIFIER["descend"], IDENTIFIER["answer"])
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


def identifier_network() -> Figure:
    """Figure 5.3: the 3-4-1 network of the identifier, with the weights of its first start."""
    inputs = [
        f"{scale:g} × {channel}" for scale, channel in zip(SETTINGS["foam"].scale, CHANNELS, strict=True)
    ]
    layers = NetworkChoice().probe("foam", 0).layers
    return _neurons(layers, inputs, [f"force [N], up to {NetworkChoice().amplitude:g}"], 3.0)


def _sizes(layers: Sequence[Array]) -> str:
    """Neurons of each layer: "9-12-3"."""
    return "-".join(map(str, [layers[0].shape[1] - 1, *map(len, layers)]))


def _neurons(layers: Sequence[Array], inputs: Sequence[str], outputs: Sequence[str], height: float) -> Figure:
    """A circle a neuron, and a line a weight, darker for a larger one."""
    counts = [layers[0].shape[1] - 1, *map(len, layers)]
    drawing, axis = canvas(10.0, height, height)
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
    Diagram("5.3", identifier_network),
)
