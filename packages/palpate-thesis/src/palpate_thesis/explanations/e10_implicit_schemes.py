"""Explanation 10: schemes that learn an unknown surface implicitly (sec. 2.3), on the arm."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.bench import Experiment, build, load, with_values
from palpate.records import Record
from palpate.report import style
from palpate_studies.metrics.following import LIMIT, SHARE
from palpate_thesis import implicit_schemes
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.conditions import RUBBER_SURFACE, SHORT, by_condition, friction_and_pose, stops_holding
from palpate_thesis.force_control.panels import dots_panel, panels
from palpate_thesis.force_control.tracking import (
    Tracking,
    describe,
    following,
    since_contact,
    slot,
    tracking,
)
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "implicit-schemes"
PARAMETERS = with_values(load("foam-neural"), {**SHORT, "run.losses": 0, "run.duration": 450.0})
BEYOND = 0.0138
"""Of the search's desired x beyond the wall [m], as in figure 2.2."""
WINDOW = 10.0
"""Seconds at the end of a run that are judged, and those of a window of the search."""


class Scheme(NamedTuple):
    """A controller by the seed of its weights or its search, and the seconds of contact that it is given."""

    make: Callable[[int], Any]
    seconds: float


SCHEMES = {
    "fuzzy": Scheme(lambda _: implicit_schemes.FuzzyCompensation(), 20.0),
    "feedback-error": Scheme(lambda seed: implicit_schemes.feedback_error_learning(seed=seed), 20.0),
    "impedance-search": Scheme(
        lambda seed: implicit_schemes.impedance_search(PARAMETERS.wall.x + BEYOND, seed), 400.0
    ),
}
WORLDS: Mapping[str, Mapping[str, Any]] = {
    "foam": {},
    "rubber": RUBBER_SURFACE,
    "tip that\nslides": {"wall.side_friction": 0.0},
    **{name: change for name, change in friction_and_pose(PARAMETERS).items() if name.startswith("friction")},
}
_NAMED = ("foam", "rubber")


class Learned(NamedTuple):
    """End of a run, and its way there."""

    last: Tracking  # in the last window, whatever was lost before it
    y: float  # mean error of y there [m]
    angle: float  # and of the angle [degrees]
    lost: int  # losses of contact, from the start on
    path: tuple[float, ...]  # rms of each window


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    traces: dict[str, Record]
    found: dict[str, dict[str, list[Learned]]]  # by scheme and world


def run(runs: Runs) -> Data:
    """Each scheme in each world."""
    found = {
        name: by_condition(
            runs,
            {world: (scheme, with_values(PARAMETERS, change)) for world, change in WORLDS.items()},
            lambda case, seed: _learning_of(press(*case, seed), case[0].seconds),
            _NAMED,
        )
        for name, scheme in SCHEMES.items()
    }
    traces = {
        name: slot(press(scheme, PARAMETERS, runs.seeds[0]), scheme.seconds - WINDOW, scheme.seconds)
        for name, scheme in SCHEMES.items()
    }
    return Data(traces, found)


def press(scheme: Scheme, experiment: Experiment, seed: int) -> Record:
    """A press under a scheme; the seed is that of the noise and of its weights or its search."""
    bench = build(experiment).with_controller(implicit_schemes.one_loop(scheme.make(seed)))
    return bench.run(experiment.run.duration, seed, press=scheme.seconds)


def _learning_of(record: Record, seconds: float) -> Learned:
    windows = [tracking(at, at + WINDOW)(record) for at in np.arange(0.0, seconds, WINDOW)]
    late, last = since_contact(record) >= seconds - WINDOW, windows[-1]
    y, angle = record["y"][late].mean(), np.degrees(record["phi"][late].mean())
    path = tuple(w.settled for w in windows)
    return Learned(last._replace(lost=0), float(y), float(angle), last.lost, path)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Each scheme by itself, on foam and on rubber."""
    return [_claim(name, found) for name, found in data.found.items()]


def _claim(name: str, found: dict[str, list[Learned]]) -> ThesisClaim:
    return claim(
        f"implicit-schemes.{name}",
        all(following([one.last for one in found[world]]) for world in _NAMED),
        foam=describe([one.last for one in found["foam"]]),
        rubber=describe([one.last for one in found["rubber"]]),
        lost=sum(one.lost > 0 for world in _NAMED for one in found[world]),
        seconds=SCHEMES[name].seconds,
        window=WINDOW,
        rms=LIMIT,
        share=SHARE,
        end=found["foam"],
        free=found["tip that\nslides"],
        first=[one.path[0] for one in found["foam"]],
        where=stops_holding(found, lambda one: one.last.follows),
    )


def plot(data: Data) -> Figure:
    """The last seconds of each scheme on foam, the search over its run, and all runs."""
    drawing, grid = panels([2.6, 2.0, 2.0])
    (force,), (search,), (dots,) = grid
    for name, one in data.traces.items():
        since = one["t"] - one["t"][0]
        force.plot(since, one["force"], linewidth=1.1, label=name)
    force.plot(since, one["force_desired"], **style.KNOWN, label="desired")
    force.set(xlabel="time in the last seconds [s]", ylabel="true force [N]", xlim=(0.0, WINDOW))
    style.legend(force)
    for world, color in zip(_NAMED, style.SERIES[:2], strict=True):
        paths = np.array([one.path for one in data.found["impedance-search"][world]])
        at = WINDOW * (0.5 + np.arange(paths.shape[1]))
        search.plot(at, np.nanmedian(paths, axis=0), color=color, linewidth=1.2, label=world)
        ends = np.nanmin(paths, axis=0), np.nanmax(paths, axis=0)
        search.fill_between(at, *ends, color=color, alpha=0.15, linewidth=0)
    search.set(xlabel="time since contact [s]", ylabel="RMS error [N]", ylim=(0.0, 12.0))
    search.set_title("the search: median and range of the runs")
    style.legend(search)
    shown = {f"{name}\n{world}": found[world] for name, found in data.found.items() for world in _NAMED}
    dots_panel(dots, shown, lambda one: one.last.settled, lambda one: one.last.follows, LIMIT)
    dots.set(ylabel="RMS error [N]", title="in the last seconds; a dot follows, a cross does not")
    return drawing
