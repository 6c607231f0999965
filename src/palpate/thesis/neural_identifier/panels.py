"""The figure of explanation 4: the learned force, K and M from it, and every variation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from palpate.report import style
from palpate.thesis.least_squares import panels
from palpate.thesis.neural_identifier import network
from palpate.thesis.neural_identifier.ablation import MANY_STARTS, Surface
from palpate.thesis.neural_identifier.network import STARTS, Choice

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

SHOWN_STARTS = STARTS[:6]
TITLES = (
    "Force as the network knows it, at rest, foam",
    "K from that, by the probe's displacement",
    "K by probing, slope at rest, over f/x: foam",
    "The same: rubber",
    "M of each start: foam",
    "The same: rubber",
    "K over f/x as contact lasts, foam: five starts",
    "K over f/x, varied conditions",
)


def causes(data: Mapping[str, Surface], fixed: Choice, straight: Choice) -> Figure:
    """Eight panels; `fixed` and `straight` are shown beside the networks as chosen in (a) and (b)."""
    drawing, axes = panels.grid(5)
    tall = _merge(drawing, axes)
    eight = [axes[0], axes[1], *tall, axes[6], axes[7], axes[8], axes[9]]
    for axis, letter, title in zip(eight, "abcdefgh", TITLES, strict=True):
        panels.titled(axis, letter, title)
    foam = data["foam"]
    kinds = {
        "as chosen": (Choice(), style.SERIES[0]),
        "thresholds at zero": (fixed, style.SERIES[1]),
        "zero, 200 N, 0.1": (straight, style.SERIES[2]),
    }
    _known(eight[0], eight[1], foam, kinds)
    for axis, surface in zip(eight[2:4], data.values(), strict=True):
        _toggles(axis, surface, named=surface is foam)
    for axis, surface in zip(eight[4:6], data.values(), strict=True):
        _masses(axis, surface)
    _lasting(eight[6], foam)
    _varied(eight[7], data)
    return drawing


def _merge(drawing: Figure, axes: list[Axes]) -> list[Axes]:
    """The second and third row made one, for the long list of changes."""
    grid = cast("GridSpec", axes[2].get_gridspec())
    for axis in axes[2:6]:
        axis.remove()
    tall = [drawing.add_subplot(grid[1:3, column]) for column in (0, 1)]
    for axis in tall:
        axis.grid(visible=True, axis="x", color=style.GRID, linewidth=0.8)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    return tall


def _known(force: Axes, stiffness: Axes, surface: Surface, kinds: Mapping[str, tuple[Choice, str]]) -> None:
    press = surface.press
    x = np.linspace(0.0, 2.0 * press.rest, 80)
    truth = press.force[-500:].mean() + surface.stiffness * (x - press.rest)
    for label, (choice, color) in kinds.items():
        for start in SHOWN_STARTS:
            probe, _ = network.learned(press, choice, start)
            known = np.array([probe.force((d, 0.0, 0.0)) for d in x])
            force.plot(
                1e3 * x, known, color=color, linewidth=0.9, alpha=0.8, label=label if start == 0 else None
            )
            stiffness.plot(
                1e3 * x[1:], known[1:] / x[1:] / press.ratio, color=color, linewidth=0.9, alpha=0.8
            )
    force.plot(1e3 * x, truth, color=style.INK, linewidth=1.3, linestyle="--", label="the surface")
    stiffness.plot(
        1e3 * x[1:], truth[1:] / x[1:] / press.ratio, color=style.INK, linewidth=1.3, linestyle="--"
    )
    stiffness.axhline(1.0, color=style.MEASURED, linewidth=0.8)
    asked = 1e3 * Choice().probe(press.surface, 0).values[0]
    for axis in (force, stiffness):
        axis.axvspan(0.0, 1e3 * press.inputs[:, 0].max(), color=style.MEASURED, alpha=0.12, linewidth=0)
        axis.axvline(asked, color=style.FAIL, linewidth=0.9, linestyle=":")
        axis.set(xlim=(0.0, 2e3 * press.rest), xlabel="x [mm]; shaded: learned; dotted: probe")
    force.set(ylim=(-2.0, 40.0), ylabel="force [N]")
    stiffness.set(ylim=(0.0, 3.0), ylabel="K over f/x")
    force.legend(fontsize=7, frameon=False, ncols=2, loc="lower right")


def _toggles(axis: Axes, surface: Surface, *, named: bool) -> None:
    names = list(surface.toggled)
    for i, name in enumerate(names):
        some = surface.toggled[name]
        warned = all(look.warned for look in some)
        over, slopes = [look.over for look in some], [look.tangent for look in some]
        _strip(axis, over, i - 0.16, style.FAIL if warned else style.SERIES[0])
        _strip(axis, slopes, i + 0.16, style.SERIES[1])
    axis.axvline(1.0, color=style.MEASURED, linewidth=1.0)
    axis.axvline(surface.perfect, color=style.SERIES[0], linewidth=0.9, linestyle="--")
    axis.axvline(
        surface.stiffness / surface.press.ratio, color=style.SERIES[1], linewidth=0.9, linestyle="--"
    )
    axis.set_yticks(range(len(names)), names if named else [""] * len(names), fontsize=8)
    axis.set(xlim=(-0.6, 3.0), ylim=(len(names) - 0.5, -0.5))
    axis.set_xlabel("above: K; below: slope; dashed: no error", fontsize=8)


def _strip(axis: Axes, values: Sequence[float], y: float, color: str) -> None:
    axis.plot(values, np.full(len(values), y), ".", color=color, markersize=3.5, alpha=0.55)
    axis.plot(np.median(values), y, "|", color=style.INK, markersize=9, markeredgewidth=1.4)


def _masses(axis: Axes, surface: Surface) -> None:
    order = np.argsort(np.median(surface.masses, axis=0))
    rows = np.arange(len(MANY_STARTS))
    axis.plot(
        rows, surface.before[order], "o", color=style.MEASURED, markersize=4, fillstyle="none", label="before"
    )
    for seed in surface.masses[:, order]:
        axis.plot(rows, seed, ".", color=style.SERIES[0], markersize=3)
    axis.axhline(0.0, color=style.INK, linewidth=0.8)
    axis.set(xlabel="start, by its M", ylabel="$M_e$ [kg]")
    handles = [axis.lines[0], axis.lines[1]]
    axis.legend(
        handles, ["untrained", "after 4 s, each noise seed"], fontsize=7, frameon=False, loc="upper left"
    )


def _lasting(axis: Axes, surface: Surface) -> None:
    press = surface.long
    t = (np.arange(len(press.force)) + 1) * network.TICK
    for start in SHOWN_STARTS[:5]:
        _, curve = network.learned(press, Choice(), start)
        axis.plot(t, curve[:, 0] / press.ratio, color=style.SERIES[0], linewidth=0.9)
    axis.plot(t, press.squares[:, 2] / press.ratio, color=style.MEASURED, linewidth=1.0, linestyle="--")
    axis.axhline(surface.perfect, color=style.SERIES[0], linewidth=0.9, linestyle="--")
    axis.axhline(1.0, color=style.MEASURED, linewidth=0.8)
    axis.set(
        xscale="log", xlim=(0.01, t[-1]), ylim=(0.0, 2.0), xlabel="time since 5 N [s]; dashed: least squares"
    )
    axis.set_ylabel("K over f/x")


def _varied(axis: Axes, data: Mapping[str, Surface]) -> None:
    names = list(dict.fromkeys(name for s in data.values() for name in s.varied))
    for shift, (surface, color) in enumerate(zip(data.values(), style.SERIES[:2], strict=True)):
        for i, name in enumerate(names):
            if name in surface.varied:
                _strip(axis, [a.over for a in surface.varied[name]], i - 0.15 + 0.3 * shift, color)
    axis.axvline(1.0, color=style.MEASURED, linewidth=1.0)
    axis.set_yticks(range(len(names)), names, fontsize=7)
    axis.set(ylim=(len(names) - 0.5, -0.5), xlabel="K over f/x; above: foam, below: rubber")
