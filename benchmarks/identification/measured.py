"""What `palpate identify` says of measured logs, one row each: of a folder with the logs of four laboratories.

    python benchmarks/identification/measured.py FOLDER
    python benchmarks/identification/measured.py FOLDER --logs skin_indentation

FOLDER holds lattice_probe/, mr_damper/, silverbox/ and skin_indentation/ as their authors published them; a log that is
not there is left out, and said. There is no truth: the table shows what is said, and what limits it. Of the logs that
hold the same press several times, each piece is then identified by itself: how the answers scatter over their own
intervals is chi2/dof.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.identification import Identification, Parameter, identify
from palpate.logs import read_log


@dataclass(frozen=True)
class Measured:
    """One log: where it lies, which columns it has, which rows are meant, and what is told."""

    path: str
    columns: dict[str, Any]
    told: dict[str, Any] = field(default_factory=dict)


_SKIN = {"time": "time_s", "position": "position_mm:mm", "force": "force_mN:mN"}
_DAMPER = {"time": "Tout:s", "position": "dist:mm", "force": "forc:N"}
LOGS = (
    Measured("lattice_probe/probe_states.csv", {"time": "0", "position": "3:mm", "force": "4:g"}),
    Measured("mr_damper/ensaio3.mat", _DAMPER, {"bonded": True}),
    Measured("mr_damper/ensaio3.mat", _DAMPER),
    Measured("mr_damper/ensaio10.mat", _DAMPER, {"bonded": True}),
    Measured(
        "silverbox/schroeder_80mV.csv",
        {"time": "time_s", "position": "position_V:1", "force": "force_V:1", "start": 17.343, "end": 19.019},
        {"bonded": True},
    ),
    *(Measured(f"skin_indentation/press_{size}mN.csv", _SKIN) for size in (20, 40, 400, 600, 800)),
    Measured("skin_indentation/press_250mN.ddf", {"position": "AI0", "force": "AI1"}),
)
HEAD = ("log", "model", "K", "B", "M", "working point", "lag", "warnings")


def row(log: Measured, found: Identification) -> tuple[str, ...]:
    """The cells of one log."""
    told = " bonded" if log.told.get("bonded") else ""
    return (
        Path(log.path).name + told,
        found.model,
        *(parameter(found, name) for name in ("K", "B", "M")),
        point(found),
        lag(found),
        ", ".join(found.codes) or "none",
    )


def parameter(found: Identification, name: str) -> str:
    """Value and half-width of what is identified; else the verdict."""
    own = found.parameters.get(name)
    if own is None:
        return "-"
    if own.value is None or own.ci95 is None:
        return str(own.verdict)
    shown = f"{own.value:.4g} ± {(own.ci95[1] - own.ci95[0]) / 2:.2g}"
    return shown if own.verdict == "identified" else f"({shown})"


def point(found: Identification) -> str:
    """The working point, its force and frequency, and what limits it."""
    if found.working_point is None:
        return "-"
    own, at = found.working_point.stiffness, found.working_point
    assert own.value is not None
    assert own.ci95 is not None
    half = (own.ci95[1] - own.ci95[0]) / 2
    limit = next(iter(own.budget), "noise")
    said = f"{own.value:.4g} ± {half:.2g} at {at.force_N:.3g}, {at.frequency_Hz:.3g} Hz, {at.source}; {limit}"
    return said if own.verdict == "identified" else f"({said})"


def lag(found: Identification) -> str:
    """Value, bound and where it is from."""
    if found.lag is None:
        return "-"
    return f"{1e3 * found.lag.value:.3g} ± {1e3 * found.lag.bound:.2g} ms, {found.lag.kind}"


@dataclass(frozen=True)
class Repeats:
    """Pieces of one log that are the same press once more.

    Args:
        log: which.
        length: of a piece [s]; each begins where the one before ends, at the log's first row.
        count: of pieces.
    """

    log: Measured
    length: float
    count: int

    def found(self, folder: Path) -> list[Identification]:
        """Each piece identified by itself; those without a working point are left out."""
        every = []
        for i in range(self.count):
            span = {"start": i * self.length, "end": (i + 1) * self.length}
            own = identify(read_log(folder / self.log.path, **self.log.columns, **span), **self.log.told)
            every += [own] if own.working_point is not None else []
        return every


_ONE_CARD = {"bonded": True, "lag": 0.0}
"""Force and position of the damper are read by one card at one instant."""
REPEATS = (
    Repeats(LOGS[0], 38.06, 9),
    Repeats(replace(LOGS[1], told=_ONE_CARD), 3.0, 5),
    Repeats(replace(LOGS[3], told=_ONE_CARD), 3.0, 5),
)
CHANCE = ("noise", "position noise", "blocks", "repetition")
"""Causes that differ from press to press. The others (a lag, a curve, a model that is not the surface's) are the same
in each, and are in the interval without making the answers scatter."""


def chi2(found: Sequence[Identification]) -> str:
    """Scatter of the working points, and of the stiffnesses that are given, over their intervals: chi2 / dof.

    First over the part of each interval that differs between repeats, which is about 1 if it is right; then over the
    whole of it.
    """
    rows = [("working point", [own.working_point.stiffness for own in found if own.working_point])]
    rows += [("K", [p for own in found if (p := own.parameters.get("K")) and p.verdict == "identified"])]
    return "; ".join(_scatter(name, points) for name, points in rows if len(points) > 1)


def _scatter(name: str, points: Sequence[Parameter]) -> str:
    value = np.array([p.value for p in points])
    whole = np.array([p.std for p in points])
    chance = np.array(
        [np.hypot.reduce([p.budget.get(cause, 0.0) for cause in CHANCE]) / 1.96 for p in points]
    )
    mean, between = float(value.mean()), float(np.std(value, ddof=1))
    return (
        f"{name} {mean:.4g} of {len(value)}, chi2/dof {_over(value, chance):.2g} over chance, {_over(value, whole):.2g}"
        f" over all; scatter {between / abs(mean):.1%}, chance {np.sqrt(np.mean(chance**2)) / abs(mean):.1%},"
        f" all {np.sqrt(np.mean(whole**2)) / abs(mean):.1%}"
    )


def _over(value: np.ndarray, std: np.ndarray) -> float:
    """Chi2 / dof about the weighted mean."""
    mean = float((value / std**2).sum() / (1 / std**2).sum())
    return float(((value - mean) ** 2 / std**2).sum()) / (len(value) - 1)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--logs", default="", help="those alone whose path has this in it")
    asked = parser.parse_args()
    print("| " + " | ".join(HEAD) + " |", "|---" * len(HEAD) + "|", sep="\n")
    skin = []
    for log in (log for log in LOGS if asked.logs in log.path):
        path = asked.folder / log.path
        if not path.is_file():
            print(f"| {log.path} | not there" + " |" * (len(HEAD) - 1))
            continue
        try:
            found = identify(read_log(path, **log.columns), **log.told)
        except InputError as error:
            print(f"| {log.path} | refused: {error}" + " |" * (len(HEAD) - 1), flush=True)
            continue
        print("| " + " | ".join(row(log, found)) + " |", flush=True)
        if path.parent.name == "skin_indentation":
            skin.append(found)
    print("\nrepeats, each piece of a log by itself:")
    for own in REPEATS:
        if asked.logs in own.log.path and (asked.folder / own.log.path).is_file():
            print(f"  {Path(own.log.path).name}: {chi2(own.found(asked.folder))}", flush=True)
    if len(skin) > 1:
        print(f"  skin, presses of different force, not the same again: {chi2(skin)}")


if __name__ == "__main__":
    main()
