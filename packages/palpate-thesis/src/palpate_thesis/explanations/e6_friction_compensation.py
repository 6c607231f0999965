"""Friction compensation: as printed (without effect), and effective; loss and recovery of contact."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import CONTACT, LOST, losses
from palpate.instruments import Encoder
from palpate.records import Record
from palpate.report import style
from palpate.studies.metrics.following import SHARE
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import ZERO, Axes, Figure, across, panels
from palpate_thesis.force_control.interventions import Disturbance, run_with, surface_back
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

LOSS = with_values(load("foam-hybrid"), {**SHORT, "run.press": 15.0})
RETREAT_TIME, RETREAT = 2.5, 0.005
"""Time after contact at which the surface retracts [s], and its distance [m]."""
MAX_RECOVERY, MAX_SETTLING, MAX_PEAK = 10.0, 3.0, 1.25
"""Limits of the time to regain contact, of the time from there to the desired force [s], and of the relative force."""


class Recovery(NamedTuple):
    """Outcome of a lost contact."""

    took: float  # from loss to contact [s]; infinite if never
    off: float  # relative error of the force `MAX_SETTLING` seconds later
    peak: float  # largest true force after the loss, over the desired one
    times: int  # losses

    @property
    def well(self) -> bool:
        """True if contact came back in time, and gently."""
        return self.times == 1 and self.took <= MAX_RECOVERY and self.off <= SHARE and self.peak <= MAX_PEAK


def recovery_claim(recoveries: Sequence[Recovery]) -> ThesisClaim:
    """Claim that contact comes back in time, and gently."""
    return claim(
        "contact-regained",
        often(recovery.well for recovery in recoveries),
        found=recoveries,
        again=MAX_SETTLING,
        within=MAX_RECOVERY,
        share=SHARE,
        limit=MAX_PEAK,
    )


def loss_panel(axis: Axes, record: Record) -> None:
    """Draw the true force, and shade the time without contact."""
    axis.plot(record["t"], record["force"], color=style.F, linewidth=1.1, label="true force")
    shade: dict[str, Any] = {"transform": axis.get_xaxis_transform(), "color": style.GRID, "linewidth": 0}
    lost = record["phase"] != CONTACT
    axis.fill_between(record["t"], 0.0, 1.0, where=lost, label="lost, waiting, looking", **shade)
    axis.set(xlabel="time since contact [s]", xlim=(0.0, LOSS.run.press))
    axis.set(ylabel="true force [N]", ylim=(-0.5, 24.0))
    style.legend(axis)


def drawn_back(seed: int) -> Record:
    """Press whose surface retracts."""
    return run_with(LOSS, seed, [Disturbance(RETREAT_TIME, surface_back(RETREAT))])


def measure_recovery(record: Record) -> Recovery:
    """Outcome of the contact after its first loss."""
    t, phase, force = since_contact(record), record["phase"], record["force"]
    lost = np.flatnonzero((phase[1:] == LOST) & (phase[:-1] == CONTACT)) + 1
    if not len(lost):
        return Recovery(np.inf, np.inf, np.inf, 0)
    after = np.flatnonzero((phase == CONTACT) & (t > t[lost[0]]))
    if not len(after):
        return Recovery(np.inf, np.inf, np.inf, len(lost))
    back = t[after[0]]
    late = (t >= back + MAX_SETTLING - 0.1) & (t < back + MAX_SETTLING + 0.1)
    off = abs(float(force[late].mean()) / 20.0 - 1.0) if late.any() else np.inf
    return Recovery(float(back - t[lost[0]]), off, float(force[lost[0] :].max()) / 20.0, len(lost))


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
    regains: list[Recovery]
    regain: Record


def run(runs: Runs) -> Data:
    """Presses without compensation, over blends, in other worlds; and presses whose surface goes."""
    plain = runs.over_seeds(PLAIN, held_in)
    hammer = runs.over_seeds(with_blend(PARAMETERS, PRINTED_BLEND), held_in)
    sweep = runs.by_name({b: with_blend(PARAMETERS, b) for b in BLENDS}, held_in, VARIED_SEEDS)
    traces = {
        "as printed: never acts": slot(runs.record(PLAIN)),
        "blend 0.002 rad/s, acting": slot(runs.record(with_blend(PARAMETERS, PRINTED_BLEND))),
        "blend 0.05 rad/s": slot(runs.record(PARAMETERS)),
    }
    regains = runs.map(lambda seed: measure_recovery(drawn_back(seed)), list(runs.seeds))
    return Data(traces, plain, hammer, sweep, _ratios(runs), regains, slot(drawn_back(runs.seeds[0])))


def check(data: Data) -> Sequence[ThesisClaim]:
    """The listing's rule; a blend that acts; the blend of the listing, acting; loss and regain."""
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
        recovery_claim(data.regains),
    ]


def plot(data: Data) -> Figure:
    """The press, the blends, the loss."""
    drawing, grid = panels([2.3, 2.4, 2.2], 2, 11.0)
    wide = [across(grid[i]) for i in (0, 2)]
    for name, trace in data.traces.items():
        wide[0].plot(trace["t"], trace["force"], linewidth=1.0, label=name)
    wide[0].axhline(20.0, **style.KNOWN)
    wide[0].set(xlabel="time since contact [s]", xlim=(0.0, PLAIN.run.press))
    wide[0].set(ylabel="true force [N]", ylim=(14.0, 23.0))
    style.legend(wide[0])
    _blend_panel(grid[1][0], data, lambda h: h.error, "force error [N]")
    _blend_panel(grid[1][1], data, lambda h: h.shaking, "shaking of the force [N]")
    loss_panel(wide[1], data.regain)
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
