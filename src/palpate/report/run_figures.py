"""The figures of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.bench.sequence import CONTACT, LOST
from palpate.records import Record
from palpate.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE = 1.0
"""Seconds before contact that are still shown."""
FRONT_ENDS = {
    "thesis": ("filtered as in the thesis", style.ORANGE),
    "raw": ("raw signals", style.GREY),
    "matched": ("channels matched in lag", style.BLUE),
}


def draw(record: Record, folder: Path) -> dict[str, str]:
    """Draws all figures of a run into a folder: file name and caption of each, in the order to be read."""
    captions = {"approach.png": _approach(record, folder / "approach.png")}
    if (record["phase"] == CONTACT).any():
        captions["force.png"] = _force(record, folder / "force.png")
        captions["identification.png"] = _identification(record, folder / "identification.png")
    captions["torque.png"] = _torque(record, folder / "torque.png")
    return captions


def _approach(record: Record, path: Path) -> str:
    drawing, (position, force) = style.figure(2, height=2.1)
    t, wall = record["t"], record.meta["experiment"]["wall"]["x"]
    _shade(position, record)
    _shade(force, record)
    position.axhline(1e3 * wall, color=style.RED, linewidth=1, label="surface at rest")
    position.plot(t, 1e3 * record["x_desired"], color=style.GREY, linewidth=1, label="desired")
    position.plot(t, 1e3 * record["x"], color=style.BLUE, linewidth=1.4, label="tip")
    position.set_ylabel("x [mm]")
    style.legend(position)
    force.plot(t, record["force_measured"], color=style.BLUE, linewidth=0.8, label="measured")
    force.plot(t, record["force_desired"], color=style.ORANGE, linewidth=1.2, label="desired")
    force.set(ylabel="force [N]", xlabel="time [s]")
    style.legend(force)
    style.save(drawing, path)
    return (
        "The whole run. Steps of the desired position while the arm looks for the surface; friction makes the tip "
        "follow late. Shaded: force control. Red shade: contact lost."
    )


def _force(record: Record, path: Path) -> str:
    drawing, (axis,) = style.figure(1, height=3.4)
    since, shown = _around_contact(record)
    axis.plot(
        since, record["force_measured"][shown], color="#a9c8e4", linewidth=0.7, label="measured, filtered"
    )
    axis.plot(since, record["force"][shown], color=style.BLUE, linewidth=1.4, label="true")
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)[shown]
    axis.plot(since, desired, color=style.ORANGE, linewidth=1.4, label="desired")
    switch = record.meta["experiment"]["approach"]["switch"]
    axis.axhline(switch, color=style.GREY, linewidth=0.8, linestyle="--", label=f"switch, {switch:g} N")
    for i in (1, 2, 3):
        _mark(axis, since, record[f"saturated{i}"][shown], f"motor {i} at its limit")
    axis.set(xlabel="time since the switch to force control [s]", ylabel="force on the surface [N]")
    style.legend(axis)
    style.save(drawing, path)
    return "Contact force. The true force is what the simulated surface feels; the controller sees the measured one."


def _identification(record: Record, path: Path) -> str:
    drawing, axes = style.figure(3, height=2.0)
    since, shown = _around_contact(record)
    truth: dict[str, Any] = record.meta["truth"]
    for axis, (name, unit) in zip(axes, (("K", "N/m"), ("B", "N s/m"), ("M", "kg")), strict=True):
        for front, (label, color) in FRONT_ENDS.items():
            estimate = record[f"{name}_{front}"][shown]
            axis.plot(since, estimate, color=color, linewidth=1.4, label=label)
        value, std = record[f"{name}_matched"][shown], record[f"{name}_matched_std"][shown]
        axis.fill_between(
            since, value - 1.96 * std, value + 1.96 * std, color=style.BLUE, alpha=0.12, linewidth=0
        )
        if name in truth:
            axis.axhline(truth[name]["value"], color=style.RED, linewidth=1, linestyle="--", label="truth")
        _limits(axis, record, name, shown)
        axis.set_ylabel(f"{name} [{unit}]")
    style.legend(axes[0])
    axes[-1].set_xlabel("time since the switch to force control [s]")
    style.save(drawing, path)
    return (
        "Recursive least squares, fed in three ways. Shaded: 95 % interval of the matched one. The first moments, "
        "where the estimates come from far away, are cut off."
    )


def _limits(axis: Axes, record: Record, name: str, shown: NDArray[np.bool_]) -> None:
    """Shows where the estimates come to rest, and the truth, not where they come from."""
    half = np.nonzero(shown)[0][-max(1, int(0.75 * shown.sum())) :]
    seen = [record[f"{name}_{front}"][half] for front in FRONT_ENDS]
    if name in record.meta["truth"]:
        seen.append(np.array([record.meta["truth"][name]["value"]]))
    low = min(float(np.quantile(s, 0.02)) for s in seen)
    high = max(float(np.quantile(s, 0.98)) for s in seen)
    margin = 0.25 * max(high - low, 1e-9)
    axis.set_ylim(low - margin, high + margin)


def _torque(record: Record, path: Path) -> str:
    drawing, axes = style.figure(3, height=1.5)
    t, limits = record["t"], record.meta["experiment"]["robot"]["torque_limits"]
    for i, (axis, limit) in enumerate(zip(axes, limits, strict=True), start=1):
        _shade(axis, record)
        torque = record[f"torque{i}"]
        axis.plot(t, torque, color=style.BLUE, linewidth=0.7)
        _mark(axis, t, record[f"saturated{i}"], "at the limit")
        if len(t) and np.max(np.abs(torque)) > 0.7 * limit:
            for sign in (-1, 1):
                axis.axhline(sign * limit, color=style.RED, linewidth=0.8, linestyle="--")
        axis.set_ylabel(f"motor {i} [N m]")
    axes[-1].set_xlabel("time [s]")
    style.save(drawing, path)
    return "Torque as applied. Dashed: the limit, where the torque comes near it."


def _around_contact(record: Record) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Time since contact [s] where it is shown, and which rows those are."""
    t = record["t"]
    start = t[np.argmax(record["phase"] == CONTACT)]
    shown = t >= start - BEFORE
    return (t - start)[shown], shown


def _shade(axis: Axes, record: Record) -> None:
    t = record["t"]
    for phase, color in ((CONTACT, "#eaf2fa"), (LOST, "#fbe3e1")):
        inside = record["phase"] == phase
        axis.fill_between(
            t, 0, 1, where=inside, transform=axis.get_xaxis_transform(), color=color, linewidth=0, zorder=0
        )


def _mark(axis: Axes, t: NDArray[np.float64], flags: NDArray[np.float64], label: str) -> None:
    """Ticks at the lower edge where a flag is up."""
    up = flags > 0.0
    if up.any():
        axis.plot(
            t[up],
            np.full(up.sum(), 0.02),
            "|",
            color=style.RED,
            transform=axis.get_xaxis_transform(),
            label=label,
        )
