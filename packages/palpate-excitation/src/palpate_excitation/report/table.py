"""A designed excitation on the terminal: the wave, its predicted uncertainty on each surface, the remedies."""

from math import ceil, isfinite
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.errors import InputError
from palpate.files import FORCE, MADE, write_text
from palpate.logs import write_record
from palpate.records import Record
from palpate.references import Multisine
from palpate.report.terminal import bare_table
from palpate_excitation import Design, HybridLoop, Remedy
from palpate_excitation.force_loops import SurfaceResponse
from palpate_excitation.problem import LONGEST


def show(found: Design, remedies: list[Remedy], console: Console) -> None:
    """Print a design, and for an infeasible one what would help."""
    console.print(describe_wave(found))
    console.print(_table(found))
    console.print(_verdict(found))
    for remedy in remedies:
        console.print(f"  {remedy.change}: {describe_remedy(remedy, found)}")


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


def _table(found: Design) -> Table:
    names = found.predictions[0].names
    units = {"K": "N/m", "B": "N s/m", "M": "kg"}
    known, widths = [f"{name} [{units[name]}]" for name in names], [f"± {name}" for name in names]
    table = bare_table(*known, *widths, "force [N]", "travel")
    for prediction in found.predictions:
        table.add_row(*_row(prediction, found))
    return table


def _row(prediction: SurfaceResponse, found: Design) -> list[str | Text]:
    widths = prediction.half_widths(found.seconds)
    values = dict(zip(("K", "B", "M"), prediction.surface.values, strict=True))
    low, high = prediction.force
    return [
        *(f"{values[name]:.4g}" for name in prediction.names),
        *(_width(widths[name], found.problem.precision.get(name)) for name in prediction.names),
        f"{low:.1f}-{high:.1f}",
        f"{1e6 * prediction.travel:.0f} um",
    ]


def _width(width: float, asked: float | None) -> Text:
    style = "" if asked is None else "green" if width <= asked else "red"
    return Text(percent(width), style=style)


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.2g} %" if share < 1 else "> 100 %"


def _verdict(found: Design) -> str:
    worst = found.made.worst(found.seconds)
    asked = ", ".join(f"{name} {percent(share)}" for name, share in found.problem.precision.items())
    if found.feasible:
        return f"every surface to within {asked} (95 %): yes, predicted {half_widths_reached(worst, found)}"
    return f"every surface to within {asked} (95 %): no; the best is {half_widths_reached(worst, found)}. Remedies:"


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


def summary(found: Design, remedies: list[Remedy]) -> dict[str, Any]:
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
