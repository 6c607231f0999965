"""Equations 4.19-4.21: decoupled hybrid control with the identified stiffness, as printed and corrected."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.bench import Experiment, load, with_values
from palpate.bench.summary import losses
from palpate.records import Record
from palpate.report import style
from palpate.studies.metrics.following import SHARE
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import Axes, Figure, panels
from palpate_thesis.force_control.interventions import Disturbance, desired_pose, run_with
from palpate_thesis.force_control.tracking import since_contact, slot
from palpate_thesis.least_squares.panels import calm_limits
from palpate_thesis.runs import SHORT, SURFACES, VARIED_SEEDS, Runs, friction_and_pose, rougher, stops_holding

COUPLED = {"controller": {"kind": "proportional-integral", "kf": 1.0, "ki": 3.0}}
"""(4.13) with the thesis' gains on foam: 0.003 per sample is 3 per second."""
STEPS, JUMPS = (2.5, 5.0), (1.2, 6.2)
"""Times after contact at which the force steps, and at which y jumps [s]: at 10 N, where motor 2 has torque left."""
JUMP = 0.005
"""Of the desired y, there and back [m]."""
PRINTED = {"controller.form": "printed", "controller.kf": 1.0}


class Stray(NamedTuple):
    """Stray of one loop after steps of the other: largest within a second, mean over the steps."""

    y: float  # after a step of force [mm]
    phi: float  # likewise [deg]
    force: float  # after a jump of y, as a share of the desired force
    lost: int  # losses of contact


class CoupledAndDecoupled(NamedTuple):
    """The coupled law and the decoupled one, in the same world."""

    coupled: Stray
    decoupled: Stray
    stiffness: float  # as identified, which the decoupled law uses [N/m]

    @property
    def angle(self) -> float:
        """Stray of the angle under the decoupled law, over that under the coupled one."""
        return self.decoupled.phi / self.coupled.phi

    @property
    def side(self) -> float:
        """Stray of y under the decoupled law, over that under the coupled one."""
        return self.decoupled.y / self.coupled.y


def compare_laws(case: tuple[Experiment, int, Mapping[str, Any]]) -> CoupledAndDecoupled:
    """Run both laws in a world after K_e was identified there, with changes of the decoupled law, if any."""
    world, seed, law = case
    stiffness = identify_stiffness(world, seed)
    used = stiffness * law.get("wrong", 1.0)
    changes = {"controller.stiffness": used, **{k: v for k, v in law.items() if k != "wrong"}}
    coupled, decoupled = with_values(world, COUPLED), with_values(world, changes)
    return CoupledAndDecoupled(
        stray(press_with_jumps(coupled, seed)), stray(press_with_jumps(decoupled, seed)), stiffness
    )


def as_printed(case: tuple[CoupledAndDecoupled, Experiment, int]) -> CoupledAndDecoupled:
    """A pair with the law as printed in place of the corrected one."""
    pair, world, seed = case
    law = {"controller.stiffness": pair.stiffness, **PRINTED}
    return pair._replace(decoupled=stray(press_with_jumps(with_values(world, law), seed)))


def identify_stiffness(world: Experiment, seed: int) -> float:
    """K_e [N/m] by the matched estimator, after two seconds under the coupled law."""
    record = run_with(with_values(world, {**COUPLED, "run.press": 2.0}), seed, [])
    return float(record["K_matched"][-1])


def press_with_jumps(experiment: Experiment, seed: int) -> Record:
    """A press in whose course the desired y jumps."""
    jumps = [
        Disturbance(at, desired_pose(Vec3(0.0, sign * JUMP, 0.0)))
        for at, sign in zip(JUMPS, (1, -1), strict=True)
    ]
    return run_with(experiment, seed, jumps)


def stray(record: Record) -> Stray:
    """Stray of each loop after the steps of force and the jumps of y in a record."""
    t, force = since_contact(record), record["force"]
    begun = record["t"][0] - t[0]
    y = [furthest(t, record["y"], at) for at in STEPS]
    phi = [furthest(t, record["phi"], at) for at in STEPS]
    pushed = [furthest(t, force, at - begun) / 10.0 for at in record.meta["disturbances"]]
    return Stray(
        1e3 * float(np.mean(y)), float(np.degrees(np.mean(phi))), float(np.mean(pushed)), losses(record)
    )


def furthest(t: Array, signal: Array, at: float) -> float:
    """Largest distance of a signal within a second from its mean over the tenth of a second before."""
    before = signal[(t >= at - 0.1) & (t < at - 5e-7)].mean()
    return float(np.abs(signal[(t >= at - 5e-7) & (t < at + 1.0)] - before).max())


NUMBER = "4.19"
PARAMETERS = with_values(
    load("foam-decoupled"), {**SHORT, "run.press": 7.5, "force.first": 10.0, "force.second": 20.0}
)
FREE = {**rougher(PARAMETERS, 0.02), "wall.side_friction": 0.0}
HALF = 0.5
"""Maximum stray relative to that of the coupled law."""

SIGNALS = {"force": 1.0, "y": 1e3, "phi": float(np.degrees(1.0))}
"""Drawn columns, and their factors to N, mm and degrees."""
LAWS = ("(4.13), coupled", "(4.19) corrected", "(4.19) as printed")


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    traces: list[dict[str, Record]]  # as chosen, and with hardly any friction
    nominal: list[CoupledAndDecoupled]
    printed: list[CoupledAndDecoupled]
    varied: dict[str, list[CoupledAndDecoupled]]


def run(runs: Runs) -> Data:
    """Both laws in each world, after the stiffness was identified there."""
    nominal = runs.map(compare_laws, [(PARAMETERS, seed, {}) for seed in runs.seeds])
    printed = runs.map(
        as_printed, [(pair, PARAMETERS, seed) for pair, seed in zip(nominal, runs.seeds, strict=True)]
    )
    seeds = runs.seeds[:VARIED_SEEDS]
    cases = {name: [(e, seed, law) for seed in seeds] for name, (e, law) in _variations().items()}
    varied = {"as\nchosen": nominal, **runs.map_each(compare_laws, cases)}
    k = nominal[0].stiffness
    traces = [_traces(PARAMETERS, runs.seeds[0], k), _traces(with_values(PARAMETERS, FREE), runs.seeds[0], k)]
    return Data(traces, nominal, printed, varied)


MEASURES: Mapping[str, Callable[[CoupledAndDecoupled], float]] = {
    "angle": lambda p: 100 * p.angle,
    "side": lambda p: 100 * p.side,
    "coupled_phi": lambda p: p.coupled.phi,
    "coupled_y": lambda p: p.coupled.y,
    "coupled_force": lambda p: 100 * p.coupled.force,
    "decoupled_force": lambda p: 100 * p.decoupled.force,
    "stiffness": lambda p: p.stiffness / 1e3,
}
"""Numbers of the claims, as chosen and, by their names with "_free", with hardly any friction."""


def check(data: Data) -> Sequence[ThesisClaim]:
    """As printed, all has to hold at once; corrected, each direction by itself."""
    pairs = {"": data.nominal, "_free": data.varied["hardly any\nfriction"]}
    numbers = {
        n + kind: [m(p) for p in nominal] for kind, nominal in pairs.items() for n, m in MEASURES.items()
    }
    limits = {"jump": 1e3 * JUMP, "share": SHARE}
    printed = claim(
        "decoupled-control",
        often(map(_all, data.printed)),
        printed=data.printed,
        **limits,
    )
    parts = {"angle": angle_kept, "y": _side_kept, "force": force_kept}
    return [
        printed,
        *(
            claim(
                f"decoupled-control.{part}",
                often(map(holds, data.nominal)),
                where=stops_holding(data.varied, holds),
                **numbers,
                **limits,
            )
            for part, holds in parts.items()
        ),
    ]


def plot(data: Data) -> Figure:
    """Three signals in two worlds."""
    drawing, grid = panels([2.3, 1.6, 1.9], 2, 11.0)
    for column, traces in enumerate(data.traces):
        _column([row[column] for row in grid], traces)
    for axis, title in zip(grid[0], ("friction as chosen", "hardly any friction"), strict=True):
        axis.set_title(title)
    for (axis, _), label in zip(grid, ("true force [N]", "y [mm]", "angle [°]"), strict=False):
        axis.set_ylabel(label)
    handles, labels = grid[0][0].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside upper right", ncols=4)
    return drawing


def _column(axes: Sequence[Axes], traces: Mapping[str, Record]) -> None:
    colors = dict(zip(LAWS, style.SERIES[:3], strict=True))
    for name in reversed(LAWS):
        trace, pale = traces[name], name == LAWS[2]
        options: dict[str, Any] = {
            "color": colors[name],
            "linewidth": 0.7 if pale else 1.1,
            "alpha": 0.35 if pale else 1.0,
        }
        for axis, (signal, scale) in zip(axes, SIGNALS.items(), strict=True):
            axis.plot(trace["t"], scale * trace[signal], label=name, **options)
    shown = traces[LAWS[0]]
    axes[0].plot(shown["t"], shown["force_desired"], **style.KNOWN, label="desired")
    for axis, signal in zip(axes[1:], ("y", "phi"), strict=True):
        calm_limits(axis, *(SIGNALS[signal] * traces[name][signal] for name in LAWS[:2]), margin=0.12)
    axes[0].set_ylim(0.0, 32.0)
    for axis in axes:
        axis.set_xlim(0.0, PARAMETERS.run.press)
        for at in JUMPS:
            axis.axvline(at, color=style.INK, linewidth=0.7, linestyle=":")
    axes[-1].set_xlabel("time since contact [s]")


def angle_kept(pair: CoupledAndDecoupled) -> bool:
    """True if contact is kept and the angle strays at most half as far as under (4.13)."""
    return pair.decoupled.lost == 0 and pair.angle <= HALF


def _side_kept(pair: CoupledAndDecoupled) -> bool:
    return pair.decoupled.lost == 0 and pair.side <= HALF


def force_kept(pair: CoupledAndDecoupled) -> bool:
    """True if contact is kept and the force strays little."""
    return pair.decoupled.lost == 0 and pair.decoupled.force <= SHARE


def _all(pair: CoupledAndDecoupled) -> bool:
    return angle_kept(pair) and _side_kept(pair) and force_kept(pair)


def _variations() -> dict[str, tuple[Experiment, Mapping[str, Any]]]:
    """Other worlds, and a law that is wrong about K_e."""
    worlds: dict[str, Mapping[str, Any]] = {
        "hardly any\nfriction": FREE,
        **friction_and_pose(PARAMETERS),
        **{name: changes for name, changes in SURFACES.items() if changes},
    }
    return {
        **{name: (with_values(PARAMETERS, changes), {}) for name, changes in worlds.items()},
        "K_e half\nas large": (PARAMETERS, {"wrong": 0.5}),
        "K_e twice\nas large": (PARAMETERS, {"wrong": 2.0}),
    }


def _traces(world: Experiment, seed: int, stiffness: float) -> dict[str, Record]:
    known: dict[str, Any] = {"controller.stiffness": stiffness}
    laws = zip(LAWS, (COUPLED, known, {**known, **PRINTED}), strict=True)
    return {name: slot(press_with_jumps(with_values(world, law), seed)) for name, law in laws}
