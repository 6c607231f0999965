"""A designed excitation as files: the desired force over time, an experiment for the bench, one JSON object."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.excitation import Design, HybridLoop, Remedy
from palpate.files import FORCE, MADE, write_text
from palpate.logs import write_record
from palpate.records import Record
from palpate.references import Multisine

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
