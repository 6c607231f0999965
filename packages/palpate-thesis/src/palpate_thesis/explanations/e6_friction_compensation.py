"""Friction compensation: as printed (without effect), and effective."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import losses
from palpate.instruments import Encoder
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import ZERO, Axes, Figure, across, panels
from palpate_thesis.force_control.tracking import since_contact, slot
from palpate_thesis.runs import (
    SHORT,
    SURFACES,
    VARIED_SEEDS,
    Runs,
    by_condition,
    friction_and_pose,
    stops_holding,
)

NUMBER = "friction-compensation"
LEVEL = (3.0, 0.25, 0.03)
"""Compensated levels [N m]: the Coulomb levels of the bench; the listing's own are doubtful, see the errata."""
PLAIN = with_values(load("foam-hybrid"), {**SHORT, "controller.ki": 0.0, "run.press": 4.0})
PARAMETERS = with_values(PLAIN, {"compensation.level": LEVEL, "compensation.blend": (0.05, 0.05, 0.05)})
PRINTED_BLEND = 0.002
"""[rad/s]"""
BLENDS = (0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2)
HALF, SHAKES = 0.5, 5.0
"""Largest share of the error that is left where compensation works; least ratio of shaking that is called a hammer."""


class Held(NamedTuple):
    """The last second of a press."""

    error: float  # of the true force, absolute mean [N]
    shaking: float  # standard deviation of the true force [N]
    factor: float  # largest share of the Coulomb level that the listing's rule would have applied


class Ratio(NamedTuple):
    """With compensation, over without, in the same world."""

    error: float
    lost: bool

    @property
    def helps(self) -> bool:
        """True if at most `HALF` of the error is left, and contact is kept."""
        return not self.lost and self.error <= HALF


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    traces: dict[str, Record]
    plain: list[Held]
    printed_blend: list[Held]
    sweep: dict[float, list[Held]]  # by BLENDS
    varied: dict[str, list[Ratio]]


def run(runs: Runs) -> Data:
    """Presses without compensation, over blends, and in other worlds."""
    plain = runs.over_seeds(PLAIN, held_in)
    hammer = runs.over_seeds(with_blend(PARAMETERS, PRINTED_BLEND), held_in)
    sweep = runs.by_name({b: with_blend(PARAMETERS, b) for b in BLENDS}, held_in, VARIED_SEEDS)
    traces = {
        "as printed: never acts": slot(runs.record(PLAIN)),
        "blend 0.002 rad/s, acting": slot(runs.record(with_blend(PARAMETERS, PRINTED_BLEND))),
        "blend 0.05 rad/s": slot(runs.record(PARAMETERS)),
    }
    return Data(traces, plain, hammer, sweep, _ratios(runs))


def check(data: Data) -> Sequence[ThesisClaim]:
    """The listing's rule; a blend that acts; the blend of the listing, acting."""
    nominal = data.varied["foam"]
    best = min(BLENDS, key=lambda blend: np.median([h.error for h in data.sweep[blend]]))
    pairs = zip(data.printed_blend, data.plain, strict=True)
    return [
        claim("friction-compensation.printed", often(h.factor >= 0.9 for h in data.plain), plain=data.plain),
        claim(
            "friction-compensation.blend",
            often(r.helps for r in nominal),
            nominal=nominal,
            plain=data.plain,
            half=HALF,
            best=best,
            where=stops_holding(data.varied, lambda r: r.helps),
        ),
        claim(
            "friction-compensation.hammer",
            often(h.shaking / p.shaking >= SHAKES for h, p in pairs),
            printed=data.printed_blend,
            plain=data.plain,
            shakes=SHAKES,
        ),
    ]


def plot(data: Data) -> Figure:
    """The press and the blends."""
    drawing, grid = panels([2.3, 2.4], 2, 11.0)
    wide = across(grid[0])
    for name, trace in data.traces.items():
        wide.plot(trace["t"], trace["force"], linewidth=1.0, label=name)
    wide.axhline(20.0, **style.KNOWN)
    wide.set(xlabel="time since contact [s]", xlim=(0.0, PLAIN.run.press))
    wide.set(ylabel="true force [N]", ylim=(14.0, 23.0))
    style.legend(wide)
    _blend_panel(grid[1][0], data, lambda h: h.error, "force error [N]")
    _blend_panel(grid[1][1], data, lambda h: h.shaking, "shaking of the force [N]")
    return drawing


def _blend_panel(axis: Axes, data: Data, value: Callable[[Held], float], label: str) -> None:
    for blend, presses in data.sweep.items():
        axis.plot(
            [blend] * len(presses), [value(h) for h in presses], "o", color=style.SERIES[0], markersize=4
        )
    without = np.median([value(h) for h in data.plain])
    axis.axhline(without, color=style.MEASURED, linewidth=1.2, label="without")
    for quantum, name in zip(_quanta(), ("one count a tick", None), strict=False):
        axis.axvline(quantum, **ZERO, linestyle=":", label=name)
    axis.set_xscale("log")
    axis.set_ylim(bottom=0.0)
    axis.set(xlabel="blend [rad/s]", ylabel=label)
    style.legend(axis)


def _quanta() -> list[float]:
    """One count a tick [rad/s], by motor."""
    encoder = Encoder(Vec3(*PLAIN.encoders.counts))
    return [float(r) * PLAIN.run.rate for r in encoder.resolution]


def with_blend(experiment: Experiment, blend: float) -> Experiment:
    """The experiment with another blend for all motors [rad/s]."""
    return with_values(experiment, {"compensation.blend": (blend, blend, blend)})


def _ratios(runs: Runs) -> dict[str, list[Ratio]]:
    def ratio(world: Mapping[str, Any], seed: int) -> Ratio:
        without = held_in(runs.record(with_values(PLAIN, world), seed))
        compensated = runs.record(with_values(PARAMETERS, world), seed)
        return Ratio(held_in(compensated).error / without.error, losses(compensated) > 0)

    worlds = SURFACES
    return by_condition(runs, {**worlds, **friction_and_pose(PLAIN)}, ratio, {"foam"})


def held_in(record: Record) -> Held:
    """The last second of a press of `PLAIN.run.press` seconds."""
    late = since_contact(record) >= PLAIN.run.press - 1.0
    force, desired = record["force"][late], record["force_desired"][late]
    if not late.any():
        return Held(np.nan, np.nan, listing_factor(record))
    return Held(abs(float((force - desired).mean())), float(force.std()), listing_factor(record))


def listing_factor(record: Record) -> float:
    """Largest share of the level that the listing's rule comes to, over motors 1 and 2 and all ticks."""
    encoder = Encoder(Vec3(*PLAIN.encoders.counts), Vec3(*(float(record[f"q{i}"][0]) for i in (1, 2, 3))))
    largest = 0.0
    for i in range(2):
        counts, offset = encoder.counts[i], encoder.offset[i]
        angle = np.round((record[f"q{i + 1}"] - offset) * counts / (2 * np.pi)) * (2 * np.pi / counts)
        speed = np.abs(np.diff(angle)) * PLAIN.run.rate
        inside = speed[speed <= PRINTED_BLEND]  # elsewhere the factor stays what it was
        largest = max(largest, float(inside.max(initial=0.0)) / PRINTED_BLEND)
    return largest
