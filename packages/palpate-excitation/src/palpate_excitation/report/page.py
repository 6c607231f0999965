"""The page of a designed excitation: whether it is enough, how well each surface will be known, and the force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.references import Multisine
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Interval, Mark, Series, figure_of, panels
from palpate.report.identification.words import CALLED
from palpate.report.page import Card, PageAnswer, answer_page
from palpate.units import plain, quantity
from palpate_excitation import Design, Remedy
from palpate_excitation.report.table import describe_wave, percent, remedies_table, sentence, surfaces_table

_SHOWN = 4.0
"""Of the desired force that is drawn of a multisine, after it has settled [s]; more would be a block of ink."""


def write_figure(found: Design, path: Path) -> Path:
    """Draw a design and write it as a PNG, atomically."""
    return style.save(figure_of(charts_of(found)), path)


def charts_of(found: Design) -> list[Chart]:
    """Desired force over time; its spectrum, on the surfaces too; predicted uncertainty over the duration."""
    return [_force(found), _spectrum(found), _uncertainty(found)]


def _force(found: Design) -> Chart:
    budget = found.problem.budget
    time, force = found.force()
    shown = time <= found.settle + _SHOWN if isinstance(found.wave, Multisine) else np.full(len(time), True)
    limits = (budget.mean - budget.swing, budget.mean + budget.swing)
    rest = "" if shown.all() else f", the first {time[shown][-1]:g} of {time[-1]:g} s"
    return Chart(
        "force [N]",
        [Series(time[shown], force[shown], "ink", "desired force", 0.8)],
        [
            Band(*_force_range(found), "F", "force on the surfaces"),
            Band(limits[0], limits[0], **KNOWN),
            Band(limits[1], limits[1], label="lowest and highest allowed", **KNOWN),
        ],
        x=f"time [s]{rest}", title="Desired force", height=2.8,
    )  # fmt: skip


def _spectrum(found: Design) -> Chart:
    frequencies, amplitudes, forces = lines_of(found)
    dots = 3.0 if isinstance(found.wave, Multisine) else 0.0
    felt = Interval(frequencies, forces.min(axis=0), forces.max(axis=0), "F", "on the surfaces")
    return Chart(
        "amplitude [N]", [Series(frequencies, amplitudes, "ink", "desired", 0.8, dots=dots)], intervals=[felt],
        x="frequency [Hz]", title="Spectrum", log="x", height=2.8,
    )  # fmt: skip


def _uncertainty(found: Design) -> Chart:
    seconds, known = curves(found)
    asked = {name: 100 * share for name, share in found.problem.precision.items() if name in known}
    return Chart(
        "95 % half-width [%]",
        [Series(seconds, 100 * widths.max(axis=0), name, name) for name, widths in known.items()],
        [Band(share, share, name, f"{name} asked", 0.9, "--") for name, share in asked.items()],
        [Mark([(found.seconds, found.seconds)], "measured", "this design")],
        x="duration [s]", title="Predicted uncertainty", log="xy", height=2.8,
        intervals=[
            Interval(seconds, 100 * widths.min(axis=0), 100 * widths.max(axis=0), name)
            for name, widths in known.items()
        ],
    )  # fmt: skip


def lines_of(found: Design) -> tuple[Array, Array, Array]:
    """Frequencies [Hz], amplitudes of the desired force [N], and those on each surface, shapes (n,), (n,), (s, n)."""
    wave = found.wave
    if isinstance(wave, Multisine):
        frequencies, amplitudes = np.array(wave.frequencies), np.array(wave.amplitudes)
    else:
        frequencies = np.geomspace(wave.low, wave.high, 100)
        amplitudes = np.full(len(frequencies), wave.amplitude)
    return frequencies, amplitudes, np.abs(found.problem.forces(2 * np.pi * frequencies, amplitudes))


def curves(found: Design) -> tuple[Array, dict[str, Array]]:
    """Durations [s], shape (n,), and each parameter's 95 % half-width as a share, on each surface, shape (s, n)."""
    seconds = np.geomspace(0.1 * found.seconds, 5 * found.seconds, 40)
    names = found.predictions[0].names
    return seconds, {
        name: np.array([[one.half_widths(t)[name] for t in seconds] for one in found.predictions])
        for name in names
    }


def _force_range(found: Design) -> tuple[float, float]:
    """Lowest and highest force on any surface [N]."""
    lows, highs = zip(*(one.force for one in found.predictions), strict=True)
    return min(lows), max(highs)


def page(found: Design, helps: Sequence[Remedy], command: str) -> str:
    """The page as HTML."""
    told = describe_wave(found)
    answer = PageAnswer(
        title="A desired force",
        sentence=sentence(found),
        about=f"{told[0].upper()}{told[1:]}.",
        alerts=[]
        if found.feasible
        else [{"tone": "fail", "title": "The precision cannot be had.", "text": ""}],
        cards={"": _cards(found)},
        tables=[*([remedies_table(found, helps)] if helps else []), surfaces_table(found)],
        figures=[
            {
                "panels": panels(charts_of(found)),
                "caption": "Uncertainty: lines the worst surface, shaded the others, dashed requested.",
            }
        ],
    )
    return answer_page(answer, room="excite", command=command)


def _cards(found: Design) -> list[Card]:
    """Each parameter on the surface that shows it worst, then how long and how hard."""
    worst = found.made.worst(found.seconds)
    cards = []
    for name in found.predictions[0].names:
        asked = found.problem.precision.get(name)
        tone, verdict = "none", "not asked for"
        if asked is not None:
            tone, verdict = ("ok", "enough") if worst[name] <= asked else ("fail", "not enough")
        why = "95 % half-width on the worst surface" + ("" if asked is None else f"; asked: {percent(asked)}")
        number = f"± {percent(worst[name])}"
        cards.append(
            Card(f"{name}, {CALLED[name]}", number, why=why, tone=tone, verdict=verdict, colour=name)
        )
    _, force = found.force()
    low, high = _force_range(found)
    settles = f" after {quantity(found.settle, 's', digits=2)} of settling" if found.settle else ""
    asked_of = f"on the surfaces; asked of the robot: {plain(force.min(), 3)} to {plain(force.max(), 3)} N"
    return [
        *cards,
        Card("Duration", quantity(found.seconds, "s", digits=3), why=f"of pressing{settles}"),
        Card("Force", f"{plain(low, 3)} to {plain(high, 3)}", "N", why=asked_of),
    ]
