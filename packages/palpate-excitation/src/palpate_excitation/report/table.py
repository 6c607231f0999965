"""A designed excitation in a sentence, as tables, as JSON, and its force and experiment as files."""

from collections.abc import Sequence
from math import ceil, inf, isfinite
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files import FORCE, MADE, write_text
from palpate.logs import write_record
from palpate.records import Record
from palpate.references import Multisine
from palpate.report.page import CommandAnswer, Table
from palpate.units import plain, quantity
from palpate_excitation import Design, HybridLoop, Remedy
from palpate_excitation.problem import LONGEST


def answer_of(found: Design, helps: Sequence[Remedy]) -> CommandAnswer:
    """The answer of `palpate excite`: the wave, every surface, whether it is enough, and what else would be."""
    tables = [remedies_table(found, helps)] if helps else []
    said = f"\n{sentence(found)}"
    return CommandAnswer(summary(found, helps), describe_wave(found), said, [surfaces_table(found), *tables])


def sentence(found: Design) -> str:
    """Whether every surface is identified to the requested precision, and how long it takes."""
    asked = ", ".join(f"{name} {percent(share)}" for name, share in found.problem.precision.items())
    reached = half_widths_reached(found.made.worst(found.seconds), found)
    if found.feasible:
        lasts = quantity(found.seconds, "s", digits=3)
        says = f"In {lasts} this force identifies every surface of the range to the requested precision"
        return f"{says}: {asked} (95 %); predicted {reached}."
    limits = "No force within these limits identifies every surface to the requested precision"
    return f"{limits}, {asked} (95 %): at best {reached}."


def surfaces_table(found: Design) -> Table:
    """Each surface: its parameters, their predicted uncertainty, marked where it is not enough, and its force."""
    names, rows = found.predictions[0].names, []
    for one in found.predictions:
        widths = one.half_widths(found.seconds)
        values = dict(zip(("K", "B", "M"), one.surface.values, strict=True))
        bad = {name for name in names if widths[name] > found.problem.precision.get(name, inf)}
        rows.append(
            (
                *(plain(values[name], 4) for name in names),
                *(f"± {percent(widths[name])}{' ✕' if name in bad else ''}" for name in names),
                f"{one.force[0]:.1f} to {one.force[1]:.1f}",
                f"{1e6 * one.travel:.0f}",
            )
        )
    units = {"K": "N/m", "B": "N s/m", "M": "kg"}
    head = (*(f"{n} [{units[n]}]" for n in names), *(f"{n}, 95 %" for n in names), "force [N]", "travel [µm]")
    return Table("Each surface: the corners of the range and its middle", head, rows)


def remedies_table(found: Design, helps: Sequence[Remedy]) -> Table:
    """Changes of the problem, and whether each is enough."""
    rows = [(one.change, describe_remedy(one, found)) for one in helps]
    return Table("Remedies", ("", ""), rows)


def describe_remedy(remedy: Remedy, found: Design) -> str:
    """Whether a change would be enough, in words."""
    to = half_widths_reached(remedy.reached, found)
    if remedy.enough:
        return f"enough, {to}"
    later = f"; enough after {ceil(remedy.needed)} s" if remedy.needed <= LONGEST else ""
    return f"not enough, {to}{later}"


def describe_wave(found: Design) -> str:
    """The request, in a line."""
    budget, wave = found.problem.budget, found.wave
    if isinstance(wave, Multisine):
        low, high = wave.frequencies[0], wave.frequencies[-1]
        kind = f"multisine of {len(wave.frequencies)} sines, {low:g} to {high:.4g} Hz"
    else:
        how = "logarithmic" if wave.logarithmic else "linear"
        kind = f"{how} chirp, {wave.low:.4g} to {wave.high:.4g} Hz"
    _, force = found.force()
    lasts = f"{found.seconds:g} s" + (f" after {found.settle:g} s of settling" if found.settle else "")
    return f"{kind}: {force.min():.1f} to {force.max():.1f} N about {budget.mean:g} N, {lasts}"


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.2g} %" if share < 1 else "> 100 %"


def half_widths_reached(widths: dict[str, float], found: Design) -> str:
    """The half-widths of what was asked for."""
    return ", ".join(f"{name} {percent(widths[name])}" for name in found.problem.precision)


_APPROACH = 30.0  # s that an experiment may take beyond its press


def write_force(found: Design, path: Path, rate: float) -> None:
    """The desired force at so many rows a second, as CSV or Parquet by the name's ending.

    Raises:
        InputError: another ending, or no such folder.
    """
    check_ending(path)
    time, force = found.force(rate)
    if path.suffix.lower() == ".parquet":
        meta = {"source": "palpate excite", "design": summary(found, [])}
        write_record(
            Record({"time": time, "force_desired": force}, {"time": "s", "force_desired": "N"}, meta), path
        )
        return
    import polars

    table = polars.DataFrame(dict(zip(FORCE, (time, force), strict=True)))
    write_text(path, table.write_csv(float_precision=6))


def check_ending(path: Path) -> None:
    """Refuse a name that is neither CSV nor Parquet, before any work is done.

    Raises:
        InputError: it is.
    """
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise InputError(f"{path}: the desired force is written as .csv or .parquet; choose one of them")


def experiment(found: Design) -> str:
    """TOML that `palpate run` takes: the excitation on the surface in the middle of the range."""
    problem, wave = found.problem, found.wave
    middle = found.predictions[0].surface
    press = found.settle + found.seconds
    lines = [
        f"{MADE} excite.",
        'title = "A designed excitation"',
        "",
        "[run]",
        f"press = {press:.10g}",
        f"duration = {press + _APPROACH:.10g}",
        "",
        "[surface]",
        'kind = "kelvin-voigt"',
        f"stiffness = {middle.stiffness:.6g}",
        f"damping = {middle.damping:.6g}",
        f"mass = {middle.mass:.6g}",
        "",
        "[force]",
        f"first = {problem.budget.mean:.10g}",
        "",
    ]
    if isinstance(wave, Multisine):
        lines += [
            "[force.multisine]",
            *(f"{key} = {_list(values)}" for key, values in wave._asdict().items()),
        ]
    else:
        lines += ["[force.chirp]", *(f"{key} = {_plain(value)}" for key, value in wave._asdict().items())]
    if isinstance(problem.loop, HybridLoop):
        loop = problem.loop
        lines += [
            "",
            "[controller]",
            'kind = "hybrid"',
            f"kf = {loop.gain:.6g}",
            f"ki = {1e-3 * loop.integral:.6g}",
        ]
    return "\n".join(lines) + "\n"


def summary(found: Design, remedies: Sequence[Remedy]) -> dict[str, Any]:
    """All of a design as plain JSON values."""
    problem = found.problem
    return {
        "kind": problem.kind,
        "feasible": found.feasible,
        "duration_s": found.seconds,
        "settle_s": found.settle,
        "mean_N": problem.budget.mean,
        "wave": found.wave._asdict(),
        "asked": dict(problem.precision),
        "reached": found.made.worst(found.seconds),
        "surfaces": [
            {
                **dict(zip(("K", "B", "M"), prediction.surface.values, strict=True)),
                "half_width": prediction.half_widths(found.seconds),
                "force_N": list(prediction.force),
                "travel_m": prediction.travel,
            }
            for prediction in found.predictions
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


def _list(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"


def _plain(value: float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:.6g}"
