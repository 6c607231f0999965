"""Force controllers of others, as their parameter files describe them: the stable surfaces, and corrected numbers.

ros2-admittance: M xdd + D xd + S x = F, D = 2 zeta sqrt(M S), by the userdoc, the parameter file and the rule of
    admittance_controller in ros-controls/ros2_controllers. The arm follows late, by the delay.
fzi: xd = 0.01 s (p e + d e')/m of the force error e, for velocity interfaces: half of the acceleration over the
    internal period of 0.02 s, with a last link of m = 1 kg (ForwardDynamicsSolver, CartesianForceController and
    PDController of fzi-forschungszentrum-informatik/cartesian_controllers); e' is counted in the internal period.
crisp, franka: m xdd = k (x_d - x) - d xd of the tip's mass m, the torque late by the delay; d = 2 sqrt(k) where it is
    not given (controller details of utiasDSL/crisp_controllers; cartesian_impedance_example_controller of franka_ros).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import StringIO
from math import inf, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import InputError, unknown
from palpate.files import read_yaml
from palpate_certify.delayed_contact import LEAST, DelayedContact

ALPHA = 0.42
"""K T/D, with the lag of M/D in T, of corrected numbers: 3 % over with a pure delay (benchmarks/force/others.py)."""
SHARE = 0.99
"""Of the exact interval: as far up as it is proved."""
PERIOD, HALF = 0.02, 0.5
"""fzi: internal period [s], and the share of the acceleration over it that becomes the velocity."""
AXES = ("x", "y", "z")
STIFFEST = 5e4
"""Surfaces up to this are asked for by default [N/m]: what is felt of steel through an arm like the UR5e."""
REFUSED = {
    "ur": "force_mode's law is not published: damping and gain_scaling have no units in its manual; log a press, and "
    "use palpate identify and palpate tune",
}


TIMES = 9
"""Damping times B/K of the surface that are looked at, from 0 to the longest."""
UNCOVERED = (
    "sampling and filters, but for what the delay holds of them",
    "a surface's mass, and damping times B/K beyond those given (none without --damping-time)",
    "couplings between axes, link masses, and turning axes",
    "loss of contact, and limits of speed and torque",
)


class ControllerVerdict(NamedTuple):
    """Answer of `palpate certify --controller`, the corrected file, and the loop of the worst axis before and after.

    Args:
        answer: as JSON has it.
        text: of the file with corrected numbers.
        before: loop of the axis that is unstable first.
        after: the same loop with its corrected numbers; None if there are none.
    """

    answer: dict[str, Any]
    text: str
    before: DelayedContact
    after: DelayedContact | None


@dataclass(frozen=True)
class ControllerFile:
    """A parameter file, the delay [s], and the mass of the tip [kg]."""

    file: dict[str, Any]
    delay: float
    mass: float | None


Edits = list[tuple[Any, Any, float]]


@dataclass(frozen=True)
class ControlledAxis:
    """One direction of one controller in a file.

    Args:
        name: of the controller and the axis.
        loop: with its present numbers.
        correct: loop with which surfaces up to a stiffness are stable, None if there is none; and the numbers of it,
            each with its place in the file and its key.
    """

    name: str
    loop: DelayedContact
    correct: Callable[[float], tuple[DelayedContact | None, Edits]]


# More than seven arguments: each is an option of the command.
def certify_controller(
    path: Path,
    controller: str,
    delay: float,
    mass: float | None = None,
    stiffest: float = STIFFEST,
    damping_time: float = 0.0,
) -> ControllerVerdict:
    """Stable surfaces of a controller's parameter file, and the file with corrected numbers.

    Args:
        path: of the YAML file.
        controller: ros2-admittance, fzi, crisp or franka.
        delay: everything that is late between contact and motion [s].
        mass: of the tip, for crisp and franka [kg].
        stiffest: surface that the corrected numbers are for [N/m].
        damping_time: longest B/K of the surface [s]; `TIMES` of them are looked at, from 0 on.

    Raises:
        InputError: another controller, or a file without its numbers.
    """
    if controller in REFUSED:
        raise InputError(f"--controller {controller}: {REFUSED[controller]}")
    if controller not in READERS:
        raise unknown("controller", controller, [*READERS, *REFUSED])
    if not 0.0 < delay < 10.0 or not 0.0 < stiffest < inf or not (mass is None or 0.0 < mass < inf):
        raise InputError("the delay must be above 0 and below 10 s, stiffness and mass above 0")
    if not 0.0 <= damping_time <= 10.0:
        raise InputError(f"the damping time must be from 0 to 10 s, got {damping_time:g}")
    file, parser = read_yaml(path, "a parameter file")
    setting = ControllerFile(file, delay, mass)
    axes = [axis for name, own in _nodes(file) for axis in READERS[controller](name, own, setting)]
    if not axes:
        raise InputError(f"{path}: no settings of {controller}; {WANTED[controller]}")
    times = np.linspace(0.0, damping_time, TIMES).tolist() if damping_time else [0.0]
    ends = [_edge(axis.loop, times) for axis in axes]
    first = min(ends)
    worst = axes[ends.index(first)]
    high = SHARE * min(first, 1e9)
    proved = high > 0.0 and all(_proves(axis.loop, times, high) for axis in axes)
    corrected = _correction(axes, ends, stiffest, times)
    out = StringIO()
    parser.dump(file, out)
    answer = {
        "controller": controller,
        "delay_s": delay,
        "damping_times_s": times,
        "asked": stiffest,
        "proved": {"stiffness": [LEAST * high, high] if proved else None},
        "exact": {"stiffness": [0.0, _finite(first)]},
        "first_unstable": {"stiffness": first, "axis": worst.name} if first < inf else None,
        "axes": {axis.name: _finite(end) for axis, end in zip(axes, ends, strict=True)},
        "corrected": corrected,
    }
    after = worst.correct(stiffest)[0] if corrected else None
    return ControllerVerdict(answer, out.getvalue(), worst.loop, after)


def _edge(loop: DelayedContact, times: list[float]) -> float:
    """Lowest first unstable stiffness over surfaces of these damping times [N/m]."""
    return min(loop.on_damped(time).first_unstable() for time in times)


def _proves(loop: DelayedContact, times: list[float], high: float) -> bool:
    """Whether a loop is proved up to a stiffness on surfaces of each of these damping times."""
    return all(loop.on_damped(time).proves(LEAST * high, high) for time in times)


def _correction(
    axes: list[ControlledAxis], ends: list[float], stiffest: float, times: list[float]
) -> dict[str, Any] | None:
    """Numbers with which all axes are proved up to a stiffness, entered into the file; None if there are none."""
    loops, edits, changed = [], [], []
    for axis, end in zip(axes, ends, strict=True):
        loop, own = axis.correct(stiffest)
        if loop is None:
            return None
        own = [(place, key, value) for place, key, value in own if place[key] != value]
        if own and (SHARE * end <= stiffest or axis.loop.plain[0] or any(axis.loop.late_surface)):
            changed.append(axis.name)
            edits += own
        loops.append(loop)
    if not all(_proves(loop, times, stiffest) for loop in loops):
        return None
    for place, key, value in edits:
        place[key] = value
    after = min(_edge(loop, times) for loop in loops)
    return {"stiffness": [LEAST * stiffest, stiffest], "exact": [0.0, _finite(after)], "changed": changed}


def _finite(value: float) -> float | None:
    return value if value < inf else None


def _nodes(file: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Parameters of each controller, of ROS 2 and of ROS 1."""
    for name, own in file.items():
        inside = own.get("ros__parameters", own) if isinstance(own, dict) else None
        if isinstance(inside, dict):
            yield str(name), inside
    yield "", file


def _number(place: Any, key: Any, where: str, least: float = 0.0) -> float:
    """A number of the file, at least so much."""
    try:
        value = place[key]
    except (KeyError, IndexError, TypeError):
        raise InputError(f"{where}: {key} is missing") from None
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < inf:
        raise InputError(f"{where}: {key} must be a number of at least {least:g}, got {value!r}")
    return float(value)


def _admittance(name: str, own: dict[str, Any], setting: ControllerFile) -> Iterator[ControlledAxis]:
    own = own.get("admittance") or {}
    if not isinstance(own, dict) or "damping_ratio" not in own:
        return
    chosen = own.get("selected_axes", [True] * 6)
    for i, axis in enumerate(AXES):
        where = f"{name}.admittance, {axis}"
        if not isinstance(chosen, list) or len(chosen) != 6:
            raise InputError(f"{where}: selected_axes must be six of true and false")
        if not chosen[i]:
            continue
        M, S, ratio = (
            _number(own.get(key), i, f"{where}, {key}", 1e-6)
            for key in ("mass", "stiffness", "damping_ratio")
        )
        yield _one_admittance(f"{name}.{axis}", (own["damping_ratio"], i), (M, ratio, S), setting.delay)


def _one_admittance(
    name: str, place: tuple[Any, Any], numbers: tuple[float, float, float], T: float
) -> ControlledAxis:
    M, ratio, S = numbers

    def loop(zeta: float) -> DelayedContact:
        return DelayedContact(T, (S, 2.0 * zeta * sqrt(M * S), M), late_surface=(1.0,))

    def correct(K: float) -> tuple[DelayedContact | None, Edits]:
        half = 0.5 * K * T / ALPHA
        needed = float(f"{(half + sqrt(half**2 + K * M / ALPHA)) / (2.0 * sqrt(M * S)):.6g}")
        return loop(max(needed, ratio)), [(*place, max(needed, ratio))]

    return ControlledAxis(name, loop(ratio), correct)


def _fzi(name: str, own: dict[str, Any], setting: ControllerFile) -> Iterator[ControlledAxis]:
    gains, kind = own.get("pd_gains"), str(own.get("type", ""))
    if not isinstance(gains, dict) or "Motion" in kind or "stiffness" in own:
        return
    interfaces = own.get("command_interfaces", [])
    if "velocity" not in [*(interfaces if isinstance(interfaces, list) else []), kind.partition("_")[0]]:
        raise InputError(
            f"{name}: its command interface is not velocity; to position interfaces it commands a step from where the "
            "arm was measured, so that the loop depends on the arm's servo, which the file does not describe"
        )
    solver = own.get("solver", {})
    scale = _number(solver, "error_scale", name, 1e-9) if "error_scale" in solver else 1.0
    for axis in AXES:
        place = gains.get(f"trans_{axis}")
        if place is not None:
            where = f"{name}.pd_gains.trans_{axis}"
            p, d = _number(place, "p", where, 1e-12), _number(place, "d", where) if "d" in place else 0.0
            manager = setting.file.get("controller_manager", {})
            rate = _number(manager.get("ros__parameters", manager), "update_rate", where, 1.0) if d else 1.0
            g = HALF * PERIOD * scale
            yield _one_fzi(f"{name}.{axis}", place, (g * p, g * d / rate / PERIOD), setting.delay)


def _one_fzi(name: str, place: Any, late: tuple[float, float], T: float) -> ControlledAxis:
    def loop(factor: float) -> DelayedContact:
        return DelayedContact(T, (0.0, 1.0), late_surface=(factor * late[0], factor * late[1]))

    def correct(K: float) -> tuple[DelayedContact | None, Edits]:
        factor = min(1.0, ALPHA / (K * T * late[0]))
        return loop(factor), [
            (place, key, float(f"{factor * place[key]:.6g}")) for key in ("p", "d") if key in place
        ]

    return ControlledAxis(name, loop(1.0), correct)


def _impedance(name: str, own: dict[str, Any], setting: ControllerFile) -> Iterator[ControlledAxis]:
    task: dict[str, Any] = own["task"] if isinstance(own.get("task"), dict) else own
    keys = (
        [(f"k_pos_{a}", f"d_pos_{a}") for a in AXES]
        if "k_pos_x" in task
        else [("translational_stiffness", "")]
    )
    for stiff, damp in keys:
        if stiff not in task:
            continue
        if setting.mass is None:
            raise InputError(f"{name}: an impedance needs the mass of the tip along the normal; give --mass")
        k = _number(task, stiff, name, 1e-6)
        given = _number(task, damp, name, -1.0) if damp in task else -1.0
        d = 2.0 * sqrt(k) if given < 0.0 else given
        yield _one_impedance(f"{name}.{stiff}", (task, stiff, damp if given >= 0.0 else ""), (k, d), setting)


def _one_impedance(
    name: str, place: tuple[Any, str, str], gains: tuple[float, float], setting: ControllerFile
) -> ControlledAxis:
    task, stiff, damp = place

    def loop(factor: float) -> DelayedContact:
        late = (factor * gains[0], sqrt(factor) * gains[1])
        return DelayedContact(setting.delay, (0.0, 0.0, setting.mass or 1.0), late=late, surface=(1.0,))

    def correct(K: float) -> tuple[DelayedContact | None, Edits]:
        for factor in (0.5**i for i in range(20)):
            if loop(factor).first_unstable() * SHARE > K:
                new = zip((stiff, damp), loop(factor).late, strict=True)
                return loop(factor), [(task, key, float(f"{value:.6g}")) for key, value in new if key]
        return None, []

    return ControlledAxis(name, loop(1.0), correct)


READERS: dict[str, Callable[..., Iterator[ControlledAxis]]] = {
    "ros2-admittance": _admittance,
    "fzi": _fzi,
    "crisp": _impedance,
    "franka": _impedance,
}
WANTED = {
    "ros2-admittance": "admittance with mass, damping_ratio and stiffness is wanted",
    "fzi": "pd_gains of a force controller are wanted",
    "crisp": "task with k_pos_x, ... is wanted",
    "franka": "translational_stiffness is wanted",
}
