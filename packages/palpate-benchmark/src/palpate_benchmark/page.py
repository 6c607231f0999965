"""The page of a result: its sentence, the leaderboard, a table an entry, and what the metrics mean."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.files import with_author, write_json, write_text
from palpate.report import style
from palpate.report.page import PageAnswer, Table, answer_page, with_captions
from palpate_benchmark.simulated import ForceResult
from palpate_benchmark.summary import (
    as_values,
    best_first,
    by_surface,
    description,
    leaderboard,
    numbers_of,
    sentence,
)

MEANINGS = (
    ("passed", "presses that settle, are at most 10 % over at the touch, and keep contact"),
    (
        "settling",
        "median over presses: from the first contact until the force stays within 5 % of the desired force",
    ),
    ("over", "largest force at the touch, over the desired force"),
    ("bounces; lost", "losses of contact before the force reaches half of the desired force; after that"),
    ("error; deviation", "mean and standard deviation of the error over the last second, rms over presses"),
    (
        "rise; step over",
        "10 to 90 % of a step of a quarter of the force, up and down; beyond it, over its height",
    ),
    ("Hz", "bandwidth: where force over desired force falls to 0.71, from a sum of ten sines of 3 % each"),
    ("sway", "rms error while the surface sways at 0.5 Hz, over that of a tip that rests: 1 rejects nothing"),
)
_CURVES = (
    ("settling_s", "settling [s]", 1.0),
    ("overshoot", "over [%]", 100.0),
    ("bandwidth_Hz", "bandwidth [Hz]", 1.0),
    ("disturbance", "disturbance", 1.0),
)
_DRAWN = 5
"""Entries that the figure shows."""


def write_page(results: Sequence[ForceResult], folder: Path, command: str) -> None:
    """Write `report.html`, its figures and `result.json` into a folder."""
    figures = {}
    if np.isfinite(results[0].surfaces[0].stiffness):
        figures[_metrics(results, folder / "metrics.png")] = "Metrics over stiffness, the best entries."
    figures[_forces(best_first(results)[0], folder / "forces.png")] = (
        "Force over time in the first press on each stiffness; dashed: desired."
    )
    several = len(results) > 1
    answer = PageAnswer(
        title="Test of force control",
        sentence=sentence(results),
        tables=[
            leaderboard(results) if several else by_surface(results[0]),
            Table("Metrics", ("", ""), MEANINGS),
        ],
        figures=with_captions(figures),
        folds=[_fold(one) for one in best_first(results) if several],
        source=("The test in numbers", json.dumps(description(results[0].plan))),
    )
    write_text(folder / "report.html", answer_page(answer, room="benchmark", command=command))
    write_json(folder / "result.json", with_author({"command": command, **as_values(results)}))


def _fold(one: ForceResult) -> tuple[str, str, Sequence[Sequence[str]]]:
    """Table of an entry, to be opened."""
    table = by_surface(one)
    return one.name, f"{one.passes} of {len(one.runs)}, by stiffness", [table.head, *table.rows]


def _metrics(results: Sequence[ForceResult], path: Path) -> Path:
    drawing, axes = style.grid((9.5, 5.4), 2, 2, sharex=True)
    for axis, (key, label, factor) in zip(axes, _CURVES, strict=True):
        for one, color in zip(best_first(results)[:_DRAWN], style.SERIES, strict=False):
            values = [numbers_of(own.runs)[key] for own in one.surfaces]
            y = [np.nan if value is None else factor * value for value in values]
            axis.plot(
                [own.stiffness for own in one.surfaces], y, "o-", color=color, label=style.literal(one.name)
            )
        axis.set(xscale="log", ylabel=label, ylim=(0.0, None))
    for axis in axes[2:]:
        axis.set_xlabel("stiffness [N/m]")
    if len(results) > 1:
        axes[0].legend(fontsize=8, frameon=False)
    return style.save(drawing, path)


def _forces(one: ForceResult, path: Path) -> Path:
    count = len(one.surfaces)
    drawing, axes = style.grid((9.5, 1.5 * count + 0.6), count, 1, sharex=True)
    desired = one.plan.desired_force()
    for axis, own in zip(axes, one.surfaces, strict=True):
        time = np.arange(len(own.force)) / one.plan.rate
        axis.plot(time, own.force, color=style.F, linewidth=0.9)
        if np.isfinite(own.stiffness):
            axis.plot(time, desired, **{**style.KNOWN, "linewidth": 0.8})
            axis.set_title(f"{own.stiffness:,.0f} N/m", fontsize=9, loc="right")
        else:
            axis.axhline(one.plan.force, **style.KNOWN)
        axis.set(ylabel="force [N]", xlim=(0.0, time[-1]))
    axes[-1].set_xlabel("time [s]")
    return style.save(drawing, path)
