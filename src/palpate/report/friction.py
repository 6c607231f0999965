"""Friction of an axis: its answer, its chart, its page."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from palpate.arrays import Array, Mask
from palpate.contact_frame.axis_friction import NAMES, AxisFriction
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.chart import Chart, Interval, Series, build_figure, panels
from palpate.report.page import Answer, Table, answer_page
from palpate.units import NONE, quantity, quantity_between

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def line(friction: AxisFriction) -> str:
    """The answer in one sentence."""
    identified = [
        f"{NAMES[name]} {number(p)}"
        for name, p in friction.parameters.items()
        if p.verdict is Verdict.IDENTIFIED
    ]
    if not identified:
        return f"No friction is identified: {friction.parameters['Fc'].reason}."
    return f"{', '.join(identified)} (95 %)."


def number(parameter: Parameter) -> str:
    """A value with the half-width of its interval, or the interval alone; a dash for neither."""
    if parameter.ci95 is None:
        return NONE
    low, high = parameter.ci95
    if parameter.value is None:
        return quantity_between(low, high, parameter.unit)
    return quantity(parameter.value, parameter.unit, (high - low) / 2)


def build_answer(friction: AxisFriction, log: str = "") -> Answer:
    """The answer of `palpate identify --friction`.

    Args:
        friction: identified from a log.
        log: name of the log.
    """
    rows = [(f"{NAMES[name]} {name}", number(p), str(p.verdict)) for name, p in friction.parameters.items()]
    reasons: dict[str, list[str]] = {}
    for name, p in friction.parameters.items():
        if p.verdict is not Verdict.IDENTIFIED:
            reasons.setdefault(p.reason, []).append(name)
    notes = [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]
    notes += [f"{note['code']}: {note['text']}" for note in friction.notes]
    table = Table("", ("", "95 %", "verdict"), rows)
    return Answer(friction.to_json(), log, sentence=line(friction), tables=[table], notes=notes)


def chart(friction: AxisFriction) -> Chart:
    """Friction over speed: means of blocks without offset, inertia and gravity, and the fit with its interval."""
    force, speed = friction.units
    x, y = friction.points.T
    at, middle, low, high = friction.curve.T
    return Chart(
        f"friction [{force}]",
        [
            Series(x, y, "s0", "means of the log", width=0.0, dots=2.5, alpha=0.5),
            *(Series(at[side], middle[side], "s1", label) for side, label in _sides(at)),
        ],
        intervals=[Interval(at[side], low[side], high[side], "s1") for side, _ in _sides(at)],
        x=f"speed [{speed}]",
        height=3.6,
    )


def _sides(speeds: Array) -> list[tuple[Mask, str]]:
    """Rows of each direction, and a label for the first."""
    sides = [speeds < 0.0, speeds > 0.0]
    return list(zip([side for side in sides if side.any()], ("fit, 95 %", ""), strict=False))


def draw(friction: AxisFriction) -> Figure:
    """Draw friction over speed."""
    return build_figure([chart(friction)])


def page(friction: AxisFriction, title: str = "a record", command: str = "") -> str:
    """The page of `palpate identify --friction --report`."""
    caption = "Friction over speed, without offset, inertia and the force that depends on the position."
    answer = replace(
        build_answer(friction),
        title=f"Friction of an axis, from {title}",
        figures=[{"panels": panels([chart(friction)]), "caption": caption}] if len(friction.points) else [],
    )
    return answer_page(answer, room="friction", command=command or "palpate.identify_friction(...)")
