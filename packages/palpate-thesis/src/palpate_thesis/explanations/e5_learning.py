"""Explanation 5: left open by the thesis: the best learning rate, layers and neurons, architectures, stability."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from palpate.bench import Experiment, with_values
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim
from palpate_thesis.conditions import RELAXING_FOAM
from palpate_thesis.force_control.architectures import bench_with, radial_basis, recurrent
from palpate_thesis.force_control.panels import legend_inside, panels
from palpate_thesis.force_control.tracking import FOAM, FOLLOWS, RUBBER, Tracking, following, tracking
from palpate_thesis.force_control.weights import watch
from palpate_thesis.look import Axes, Figure
from palpate_thesis.runs import Runs

NUMBER = "rate-layers-neurons"
RATE = 5e-5
"""The text's."""
RATES = (5e-6, 2e-5, 5e-5, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3)
SIZES = ((1,), (2,), (4,), (12,), (30,), (60,), (12, 12), (12, 12, 12))
_RANDOM: Mapping[str, Any] = {"run.press": 15.0, "controller.weights": "random"}
SURFACES: Mapping[str, Experiment] = {
    "foam": with_values(FOAM, _RANDOM),
    "rubber": with_values(RUBBER, _RANDOM),
    "foam that relaxes": with_values(FOAM, {**_RANDOM, **RELAXING_FOAM}),
}
JUDGED = (10.0, 15.0)
LONG = 120.0
"""Seconds of contact over which a network's size is tried for a loss [s]."""
ARCHITECTURES = {"radial-basis": radial_basis, "recurrent": recurrent}
LESS = 0.9
"""Largest share of the thesis' network's error that counts as better."""
PER_RATE, PER_SIZE, PER_LOSS = 3, 3, 2
"""Runs of each."""
GONE = 3.8
"""Where runs that lost contact are drawn [N]."""


Case = tuple[Experiment, int]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    network: dict[str, dict[float, list[Tracking]]]  # by surface and rate
    pi: dict[str, dict[float, Tracking]]
    sizes: dict[tuple[int, ...], list[Tracking]]  # on foam
    losses: dict[tuple[int, ...], list[float | None]]  # on the foam that relaxes [s]
    others: dict[str, dict[str, list[Tracking]]]  # by architecture and surface
    others_losses: dict[str, list[float | None]]


def run(runs: Runs) -> Data:
    """A sweep over rates on three surfaces, and one over sizes on both foams."""

    def measure(case: Case) -> Tracking:
        return tracking(*JUDGED)(runs.one(*case))

    def loss(case: Case) -> float | None:
        return watch(*case, LONG, lambda _: None, runs.waiting)

    def with_rates(e: Experiment) -> dict[float, list[Case]]:
        return {r: _runs_of_seeds(runs, PER_RATE, e, {"controller.learning_rate": r}) for r in RATES}

    def with_sizes(surface: str, seeds: int) -> dict[tuple[int, ...], list[Case]]:
        return {s: _runs_of_seeds(runs, seeds, SURFACES[surface], {"controller.layers": s}) for s in SIZES}

    first = runs.seeds[0]
    plain = {name: {r: [(with_values(e, _pi(r)), first)] for r in RATES} for name, e in SURFACES.items()}
    return Data(
        {name: runs.map_each(measure, with_rates(e)) for name, e in SURFACES.items()},
        {n: {r: one for r, (one,) in runs.map_each(measure, cases).items()} for n, cases in plain.items()},
        runs.map_each(measure, with_sizes("foam", PER_SIZE)),
        runs.map_each(loss, with_sizes("foam that relaxes", PER_LOSS)),
        {name: {s: _errors_of(runs, name, s) for s in ("foam", "rubber")} for name in ARCHITECTURES},
        {name: runs.map(partial(_loss, runs, name), runs.seeds[:PER_RATE]) for name in ARCHITECTURES},
    )


def _runs_of_seeds(runs: Runs, seeds: int, experiment: Experiment, changes: Mapping[str, Any]) -> list[Case]:
    """The experiment with these changes, with other weights for each of the first so many seeds."""
    changed = with_values(experiment, changes)
    return [(with_values(changed, {"controller.weights_seed": s}), s) for s in runs.seeds[:seeds]]


def _errors_of(runs: Runs, name: str, surface: str) -> list[Tracking]:
    """The error with an architecture in the place of the network, at the text's rate."""
    e = SURFACES[surface]

    def measure(seed: int) -> Tracking:
        bench = bench_with(e, ARCHITECTURES[name], seed)
        return tracking(*JUDGED)(bench.run(e.run.duration, seed, press=e.run.press))

    return runs.map(measure, runs.seeds)


def _loss(runs: Runs, name: str, seed: int) -> float | None:
    """When an architecture loses the foam that relaxes [s]."""
    e = SURFACES["foam that relaxes"]
    return watch(e, seed, LONG, lambda _: None, runs.waiting, bench=bench_with(e, ARCHITECTURES[name], seed))


def check(data: Data) -> Sequence[ThesisClaim]:
    """A question of the thesis, not a claim: it gets an answer and no verdict."""
    best = {name: min(found, key=lambda rate: _error(found[rate])) for name, found in data.network.items()}
    errors = [_rms(found) for found in data.sizes.values()]
    losses = [lost for found in data.losses.values() for lost in found]
    times = [lost for lost in losses if lost is not None]
    least = ", ".join(
        f"{name} {rate:g} ({_error(data.network[name][rate]):.2f} N)" for name, rate in best.items()
    )
    gone = f"{min(times):.0f} to {max(times):.0f} s" if times else "never"
    return [
        claim(
            "open-questions",
            "not checkable",
            least=least,
            small=min(errors),
            large=max(errors),
            gone=gone,
            times=len(times),
            losses=len(losses),
            rising=_rising(data),
        ),
        *(_architecture(data, name) for name in ARCHITECTURES),
    ]


def _architecture(data: Data, name: str) -> ThesisClaim:
    found, losses = data.others[name], data.others_losses[name]
    kept = sum(lost is None for lost in losses)
    shares = {s: _rms(runs) / _rms(data.network[s][RATE]) for s, runs in found.items()}
    return claim(
        f"architectures.{name}",
        all(s <= LESS for s in shares.values())
        and all(map(following, found.values()))
        and kept == len(losses),
        **found,
        shares=" and ".join(f"{share:.0%}" for share in shares.values()),
        following="; ".join(f"{s}: {sum(o.follows for o in f)} of {len(f)} follow" for s, f in found.items()),
        gone=", ".join("never" if lost is None else f"{lost:.0f} s" for lost in losses),
        less=LESS,
        long=LONG,
        follows=FOLLOWS,
    )


def plot(data: Data) -> Figure:
    """Errors over the rate, and over the size."""
    drawing, grid = panels([2.6, 2.6], columns=2, width=11.0)
    for axis, names in zip(grid[0], (("foam", "rubber"), ("foam that relaxes",)), strict=True):
        for name, color in zip(names, style.SERIES[:2], strict=False):
            _rates(axis, data, name, style.FAIL if name == "foam that relaxes" else color)
        axis.set(xlabel="learning rate eta", xscale="log", xlim=(4e-6, 1.3e-3))
        axis.set(ylabel="RMS error [N]", ylim=(0.0, 4.1))
        legend_inside(axis, loc="upper center", ncols=len(names), bbox_to_anchor=(0.42, 0.97))
    labels = ["-".join(map(str, size)) for size in SIZES]
    labels += ["radial\nbasis", "recur-\nrent"]
    for i, found in enumerate((*data.sizes.values(), *(other["foam"] for other in data.others.values()))):
        color = style.SERIES[0] if i < len(SIZES) else style.SERIES[1]
        grid[1][0].plot([i] * len(found), [one.rms for one in found], "o", color=color, markersize=4)
    grid[1][0].set(ylabel="RMS error, foam [N]", ylim=(0.0, 2.5))
    for i, times in enumerate((*data.losses.values(), *data.others_losses.values())):
        for lost in times:
            marker, color = ("^", style.OK) if lost is None else ("o", style.FAIL)
            grid[1][1].plot(i, LONG if lost is None else lost, marker, color=color, markersize=5)
    grid[1][1].set(ylabel="contact lost after [s]", ylim=(0.0, LONG * 1.08))
    grid[1][1].set_title(f"foam that relaxes; at the upper edge: kept for {LONG:g} s")
    for axis in grid[1]:
        axis.set_xticks(range(len(labels)), labels)
        axis.set_xlabel("neurons of each hidden layer; other architectures, 12 neurons")
    return drawing


def _rates(axis: Axes, data: Data, name: str, color: str) -> None:
    for rate, found in data.network[name].items():
        kept = [one.rms for one in found if one.kept]
        axis.plot([rate] * len(kept), kept, "o", color=color, markersize=4)
        gone = [GONE] * sum(not one.kept for one in found)
        axis.plot([rate] * len(gone), gone, "x", color=color, markersize=7, markeredgewidth=2)
    steady = {rate: one.rms for rate, one in data.pi[name].items() if one.kept}
    axis.plot(list(steady), list(steady.values()), color=color, linewidth=1, alpha=0.6, label=f"{name}: PI")
    axis.plot([], [], "o", color=color, markersize=4, label=f"{name}: network")
    axis.plot([], [], "x", color=color, markersize=7, label=f"{name}: contact lost")


def _pi(rate: float) -> dict[str, object]:
    return {"controller": {"kind": "proportional-integral", "kf": 0.25, "ki": rate * 1e5}}


def _rms(found: Sequence[Tracking]) -> float:
    return float(np.median([one.rms for one in found]))


def _error(found: Sequence[Tracking]) -> float:
    """The median RMS error; infinite where a run lost contact."""
    return _rms(found) if all(one.kept for one in found) else float("inf")


def _rising(data: Data) -> str:
    """A sentence: from which rate on runs lose contact within 15 s, for network and PI."""
    parts = []
    for name, found in data.network.items():
        network = [rate for rate, runs in found.items() if not all(one.kept for one in runs)]
        plain = [rate for rate, one in data.pi[name].items() if not one.kept]
        told = (f"{min(rates):g}" if rates else f"none up to {max(RATES):g}" for rates in (network, plain))
        parts.append("{}: {} (PI: {})".format(name, *told))
    return f"Lowest rate tried at which contact is lost within 15 s: {'; '.join(parts)}."
