"""Figure 2.5: the indirect scheme, a network that tunes the gains of a PID on the force."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from palpate.bench import Experiment, load, with_values
from palpate.environments import KelvinVoigt
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often, on_one_line, spread
from palpate_thesis.drawing import Figure, force_panel, panels
from palpate_thesis.force_control.interventions import Disturbance, other_surface, run_with
from palpate_thesis.force_control.tracking import FOLLOWS, Tracking, describe, following, slot, tracking
from palpate_thesis.runs import SHORT, SURFACES, Runs, by_condition, move_wall, rougher, stops_holding

NUMBER = "2.5"
PARAMETERS = with_values(
    load("foam-self-tuning"),
    {**SHORT, "run.press": 12.5, "force.first": 20.0, "force.second": 10.0, "force.period": 2.5},
)
UNDER = KelvinVoigt(34500.0, 480.0, 0.05)
TURN = 6.0
"""When the foam becomes rubber [s after contact]."""
SHOWN, JUDGED = (2.0, 12.5), (7.5, 12.5)
FIXED = {"controller.learning_rate": 1e-12}
BETTER = 0.9
"""Largest share of the untaught loop's error that counts as better."""


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    shown: Record
    tuned: dict[str, list[Tracking]]
    fixed: dict[str, list[Tracking]]
    turned: list[Tracking]


def run(runs: Runs) -> Data:
    """Each world with the network learning and without; and the turn from foam to rubber."""
    worlds = _worlds()
    measure = tracking(*JUDGED)
    full = {*_SURFACES, *_POSES}
    tuned = by_condition(runs, worlds, lambda e, seed: measure(runs.record(e, seed)), full)
    fixed = by_condition(
        runs, worlds, lambda e, seed: measure(runs.record(with_values(e, FIXED), seed)), full
    )
    turned = runs.map(lambda seed: measure(turned_into_rubber(seed)), list(runs.seeds))
    return Data(slot(turned_into_rubber(runs.seeds[0]), *SHOWN), tuned, fixed, turned)


def check(data: Data) -> Sequence[ThesisClaim]:
    """Surfaces, poses, a surface that changes, and whether it is the network that does it."""
    tracked = {"foam into\nrubber": data.turned, **{n: data.tuned[n] for n in _SURFACES}}
    shares = {n: _shares(data, n) for n in (*_SURFACES, *_POSES[1:])}
    return [
        claim(
            "self-tuning-robust.environment",
            all(following(f) for f in tracked.values()),
            described=describe(data.turned),
            others=_how_many_follow(tracked),
            follows=FOLLOWS,
            fixed_kept=_count_following(data.fixed),
            surfaces=len(data.fixed),
            tuned_kept=_count_following(data.tuned),
            where=stops_holding({**data.tuned, **tracked}, lambda f: f.follows),
        ),
        _configuration(data),
        claim(
            "self-tuning-robust.tuning",
            all(often(s <= BETTER for s in v) for v in shares.values()),
            surfaces="; ".join(
                f"{on_one_line(n)} {spread([100 * s for s in v], '%', 2)}" for n, v in shares.items()
            ),
            better=BETTER,
            where=stops_holding({n: _shares(data, n) for n in data.tuned}, lambda s: s <= BETTER),
        ),
    ]


def _configuration(data: Data) -> ThesisClaim:
    tracked = {n: data.tuned[n] for n in _POSES}
    return claim(
        "self-tuning-robust.configuration",
        all(following(f) for f in tracked.values()),
        poses=_how_many_follow(tracked),
        follows=FOLLOWS,
        near=data.tuned["wall at\n0.40 m"],
        where=stops_holding(tracked, lambda f: f.follows),
    )


def plot(data: Data) -> Figure:
    """The turn, and the gains."""
    drawing, ((force,), (gains,)) = panels([2.8, 1.8])
    force_panel(force, data.shown)
    c = PARAMETERS.controller
    kinds = (("K_fp", c.kf, style.SERIES[0]), ("K_fi", c.ki, style.SERIES[1]), ("K_fd", c.kd, style.OK))
    for i, (name, middle, color) in enumerate(kinds, start=1):
        gain = data.shown[f"adapted{i}"] / middle
        gains.plot(data.shown["t"], gain, color=color, linewidth=1.2, label=name)
    gains.set(xlabel="time since contact [s]", ylabel="gain over middle", xlim=SHOWN, ylim=(0.0, 2.0))
    style.legend(gains)
    for axis in (force, gains):
        axis.axvline(TURN, color=style.INK, linewidth=1, linestyle=":")
    return drawing


_SURFACES = ("foam", "rubber")
_POSES = ("foam", "wall at\n0.40 m", "wall at\n0.49 m")


def _worlds() -> dict[str, Experiment]:
    by: dict[str, Mapping[str, Any]] = {
        "foam": {},
        "rubber": SURFACES["rubber"],
        "wall at\n0.40 m": move_wall(PARAMETERS, 0.40),
        "wall at\n0.49 m": move_wall(PARAMETERS, 0.49),
        "relaxing\nfoam": SURFACES["relaxing\nfoam"],
        "friction\nhalf": rougher(PARAMETERS, 0.5),
        "friction\ndouble": rougher(PARAMETERS, 2.0),
        "other\nweights": {"controller.weights_seed": 1},
        "rate ten\ntimes": {"controller.learning_rate": 1e-2},
    }
    return {name: with_values(PARAMETERS, changes) for name, changes in by.items()}


def turned_into_rubber(seed: int) -> Record:
    """A run on foam that becomes rubber at `TURN`."""
    return run_with(PARAMETERS, seed, [Disturbance(TURN, other_surface(UNDER))])


def _shares(data: Data, name: str) -> list[float]:
    return [a.settled / b.settled for a, b in zip(data.tuned[name], data.fixed[name], strict=True)]


def _count_following(tracked: Mapping[str, Sequence[Tracking]]) -> int:
    return sum(map(following, tracked.values()))


def _how_many_follow(tracked: Mapping[str, Sequence[Tracking]]) -> str:
    return "; ".join(
        f"{on_one_line(n)} {sum(f.follows for f in v)} of {len(v)} follow" for n, v in tracked.items()
    )
