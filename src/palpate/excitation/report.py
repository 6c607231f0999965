"""A designed excitation as a sentence, tables, JSON, a figure, the force over time, and an experiment."""

from collections.abc import Sequence
from math import ceil, inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.excitation.designs import Design, Remedy
from palpate.excitation.force_loops import HybridLoop
from palpate.excitation.problem import LONGEST, PARAMETERS
from palpate.files import FORCE, MADE, write_text
from palpate.logs import write_record
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Interval, Mark, Series, build_figure
from palpate.report.page import Answer, Table
from palpate.units import plain, quantity

_DRAWN = 4.0
"""Duration of the force that the figure shows after the settling time [s]; more would be a block of ink."""
_UNITS = {"K": "N/m", "B": "N s/m", "M": "kg"}


def build_answer(result: Design, remedies: Sequence[Remedy]) -> Answer:
    """The answer of `palpate excite`: the wave, whether it is sufficient, every surface, the remedies."""
    tables = [surfaces_table(result)]
    if remedies:
        rows = [(remedy.change, describe_remedy(remedy, result)) for remedy in remedies]
        tables.append(Table("Remedies", ("", ""), rows))
    return Answer(
        summary(result, remedies),
        describe_wave(result),
        context="\n",
        sentence=describe_result(result),
        tables=tables,
    )


def describe_result(result: Design) -> str:
    """Whether every surface is identified to the wanted precision, and in what time."""
    wanted = ", ".join(f"{name} {percent(target)}" for name, target in result.problem.precision.items())
    reached = describe_widths(result.worst(), result)
    if result.feasible:
        duration = quantity(result.seconds, "s", digits=3)
        says = f"In {duration} this force identifies every surface of the range to the requested precision"
        return f"{says}: {wanted} (95 %); predicted {reached}."
    limits = "No force within these limits identifies every surface to the requested precision"
    return f"{limits}, {wanted} (95 %): at best {reached}."


def describe_wave(result: Design) -> str:
    """The wave, the range of the force and the duration, in a line."""
    frequencies = result.wave.frequencies
    lines = f"multisine of {len(frequencies)} sines, {frequencies[0]:g} to {frequencies[-1]:.4g} Hz"
    force, settle = result.force()[1], result.problem.settle
    settling = f" after {settle:g} s of settling" if settle else ""
    mean = result.problem.budget.mean
    return (
        f"{lines}: {force.min():.1f} to {force.max():.1f} N about {mean:g} N, {result.seconds:g} s{settling}"
    )


def describe_remedy(remedy: Remedy, result: Design) -> str:
    """Whether a change would be enough."""
    reached = describe_widths(remedy.reached, result)
    if remedy.enough:
        return f"enough, {reached}"
    later = f"; enough after {ceil(remedy.needed)} s" if remedy.needed <= LONGEST else ""
    return f"not enough, {reached}{later}"


def describe_widths(widths: dict[str, float], result: Design) -> str:
    """Half-widths of the parameters that have a wanted precision."""
    return ", ".join(f"{name} {percent(widths[name])}" for name in result.problem.precision)


def percent(fraction: float) -> str:
    """A fraction in per cent."""
    return f"{100 * fraction:.2g} %" if fraction < 1 else "> 100 %"


def surfaces_table(result: Design) -> Table:
    """Each surface: its parameters, their predicted uncertainty with a mark where it is not enough, and its force."""
    names, rows = result.predictions[0].names, []
    for prediction in result.predictions:
        widths = prediction.half_widths(result.seconds)
        values = dict(zip(PARAMETERS, prediction.surface.values, strict=True))
        marks = {
            name: " ✕" if widths[name] > result.problem.precision.get(name, inf) else "" for name in names
        }
        rows.append(
            (
                *(plain(values[name], 4) for name in names),
                *(f"± {percent(widths[name])}{marks[name]}" for name in names),
                f"{prediction.force[0]:.1f} to {prediction.force[1]:.1f}",
                f"{1e6 * prediction.travel:.0f}",
            )
        )
    head = (
        *(f"{name} [{_UNITS[name]}]" for name in names),
        *(f"{name}, 95 %" for name in names),
        "force [N]",
        "travel [µm]",
    )
    return Table("Each surface: the corners of the range and its middle", head, rows)


def summary(result: Design, remedies: Sequence[Remedy]) -> dict[str, Any]:
    """A design as plain JSON values."""
    problem = result.problem
    return {
        "feasible": result.feasible,
        "duration_s": result.seconds,
        "settle_s": problem.settle,
        "mean_N": problem.budget.mean,
        "wave": result.wave._asdict(),
        "asked": dict(problem.precision),
        "reached": result.worst(),
        "surfaces": [
            {
                **dict(zip(PARAMETERS, prediction.surface.values, strict=True)),
                "half_width": prediction.half_widths(result.seconds),
                "force_N": list(prediction.force),
                "travel_m": prediction.travel,
            }
            for prediction in result.predictions
        ],
        "remedies": [
            {
                "change": remedy.change,
                "reached": remedy.reached,
                "enough": remedy.enough,
                "needed_s": remedy.needed if isfinite(remedy.needed) else None,
            }
            for remedy in remedies
        ],
    }


def write_force(result: Design, path: Path, rate: float) -> None:
    """Write the desired force at so many rows per second, as CSV or Parquet by the ending of the name.

    Raises:
        InputError: another ending, or a missing folder.
    """
    check_ending(path)
    time, force = result.force(rate)
    if path.suffix.lower() == ".parquet":
        meta = {"source": "palpate excite", "design": summary(result, [])}
        columns = {"time": time, "force_desired": force}
        write_record(Record(columns, {"time": "s", "force_desired": "N"}, meta), path)
        return
    import polars

    table = polars.DataFrame(dict(zip(FORCE, (time, force), strict=True)))
    write_text(path, table.write_csv(float_precision=6))


def check_ending(path: Path) -> None:
    """Refuse a name that is neither CSV nor Parquet, before any work is done.

    Raises:
        InputError: another ending.
    """
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise InputError(f"{path}: the desired force is written as .csv or .parquet; choose one of them")


_APPROACH = 30.0
"""Duration of an experiment beyond its press [s]."""


def experiment(result: Design) -> str:
    """TOML for `palpate run`: the excitation on the surface in the middle of the range."""
    problem, middle = result.problem, result.predictions[0].surface
    press = problem.settle + result.seconds
    controller = ""
    if isinstance(problem.loop, HybridLoop):
        controller = f"""
[controller]
kind = "hybrid"
kf = {problem.loop.gain:.6g}
ki = {1e-3 * problem.loop.integral:.6g}
"""
    wave = "\n".join(
        f"{name} = [{', '.join(f'{value:.6g}' for value in values)}]"
        for name, values in result.wave._asdict().items()
    )
    return f"""{MADE} excite.
title = "A designed excitation"

[run]
press = {press:.10g}
duration = {press + _APPROACH:.10g}

[surface]
kind = "kelvin-voigt"
stiffness = {middle.stiffness:.6g}
damping = {middle.damping:.6g}
mass = {middle.mass:.6g}

[force]
first = {problem.budget.mean:.10g}

[force.multisine]
{wave}
{controller}"""


def write_figure(result: Design, path: Path) -> Path:
    """Draw the desired force, its spectrum and the predicted uncertainty, and write them as a PNG."""
    return style.save(
        build_figure([_draw_force(result), _draw_spectrum(result), _draw_uncertainty(result)]), path
    )


def _draw_force(result: Design) -> Chart:
    budget = result.problem.budget
    time, force = result.force()
    drawn = time <= result.problem.settle + _DRAWN
    rest = "" if drawn.all() else f", the first {time[drawn][-1]:g} of {time[-1]:g} s"
    lowest, highest = zip(*(prediction.force for prediction in result.predictions), strict=True)
    low, high = budget.mean - budget.swing, budget.mean + budget.swing
    return Chart(
        "force [N]",
        [Series(time[drawn], force[drawn], "ink", "desired force", 0.8)],
        [
            Band(min(lowest), max(highest), "F", "force on the surfaces"),
            Band(low, low, **KNOWN),
            Band(high, high, label="lowest and highest allowed", **KNOWN),
        ],
        x=f"time [s]{rest}", title="Desired force", height=2.8,
    )  # fmt: skip


def _draw_spectrum(result: Design) -> Chart:
    frequencies, amplitudes = np.array(result.wave.frequencies), np.array(result.wave.amplitudes)
    forces: Array = np.abs(result.problem.forces(2 * np.pi * frequencies, amplitudes))
    return Chart(
        "amplitude [N]", [Series(frequencies, amplitudes, "ink", "desired", 0.8, dots=3.0)],
        intervals=[Interval(frequencies, forces.min(axis=0), forces.max(axis=0), "F", "on the surfaces")],
        x="frequency [Hz]", title="Spectrum", log="x", height=2.8,
    )  # fmt: skip


def _draw_uncertainty(result: Design) -> Chart:
    seconds = np.geomspace(0.1 * result.seconds, 5 * result.seconds, 40)
    widths = [[prediction.half_widths(t) for t in seconds] for prediction in result.predictions]
    lines, intervals, targets = [], [], []
    for name in result.predictions[0].names:
        in_percent = 100 * np.array([[width[name] for width in over_time] for over_time in widths])
        lines.append(Series(seconds, in_percent.max(axis=0), name, name))
        intervals.append(Interval(seconds, in_percent.min(axis=0), in_percent.max(axis=0), name))
        if name in result.problem.precision:
            target = 100 * result.problem.precision[name]
            targets.append(Band(target, target, name, f"{name} asked", 0.9, "--"))
    return Chart(
        "95 % half-width [%]", lines, targets, [Mark([(result.seconds, result.seconds)], "measured", "this design")],
        x="duration [s]", title="Predicted uncertainty", log="xy", height=2.8, intervals=intervals,
    )  # fmt: skip
