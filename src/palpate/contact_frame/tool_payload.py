"""A payload from a log of free motion, or the orientations that the log lacks."""

from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.contact_frame import weighing
from palpate.contact_frame.free_motion import BLOCKS, MIN_ROWS, finite_rows, free_inertia
from palpate.contact_frame.payload import Payload, Vector
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, base_signals
from palpate.contact_frame.weighing_checks import force_noise, weighing_notes
from palpate.errors import InputError
from palpate.records import Record, Result
from palpate.signals.rotations import to_base, to_tool

_MIN_POSES_FOR_DRIFT = 3
"""Orientations of three axes each: weight, bias and drift are nine numbers."""
_MIN_VERTICAL_COSINE = 0.5**0.5
"""Cosine of the angle to the vertical at which a base is as near to one on a wall as to one that stands or hangs."""
_INERTIA_ROUNDS = 3
"""After a round the residual of the tool's acceleration is the relative error of its mass: of ten per cent
three rounds leave a thousandth."""
_SMOOTHING_WINDOW = 0.1
"""Length of the window in which an acceleration is fitted to the positions [s]. It passes motion below some 6 Hz, and
no arm turns its tool faster."""


@dataclass(frozen=True, eq=False, repr=False)
class Weighed(Result):
    """A tool's payload, estimated from a log.

    Args:
        payload: None if the poses do not determine it.
        parameters: by name, with intervals; those that are not told have an infinite one.
        lacking: the undetermined parts and the motion to add, a sentence each.
        notes: doubts about the log, as in a record's meta.
        poses: how many orientations there are.
        residual: root mean square of the model's residual, of an axis and the mean of an orientation [N].
        shown: measured and modelled force of each orientation, in the tool's axes [N], shape (g, 2, 3).
    """

    payload: Payload | None
    parameters: dict[str, weighing.Estimated]
    lacking: list[str]
    notes: list[dict[str, Any]]
    poses: int
    residual: float
    shown: Array = field(repr=False)

    def to_json(self) -> dict[str, Any]:
        """The payload as plain JSON values."""
        parameters = {
            name: {
                "value": parameter.value.tolist(),
                "std": parameter.std.tolist(),
                "ci95": [
                    (parameter.value - parameter.half).tolist(),
                    (parameter.value + parameter.half).tolist(),
                ],
                "unit": parameter.unit,
            }
            for name, parameter in self.parameters.items()
        }
        return {
            "payload": None if self.payload is None else msgspec.to_builtins(self.payload),
            "parameters": parameters,
            "lacking": self.lacking,
            "warnings": self.notes,
            "orientations": self.poses,
            "residual_N": self.residual,
        }


def weigh(record: Record, frame: ContactFrame, tolerance: float = 0.25) -> Weighed:
    """Find a tool's mass and centre, and the sensor's bias and drift, by a log of free motion.

    Args:
        record: wrench and pose, as `palpate.logs.read_wrench_and_pose` gives them.
        frame: how they stand to each other; its normal and its lever arm to the tip are not used.
        tolerance: largest half-width of the mass' 95 % interval, as a share of its value.

    Raises:
        InputError: the record has no orientation, or too few readings.
    """
    signals = base_signals(record, replace(frame, tcp=(0.0, 0.0, 0.0)))
    if not signals.oriented:
        raise InputError(
            "a tool is weighed by turning it, and this pose has no orientation; log one with it (--pose, --rotation)"
        )
    finite = finite_rows(signals.force)
    if finite.sum() < MIN_ROWS:
        raise InputError(f"only {int(finite.sum())} rows hold a force; at least {MIN_ROWS} are needed")
    still = signals
    for _ in range(
        _INERTIA_ROUNDS
    ):  # what the tool's own acceleration does is taken off as far as it is known
        fit = _fit(still, finite, tolerance)
        parameters = fit.parameters | _inertia(signals, fit, frame)
        still = _at_rest(signals, fit.fitted, parameters, frame)
        if still is signals:
            break
    poses = fit.poses
    fitted = fit.fitted
    lacking = _lacking(poses, fitted, tolerance)
    notes: list[dict[str, Any]] = []
    if np.isfinite(fitted.left_out).all():
        notes = weighing_notes(record, frame, signals, finite, replace(fit, parameters=parameters))
    return Weighed(
        None if lacking else _payload(parameters, signals, frame, signals.force[finite], poses.first),
        parameters,
        lacking,
        notes,
        len(poses.count),
        float(np.sqrt(np.average((fit.means**2).mean(axis=1), weights=poses.count))),
        np.stack([poses.signal, poses.signal - fit.means], axis=1),
    )


def _fit(signals: BaseSignals, finite: Mask, tolerance: float) -> weighing.PoseFit:
    time = signals.time[finite] - signals.time[finite].mean()
    turns = signals.rotations[finite]
    force = signals.force[finite]
    poses = weighing.poses_of(time, turns, force, weighing.groups_of(turns))
    fitted = _fit_with_drift(poses, tolerance)
    parameters = {"mass": fitted.mass, "weight": fitted.weight, "bias": fitted.bias}
    if fitted.drift is not None:
        parameters["drift"] = fitted.drift
    if np.isfinite(fitted.solution).all():
        parameters |= _centre(signals, finite, time, poses, fitted)
    residual = force - _model_force(time, turns, fitted)
    means = np.add.reduceat(residual, poses.first, axis=0) / poses.count[:, None]
    return weighing.PoseFit(poses, fitted, parameters, means)


def _at_rest(
    signals: BaseSignals,
    fitted: weighing.WeighingFit,
    parameters: dict[str, weighing.Estimated],
    frame: ContactFrame,
) -> BaseSignals:
    """Force and torque without the tool's inertia; unchanged if it is not determined."""
    from scipy.signal import savgol_filter

    side = weight_sign(fitted.solution[:3])
    inertia = parameters.get("inertia")
    dt = float(np.median(np.diff(signals.time)))
    if side is None or inertia is None or not abs(inertia.value) > inertia.half or not dt > 0.0:
        return signals
    rows = max(round(_SMOOTHING_WINDOW / dt) | 1, 5)
    centre = _centre_of(signals, parameters, frame)
    if len(centre) < rows or not np.isfinite(centre).all():
        return signals
    acceleration = savgol_filter(centre, rows, 3, deriv=2, delta=dt, axis=0)
    added = side * float(inertia.value) * to_tool(signals.rotations, acceleration)
    torque = signals.torque
    if torque is not None and "centre" in parameters:
        torque = torque + np.cross(parameters["centre"].value, added)
    return replace(signals, force=signals.force + added, torque=torque)


def _centre_of(signals: BaseSignals, parameters: dict[str, weighing.Estimated], frame: ContactFrame) -> Array:
    """Place of the centre of mass in the base [m], shape (n, 3); that of the sensor if it is not determined."""
    at = np.array(frame.wrench_at) + (parameters["centre"].value if "centre" in parameters else 0.0)
    centre: Array = signals.position + signals.rotations @ at
    return centre


def _fit_with_drift(poses: weighing.Poses, tolerance: float) -> weighing.WeighingFit:
    """Fit with a drift if the poses determine one beside the weight, without it otherwise."""
    if len(poses.count) < _MIN_POSES_FOR_DRIFT:
        return weighing.fit_force(poses, drift=False)
    with_drift = weighing.fit_force(poses, drift=True)
    without = weighing.fit_force(poses, drift=False)
    return (
        with_drift if _determines(with_drift, tolerance) or not _determines(without, tolerance) else without
    )


def _determines(fitted: weighing.WeighingFit, tolerance: float) -> bool:
    mass = fitted.mass
    return bool(np.isfinite(mass.half) and float(mass.half) <= max(tolerance * float(mass.value), 1e-3))


def _model_force(time: Array, turns: Array, fitted: weighing.WeighingFit) -> Array:
    solution = np.where(np.isfinite(fitted.solution), fitted.solution, 0.0)
    force: Array = to_tool(turns, solution[:3]) + solution[3:6]
    return force + time[:, None] * solution[6:] if len(solution) > 6 else force


def _lacking(poses: weighing.Poses, fitted: weighing.WeighingFit, tolerance: float) -> list[str]:
    """The undetermined direction, and the motion to add."""
    if _determines(fitted, tolerance) and poses.effective > 2.0:
        return []
    angles = np.degrees(np.sqrt(np.minimum(fitted.information, 1.0)))
    listed = f"{len(poses.count)} orientations (worth {poses.effective:.2g} of one length)"
    weak = [(angle, axis) for angle, axis in zip(angles, fitted.axes.T, strict=True) if angle < 15.0]
    if len(weak) == 3:
        text = (
            f"{listed}: the tool hardly turns ({angles[-1]:.2g} deg at most), so its weight cannot be told from the"
            " bias; rest in six orientations or more, 30 deg and more from each other, about two axes at least"
        )
        return [text]
    if weak:
        axis = weak[0][1]
        across = fitted.axes[:, -1]
        text = (
            f"{listed}: the weight along {_list_axes(axis)} of the base cannot be told from the bias, because the tool"
            f" turns it by {weak[0][0]:.2g} deg only; turn the tool by 30 deg and more about {_list_axes(across)} too"
        )
        return [text]
    fraction = float(fitted.mass.half / fitted.mass.value) if np.isfinite(fitted.mass.half) else np.inf
    wide = f"{fraction:.0%} of it" if np.isfinite(fraction) else "without bound"
    text = (
        f"{listed}: leaving one out moves the mass by too much (95 %: {wide}); add orientations, six or more of a"
        " second each, and come back to the first at the end, which tells the drift"
    )
    return [text]


def _centre(
    signals: BaseSignals, finite: Mask, time: Array, poses: weighing.Poses, fitted: weighing.WeighingFit
) -> dict[str, weighing.Estimated]:
    """Centre of mass and bias of the torque, if there is one."""
    if (
        signals.torque is None
        or not finite_rows(signals.torque[finite]).all()
        or not np.ptp(signals.torque[finite])
    ):
        return {}
    torque_poses = weighing.poses_of(time, signals.rotations[finite], signals.torque[finite], poses.first)
    torque_fit = weighing.fit_centre(torque_poses, fitted.solution[:3], drift=fitted.drift is not None)
    centre = torque_fit.jackknife(torque_fit.left_out[:, :3], torque_fit.solution[:3], "m")
    if not np.isfinite(centre.half).all():
        return {}
    # The centre is c = torque over weight, so the weight's own share of error is the centre's too.
    scale = float(fitted.mass.std / fitted.mass.value)
    std = np.hypot(centre.std, scale * np.abs(centre.value))
    half = np.hypot(centre.half, float(fitted.mass.half / fitted.mass.value) * np.abs(centre.value))
    bias = torque_fit.jackknife(torque_fit.left_out[:, 3:6], torque_fit.solution[3:6], "N m")
    return {"centre": weighing.Estimated(centre.value, std, half, "m"), "torque_bias": bias}


def _inertia(
    signals: BaseSignals, fit: weighing.PoseFit, frame: ContactFrame
) -> dict[str, weighing.Estimated]:
    """The mass by which the force follows the acceleration, if the tool is shaken."""
    from scipy.special import stdtrit

    side = weight_sign(fit.fitted.solution[:3])
    if side is None:
        return {}
    time = signals.time - signals.time[finite_rows(signals.force)].mean()
    unexplained = signals.force - _model_force(time, signals.rotations, fit.fitted)
    exerted = side * to_base(signals.rotations, unexplained)
    centre = _centre_of(signals, fit.parameters, frame)
    inertia = free_inertia(signals.time, exerted, centre, np.ones(len(time), bool))
    if inertia is None:
        return {}
    value, std = inertia
    return {
        "inertia": weighing.Estimated(
            np.array(value), np.array(std), np.array(float(stdtrit(BLOCKS - 1, 0.975)) * std), "kg"
        )
    }


def weight_sign(weight: Array) -> float | None:
    """1 where a sensor shows what the tool exerts on it, so that its weight points down; -1 for the opposite.

    None where the weight lies across the base's z: the base may hang on a wall.
    """
    size = float(np.linalg.norm(weight))
    if not (0.0 < size < np.inf) or abs(weight[2]) < _MIN_VERTICAL_COSINE * size:
        return None
    return 1.0 if weight[2] < 0 else -1.0


def _payload(
    parameters: dict[str, weighing.Estimated],
    signals: BaseSignals,
    frame: ContactFrame,
    force: Array,
    first: Indices,
) -> Payload:
    def vector(name: str) -> Vector | None:
        return _three(parameters[name].value) if name in parameters else None

    def worst(name: str) -> float:
        return float(parameters[name].std.max())

    return Payload(
        mass=float(parameters["mass"].value),
        mass_std=float(parameters["mass"].std),
        weight=_three(parameters["weight"].value),
        weight_std=worst("weight"),
        bias=_three(parameters["bias"].value),
        bias_std=worst("bias"),
        noise=force_noise(force, first),
        wrench_frame=signals.wrench_frame,
        sensor_rpy=frame.sensor_rpy,
        drift=vector("drift"),
        centre=vector("centre"),
        centre_std=worst("centre") if "centre" in parameters else None,
        inertia=float(parameters["inertia"].value) if "inertia" in parameters else None,
        inertia_std=float(parameters["inertia"].std) if "inertia" in parameters else None,
    )


def _three(values: Array) -> Vector:
    return float(values[0]), float(values[1]), float(values[2])


def _list_axes(vector: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.2g}" for value in np.round(vector, 2)) + ")"
