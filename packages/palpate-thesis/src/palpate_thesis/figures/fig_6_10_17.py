"""Figures 6.10 to 6.17: force control on foam and rubber, with steps, with a sine, and along the free directions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, load, with_values
from palpate.records import Record
from palpate.report import style
from palpate.studies.metrics.following import LIMIT, SHARE
from palpate.studies.metrics.window import SETTLE, rms
from palpate_thesis.claims import MAJORITY, Sentence, ThesisClaim, claim, spread
from palpate_thesis.drawing import Figure, force_figure, panels
from palpate_thesis.force_control import tracking
from palpate_thesis.force_control.tracking import FOLLOWS, Tracking, describe, hybrid, since_contact, slot
from palpate_thesis.runs import VARIED_SEEDS, Runs, rougher

SLOW_RATE = {"controller.learning_rate": 1e-5}
FIRST, TEN_SECONDS_ON = (0.0, 10.0), (10.0, 15.0)
"""Windows after contact in which the force is judged [s]."""


class Tracked(NamedTuple):
    """Data of a figure of force control."""

    shown: Record
    nominal: list[Any]  # metric of each seed
    others: dict[str, list[Any]]  # metrics of the other experiments


@dataclass(frozen=True, eq=False)
class ForceFigure:
    """A figure of the force: an experiment, a metric, sentences and a slot."""

    NUMBER: str  # of the figure
    sentences: Sequence[Sentence]  # about one run
    PARAMETERS: Experiment  # experiment, long enough for all windows
    measure: Callable[[Record], Any]  # metric of a run
    words: Callable[[Tracked], dict[str, Any]]  # values of placeholders in the first sentence's texts
    shown: tuple[float, float] = (9.5, 13.5)  # from when to when after contact the force is drawn [s]
    others: Mapping[str, Experiment] = field(default_factory=dict)  # experiments that are measured as well
    seeds: int | None = None  # number of their seeds; None for all

    def run(self, runs: Runs) -> Tracked:
        """All seeds, and the other experiments."""
        shown = slot(runs.record(self.PARAMETERS), *self.shown)
        others = runs.by_name(self.others, self.measure, self.seeds)
        return Tracked(shown, runs.over_seeds(self.PARAMETERS, self.measure), others)

    def check(self, data: Tracked) -> list[ThesisClaim]:
        """Does the force do as the thesis says in enough of the runs?"""
        first, *further = self.sentences
        return [first.judge(data.nominal, **self.words(data)), *(s.judge(data.nominal) for s in further)]

    def plot(self, data: Tracked) -> Figure:
        """The force in the slot."""
        return force_figure(data.shown)


class Ends(NamedTuple):
    """Mean error of the true force in the last second of the intervals [N]; negative: too little."""

    high: float  # at 20 N
    low: float  # at 10 N


def misses(ends: Ends) -> bool:
    """True if both levels are missed by more than a tenth."""
    return abs(ends.high) > 20.0 * SHARE and abs(ends.low) > 10.0 * SHARE


def interval_ends(record: Record) -> Ends:
    """Mean errors at the end of the intervals of a run, from 5 s after contact on."""
    t = since_contact(record)
    late = (t >= 5.0) & (np.mod(t + 5e-7, 2.5) >= 1.5)
    error, desired = record["force"] - record["force_desired"], record["force_desired"]
    return Ends(float(error[late & (desired == 20.0)].mean()), float(error[late & (desired == 10.0)].mean()))


class Adapting(NamedTuple):
    """Tracking from the first touch on, and the time of adapting."""

    tracking: Tracking
    adapted: float  # time from which the force stays near the settled cycle [s]


CYCLE, SMOOTHED = 10.0, 0.25
"""Common period of the steps (5 s) and of the sine (2 s), whether its clock restarts or not, and the time over which
deviations are averaged [s]."""


def adapting(record: Record) -> Adapting:
    """Tracking, and when the smoothed distance of the force from the last cycle falls below the limit for good."""
    force = record["force"][since_contact(record) >= 0.0]
    ticks = round(CYCLE * 1000)
    cycles = force[: len(force) // ticks * ticks].reshape(-1, ticks)
    window = np.full(round(SMOOTHED * 1000), 1e-3 / SMOOTHED)
    away = np.abs(np.convolve((cycles - cycles[-1]).ravel(), window, "valid"))
    beyond = np.flatnonzero(away > LIMIT)
    adapted = SMOOTHED + (float(beyond[-1]) * 1e-3 if len(beyond) else 0.0)
    return Adapting(tracking.tracking(*FIRST)(record), adapted)


class MinutesRun(NamedTuple):
    """Tracking after minutes, and the error of each cycle on the way there."""

    tracking: Tracking
    errors: Array  # RMS outside the steps in each whole cycle of 5 s [N], shape (cycles,)


def course(record: Record) -> MinutesRun:
    """Tracking from 180 to 190 s, and the error of each cycle."""
    t, error = since_contact(record), record["force"] - record["force_desired"]
    settled = np.mod(t + 5e-7, 2.5) >= SETTLE
    starts = 5.0 * np.arange(int((float(t[-1]) + 1e-3) // 5.0))
    errors = [rms(error[settled & (t >= start) & (t < start + 5.0)]) for start in starts]
    return MinutesRun(tracking.tracking(180.0, 190.0)(record), np.array(errors))


class Errors(NamedTuple):
    """True errors: at the switch to force control, and RMS over 10 to 15 s, where they may change sign."""

    y_switch: float  # [m]
    y: float  # [m]
    phi: float  # [rad]


VISIBLE = (0.5e-3, np.radians(0.2))
"""From where errors of y [m] and of the angle [rad] are not zero: some hundred times what an encoder resolves."""
PART = 0.25
"""Least relative reduction of the error by which a removed cause counts."""
FREE_DIRECTIONS = (
    Sentence("neural-free-directions", lambda e: e.y > VISIBLE[0] and e.phi > VISIBLE[1]),
    Sentence("neural-free-directions.before", lambda e: abs(e.y_switch) > VISIBLE[0]),
)


def measure_free_errors(record: Record) -> Errors:
    """The errors of a run of fifteen seconds of contact."""
    t = since_contact(record)
    inside = (t >= TEN_SECONDS_ON[0]) & (t < TEN_SECONDS_ON[1])
    return Errors(
        float(record["y"][np.argmax(t >= 0.0)]), rms(record["y"][inside]), rms(record["phi"][inside])
    )


class FreeDirections:
    """Figure 6.15: position along the surface and angle under the neural controller."""

    NUMBER = "6.15"
    PARAMETERS = with_values(load("foam-neural"), {"run.press": 15.0})
    causes: Mapping[str, Mapping[str, Any]] = {
        "sticking": {"wall.side_friction": 0.0},
        "friction": rougher(tracking.FOAM, 0.5),
    }

    def run(self, runs: Runs) -> Tracked:
        """The whole approach and fifteen seconds of contact; then without sticking, and with half the friction."""
        nominal = runs.over_seeds(self.PARAMETERS, measure_free_errors)
        without = {name: with_values(self.PARAMETERS, by) for name, by in self.causes.items()}
        others = runs.by_name(without, measure_free_errors, VARIED_SEEDS)
        return Tracked(slot(runs.record(self.PARAMETERS), 0.0, 15.0), nominal, others)

    def check(self, data: Tracked) -> Sequence[ThesisClaim]:
        """The errors, and the two reasons that the thesis gives."""
        whole = np.median([e.y for e in data.nominal])
        gone = {name: 1.0 - np.median([e.y for e in errors]) / whole for name, errors in data.others.items()}
        numbers = {
            "nominal": data.nominal,
            "visible": 1e3 * VISIBLE[0],
            "phi": [float(np.degrees(e.phi)) for e in data.nominal],
            "visible_phi": np.degrees(VISIBLE[1]),
            "gone": gone["friction"],
        }
        free, taken = data.others["sticking"], gone["sticking"]
        sticks = claim("neural-free-directions.sticks", taken >= PART, free=free, taken=taken, share=PART)
        return [*(sentence.judge(data.nominal, **numbers) for sentence in FREE_DIRECTIONS), sticks]

    def plot(self, data: Tracked) -> Figure:
        """The four signals of the thesis' figure."""
        drawing, axes = panels([0.9, 1.3, 1.0, 1.0])
        signals = {
            "(a) desired\nforce [N]": (data.shown["force_desired"], style.INK),
            "(b) measured\nforce [N]": (data.shown["force_measured"], style.MEASURED),
            "(c) y error\n[mm]": (1e3 * data.shown["y_measured"], style.SERIES[0]),
            "(d) angle\nerror [degrees]": (np.degrees(data.shown["phi_measured"]), style.SERIES[0]),
        }
        for (axis,), (label, (values, color)) in zip(axes, signals.items(), strict=True):
            axis.plot(data.shown["t"], values, color=color, linewidth=0.8)
            axis.set(ylabel=label, xlim=(0.0, 15.0))
        for (axis,) in axes[2:]:
            axis.axhline(0.0, **style.KNOWN)
        axes[3][0].set_xlabel("time since contact [s]")
        return drawing


def _pressing(experiment: Experiment, seconds: float, *changes: Mapping[str, Any]) -> Experiment:
    together = {key: value for change in changes for key, value in change.items()}
    return with_values(experiment, {**together, "run.press": seconds})


def _following(data: Tracked) -> dict[str, Any]:
    """Errors and saturation in words."""
    tracked = [getattr(run, "tracking", run) for run in data.nominal]
    return {
        "values": describe(tracked),
        "limited": 100 * float(np.median([run.saturated for run in tracked])),
        "follows": FOLLOWS,
        "following": tracking.FOLLOWING,
    }


def _minutes(data: Tracked) -> dict[str, Any]:
    network, plain = ([run.errors for run in runs] for runs in (data.nominal, data.others["PI"]))
    return {
        **_following(data),
        "first": spread([float(errors[:2].mean()) for errors in network], "N"),
        "plain": spread([float(errors[-2:].mean()) for errors in plain], "N"),
    }


def _follows(id_: str, follows: bool = True) -> Sentence:
    return Sentence(id_, lambda run: getattr(run, "tracking", run).follows is follows)


ADAPTS = Sentence(
    "neural-rubber-sine.adapts",
    lambda run: 2.5 <= run.adapted <= 7.5,
    lambda run: run.adapted,
    "s",
    MAJORITY,
    {"smoothed": SMOOTHED, "limit": LIMIT},
)
LATE, EARLY = tracking.tracking(*TEN_SECONDS_ON), tracking.tracking(*FIRST)
ON_FOAM, ON_RUBBER = _pressing(tracking.FOAM, 15.0), _pressing(tracking.RUBBER, 15.0)
ON_FOAM_SINE = _pressing(tracking.FOAM, 15.0, tracking.SINE)
ON_RUBBER_SINE = _pressing(tracking.RUBBER, 20.0, tracking.SINE)
SLOW_FOAM = _pressing(tracking.FOAM, 10.0, SLOW_RATE)
MINUTES = _pressing(tracking.FOAM, 190.0, SLOW_RATE, {"run.duration": 300.0})
PLAIN = {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": 1.0}}
"""The integral controller that the network equals at first."""
HYBRID_ALONE = ForceFigure(
    "6.10",
    [Sentence("hybrid-alone-falls-short", misses)],
    _pressing(tracking.FOAM, 15.0, hybrid(0.25, 0.0)),
    interval_ends,
    lambda data: {"foam": data.nominal, "rubber": data.others["rubber"], "share": SHARE},
    (5.0, 15.0),
    {"rubber": _pressing(tracking.RUBBER, 15.0, hybrid(0.25, 0.0))},
)
FOAM = ForceFigure("6.11", [_follows("neural-foam-steps")], ON_FOAM, LATE, _following)
SINE = ForceFigure("6.12", [_follows("neural-foam-sine")], ON_FOAM_SINE, LATE, _following, (9.75, 15.0))
SLOW = ForceFigure("6.13", [_follows("neural-slow-rate.first", False)], SLOW_FOAM, EARLY, _following, FIRST)
LATER = ForceFigure(
    "6.14",
    [_follows("neural-slow-rate.later")],
    MINUTES,
    course,
    _minutes,
    (179.5, 185.5),
    {"PI": with_values(MINUTES, PLAIN)},
    2,
)
RUBBER = ForceFigure("6.16", [_follows("neural-rubber-steps")], ON_RUBBER, LATE, _following)
RUBBER_SINE = ForceFigure(
    "6.17", [_follows("neural-rubber-sine"), ADAPTS], ON_RUBBER_SINE, adapting, _following, FIRST
)
FORCE = (HYBRID_ALONE, FOAM, SINE, SLOW, LATER, RUBBER, RUBBER_SINE)
STUDIES = (*FORCE, FreeDirections())
