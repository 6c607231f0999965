"""Friction, normal and stiffness from logs of slides that another simulator made: do the intervals hold?

And of presses of several kinds, which are no slides: straight, oblique, by a hand, at several places, in a sine, and
without free motion. A press counts twice, as `palpate identify` answers it and as it does without the test for slides.

The worlds are those of `tests/oracles/wiped_surface.py`, which has nothing of palpate. A friction that is given as a
table counts with each row; a cone with the share of the path on which it holds the normal.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from oracles.wiped_surface import PRESSES, WipeLog, any_press, any_wipe, press, wipe
from palpate.contact_frame import ContactFrame, identify_contact, slide_friction
from palpate.identification import Identification, Verdict
from palpate.records import Record

FIRST = 20000
"""Seed of the first world; of those below some were looked at while the estimator was written."""
UNITS = {"time": "s", "force": "N", "position": "m", "quaternion": "1"}


def found_in(log: WipeLog) -> Identification:
    """What palpate says of a log."""
    units = {name: UNITS[name.partition("_")[0]] for name in log.columns}
    return identify_contact(Record(log.columns, units, {}), ContactFrame(wrench_frame="tool"))[0]


def friction_held(found: Identification, log: WipeLog) -> Iterator[tuple[bool, float]]:
    """Whether each row of the table of friction holds, and its relative half-width."""
    assert found.slide is not None
    table, speed = found.slide.values["by_speed"], log.speed
    for row in table:
        rows = log.inside & (speed > 0.5 * float(np.median(speed[log.inside])))
        if len(table) > 1:
            rows = log.inside & (np.abs(speed / row["speed_m_s"] - 1.0) < 0.1)
        if rows.any():
            yield bool(abs(row["mu"] - log.mu[rows].mean()) < row["half"]), row["half"] / row["mu"]


def cone_held(found: Identification, log: WipeLog) -> tuple[float, float]:
    """Share of the path whose cone holds the normal, and the normal's median error [deg]."""
    from scipy.spatial import cKDTree

    assert found.slide is not None
    places = found.slide.values["places"]
    at = np.array([[p[axis] for axis in "xyz"] for p in places])
    normal, cone = (
        np.array([p["normal"] for p in places]),
        np.array([p["cone95_deg"] or 180.0 for p in places]),
    )
    true = log.normal[log.inside][cKDTree(log.place[log.inside]).query(at)[1]]
    off = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", normal, true), -1.0, 1.0)))
    return float(np.mean(off < cone)), float(np.median(off))


def row_of(name: str, worlds: list[tuple[Identification, WipeLog]]) -> str:
    """A row of the table."""
    slides = [(f, log) for f, log in worlds if f.slide is not None]
    known = [(f, log) for f, log in slides if f.parameters["mu"].value is not None]
    mu = [one for f, log in known for one in friction_held(f, log)]
    cones = [cone_held(f, log) for f, log in known]
    K = [(f.parameters["K"], log) for f, log in slides if f.parameters["K"].value is not None]
    held = [p.ci95[0] < log.world.stiffness < p.ci95[1] for p, log in K if p.ci95]
    wide = [(p.ci95[1] - p.ci95[0]) / (2.0 * p.value) for p, _ in K if p.ci95 and p.value]
    read = [(f.parameters["K"], log) for f, log in worlds if f.slide is None]
    read = [(p, log) for p, log in read if p.verdict is Verdict.IDENTIFIED]
    pressed = [p.ci95[0] < log.world.stiffness < p.ci95[1] for p, log in read if p.ci95]
    cells = [
        name, f"{len(worlds)}", f"{len(slides)}", f"{len(known)}",
        _share([one for one, _ in mu]), _percent([half for _, half in mu]),
        f"{np.median([e for _, e in cones]):.2f} deg" if cones else "-", _share([c for c, _ in cones]),
        f"{len(K)}", _share(held), _percent(wide), f"{len(read)}", _share(pressed),
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def presses(count: int) -> None:
    """Prints the table of presses: those read as slides, and those whose stiffness is identified, with and without."""
    print("| presses | | read as slides | K identified | K holds | without the test for slides | K holds |")
    print("|" + " --- |" * 7)
    for i, kind in enumerate(PRESSES):
        logs = [
            press(any_press(FIRST + 1000 * i + k, kind=kind)) for k in range(max(count // len(PRESSES), 1))
        ]
        own, slide_in = [found_in(log) for log in logs], slide_friction.slide_in
        slide_friction.slide_in = lambda *_: None
        alone = [found_in(log) for log in logs]
        slide_friction.slide_in = slide_in
        cells = [kind, f"{len(logs)}", f"{sum(f.slide is not None for f in own)}"]
        for answers in (own, alone):
            known = [
                (f.parameters["K"].ci95, log) for f, log in zip(answers, logs, strict=True)
                if "K" in f.parameters and f.parameters["K"].verdict is Verdict.IDENTIFIED
            ]  # fmt: skip
            linear = [
                ends[0] < log.world.stiffness < ends[1] for ends, log in known
                if ends and log.world.material == "spring" and log.world.kind != "oblique"
            ]  # fmt: skip
            cells += [f"{len(known)}", f"{sum(linear)} of {len(linear)}"]
        print(f"| {' | '.join(cells)} |", flush=True)


def _share(held: list[bool] | list[float]) -> str:
    return f"{100.0 * float(np.mean(held)):.1f} %" if held else "-"


def _percent(values: list[float]) -> str:
    return f"{100.0 * float(np.median(values)):.2g} %" if values else "-"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=100)
    parser.add_argument("--presses", type=int, default=0, help="of as many presses, instead of slides")
    asked = parser.parse_args()
    if asked.presses:
        presses(asked.presses)
        return
    kinds = {
        "free motion, tool stands": {"free": 1.5, "turns": False},
        "free motion, tool turns": {"free": 1.5, "turns": True},
        "no free motion": {"free": 0.0},
        "lubricated: mu is 0": {"free": 1.5, "mu": 0.0, "stribeck": 0.0},
    }
    share = {
        "free motion, tool stands": 0.6,
        "free motion, tool turns": 0.3,
        "no free motion": 0.2,
        "lubricated: mu is 0": 0.1,
    }
    print(
        "| worlds | | seen as slides | mu identified | mu holds | half-width | normal, median | cone holds"
        " | K identified | K holds | half-width | press: K identified | K holds |"
    )
    print("|" + " --- |" * 13)
    seed = FIRST
    for name, given in kinds.items():
        worlds = []
        for _ in range(max(round(share[name] * asked.worlds), 1)):
            log = wipe(any_wipe(seed, **given))
            worlds.append((found_in(log), log))
            seed += 1
        print(row_of(name, worlds), flush=True)


if __name__ == "__main__":
    main()
