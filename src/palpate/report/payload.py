"""A weighed tool: its answer, its chart, its page."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.contact_frame.tool_payload import Weighed
from palpate.contact_frame.weighing import Estimated
from palpate.report.chart import Chart, Series, build_figure, panels
from palpate.report.page import Answer, Table, answer_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NAMES = {
    "mass": "mass",
    "centre": "centre of mass, tool's axes",
    "weight": "weight, base's axes",
    "bias": "bias of the force, tool's axes",
    "drift": "drift of the bias",
    "torque_bias": "bias of the torque, tool's axes",
    "inertia": "inertial mass",
}


def line(weighed: Weighed) -> str:
    """The answer in one sentence."""
    if weighed.payload is None:
        return f"The poses do not determine the tool's mass: {'; '.join(weighed.lacking)}."
    mass = weighed.parameters["mass"]
    value, half = float(mass.value), float(mass.half)
    return f"The tool weighs {value:.4g} +- {half:.2g} kg (95 %, {weighed.poses} orientations)."


def build_answer(weighed: Weighed, log: str = "") -> Answer:
    """The answer of `palpate payload`.

    Args:
        weighed: the tool.
        log: name of its log.
    """
    notes = [f"{note['code']}: {note['text']}" for note in weighed.notes]
    return Answer(
        weighed.to_json(), log, sentence=line(weighed), tables=[_numbers_table(weighed)], notes=notes
    )


def _numbers_table(weighed: Weighed) -> Table:
    rows = [
        (_NAMES[name] + axis, f"{value:.4g}", _half(half), number.unit)
        for name, number in weighed.parameters.items()
        for axis, value, half in _components(number)
    ]
    return Table("", ("", "value", "+- 95 %", "unit"), rows)


def _components(number: Estimated) -> list[tuple[str, float, float]]:
    values, halves = np.atleast_1d(number.value), np.atleast_1d(number.half)
    axes = [""] if len(values) == 1 else [", x", ", y", ", z"]
    return [(a, float(v), float(h)) for a, v, h in zip(axes, values, halves, strict=True)]


def _half(half: float) -> str:
    return f"{half:.2g}" if np.isfinite(half) else "not determined"


def draw(weighed: Weighed) -> Figure:
    """The force in each orientation, measured and predicted from tool and bias."""
    return build_figure([force_chart(weighed)])


def force_chart(weighed: Weighed) -> Chart:
    """The force in each orientation: small dots measured, large pale dots predicted from tool and bias."""
    places = np.arange(1.0, len(weighed.shown) + 1.0)
    dots = []
    for i, axis in enumerate("xyz"):
        measured, predicted = weighed.shown[:, 0, i], weighed.shown[:, 1, i]
        dots += [
            Series(places, predicted, f"s{i}", dots=9.0, alpha=0.3),
            Series(places, measured, f"s{i}", axis, dots=4.0),
        ]
    return Chart("force in the tool's axes [N]", dots, x="orientation", height=2.8)


def page(weighed: Weighed, title: str = "a record") -> str:
    """The page of `palpate payload --report`."""
    caption = (
        "The force in each orientation: measured (small) and predicted from tool and bias (large, pale)."
    )
    answer = replace(
        build_answer(weighed),
        title=f"Payload of the sensor, from {title}",
        notes=[*(note["text"] for note in weighed.notes), *weighed.lacking],
        figures=[{"panels": panels([force_chart(weighed)]), "caption": caption}],
        source=("The tool", "" if weighed.payload is None else weighed.payload.to_toml()),
    )
    return answer_page(answer, room="payload", command=f"palpate payload {title}")
