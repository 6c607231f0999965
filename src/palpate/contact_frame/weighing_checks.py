"""Checks of a log for weighing: wrong frame, contact, saturation, wrong compensation of the inertia."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.contact_frame import weighing
from palpate.contact_frame.free_motion import FALSE_ALARM_RATE, has_wrong_sign
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, base_signals
from palpate.identification.sample_clock import at_limit
from palpate.records import Record
from palpate.signals.rotations import to_base, to_tool

_REFINED_STARTS = 4
"""Starts of the search that are refined: at most so many of the cube's 24 rotations are equally near to a rotation."""
_FINE_GROUP_ANGLE = np.radians(2.0)
"""Angle within which a mean of rotations serves as a rotation [rad]: it is shorter by a sixth of the square, 2e-4."""


def weighing_notes(
    record: Record, frame: ContactFrame, signals: BaseSignals, finite: Mask, fit: weighing.PoseFit
) -> list[dict[str, Any]]:
    """Notes, as a record's meta has them.

    Args:
        record: of wrench and pose.
        frame: as declared.
        signals: of both.
        finite: rows that hold a force, shape (n,).
        fit: of them.
    """
    notes = [
        *_saturation_notes(signals, finite, fit.fitted),
        *_another_frame(record, frame, signals, finite, fit.poses, fit.fitted),
        *_touch_notes(signals.time[finite], fit.poses, fit.means),
        *_inertia(fit.parameters),
    ]
    if signals.guess:
        notes.append({"code": "frame-guess", "text": f"{signals.guess}; say --wrench-frame if it is not so"})
    if not any(note["code"] == "pose-frame" for note in notes):
        notes += _tare_notes(fit.parameters)
    return notes


def _saturation_notes(
    signals: BaseSignals, finite: Mask, fitted: weighing.WeighingFit
) -> list[dict[str, Any]]:
    """Axes that rest at their extreme value while the weight turns in the sensor."""
    weight = to_tool(signals.rotations[finite], fitted.solution[:3])
    stuck = 0
    for axis in signals.recorded[finite].T:
        if np.ptp(axis):
            stuck += int(at_limit(axis, weight, (axis.max(), axis.min())).sum())
    if not stuck:
        return []
    text = f"an axis of the force rests at its extreme value for {stuck} rows: unload or tare the sensor, weigh again"
    return [{"code": "saturated", "text": text}]


def _another_frame(
    record: Record,
    frame: ContactFrame,
    signals: BaseSignals,
    finite: Mask,
    poses: weighing.Poses,
    fitted: weighing.WeighingFit,
) -> list[dict[str, Any]]:
    """Notes if the forces fit other axes or the inverse poses better, by more than chance."""
    if _misfit(poses, fitted.solution) < _max_misfit_by_noise(signals.force[finite], poses):
        return []
    time = signals.time[finite] - signals.time[finite].mean()
    turns = signals.rotations[finite]
    fine = weighing.poses_of(time, turns, signals.force[finite], weighing.groups_of(turns, _FINE_GROUP_ANGLE))
    declared_misfit = _misfit(fine, weighing.solve_force(fine, drift=len(fitted.solution) > 6))
    readings = {
        "the pose is of the base in the tool: give its inverse": _invert(fine),
        **_in_other_axes(record, frame, fine),
    }
    misfits = [
        (_misfit(reread, weighing.solve_force(reread, drift=False)), text)
        for text, reread in readings.items()
    ]
    turn = _best_rotation(fine)
    if turn is not None:
        rpy, misfit = turn
        if np.degrees(np.linalg.norm(rpy)) > 2.0:
            angles = ",".join(f"{angle:.3g}" for angle in np.degrees(rpy))
            misfits.append(
                (misfit, f"the wrench's axes are turned against those told: --sensor-rpy {angles}")
            )
    rows = 3 * len(poses.count)
    best = min((misfit for misfit, _ in misfits), default=declared_misfit)
    if not _better(declared_misfit, best, rows):
        return []
    readings_left = [text for misfit, text in misfits if not _better(misfit, best, rows)]
    text = (
        f"the forces do not fit the poses as they were told ({np.sqrt(declared_misfit):.3g} N are left), but do if"
        f" {', or '.join(readings_left)}"
    )
    return [{"code": "pose-frame", "text": text}]


def _better(mean_square: float, other_mean_square: float, rows: int) -> bool:
    """True if one mean square is smaller than another by Fisher's test, for that many rows."""
    from scipy.special import fdtri

    dof = rows - 9
    return dof > 0 and mean_square > max(other_mean_square, 1e-12) * float(
        fdtri(dof, dof, 1 - FALSE_ALARM_RATE)
    )


def force_noise(force: Array, first: Indices) -> float:
    """Standard deviation of a reading of an axis [N], by the steps between readings of one orientation."""
    steps = np.delete(np.diff(force, axis=0), first[1:] - 1, axis=0)
    return float(np.sqrt(np.mean(steps**2) / 2.0)) if len(steps) else 0.0


def _max_misfit_by_noise(force: Array, poses: weighing.Poses) -> float:
    """The largest mean square of the orientations' means that white noise of the readings leaves by chance [N^2]."""
    from scipy.special import chdtri

    rows = 3 * len(poses.count)
    quantile = float(chdtri(rows, FALSE_ALARM_RATE)) / rows
    return force_noise(force, poses.first) ** 2 * len(poses.count) / poses.count.sum() * quantile


def _misfit(poses: weighing.Poses, solution: Array) -> float:
    """Mean square of the residuals of the orientations' means [N^2]."""
    residual = poses.signal - to_tool(poses.turns, solution[:3]) - solution[3:6]
    if len(solution) > 6:
        residual = residual - poses.times[:, :1] * solution[6:]
    return float(np.average((residual**2).mean(axis=1), weights=poses.count))


def _invert(poses: weighing.Poses) -> weighing.Poses:
    turns = poses.turns.transpose(0, 2, 1)
    in_base = to_base(turns, poses.signal)
    return replace(poses, turns=turns, turns_t=poses.turns_t.transpose(0, 2, 1), in_base=in_base)


def _in_other_axes(record: Record, frame: ContactFrame, poses: weighing.Poses) -> dict[str, weighing.Poses]:
    """The wrench read in the base's axes if declared in the tool's, and the other way round."""
    reread = {}
    for axes in ("base", "tool"):
        if axes == (frame.wrench_frame or "tool"):
            continue
        signals = base_signals(
            record, replace(frame, wrench_frame=axes, sensor_rpy=None, tcp=(0.0, 0.0, 0.0))
        )
        rows = np.isfinite(signals.force).all(axis=1)
        time = signals.time[rows] - signals.time[rows].mean()
        text = f"the wrench is in the {axes}'s axes: --wrench-frame {axes}"
        reread[text] = weighing.poses_of(time, signals.rotations[rows], signals.force[rows], poses.first)
    return reread


def _best_rotation(poses: weighing.Poses) -> tuple[Array, float] | None:
    """Roll, pitch and yaw [rad] of the best rotation of the wrench's axes, and the residual [N^2]."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    weights = np.sqrt(poses.count / poses.count.sum() / 3.0)[:, None]

    def residual_of(x: Array) -> Array:
        weight = Rotation.from_rotvec(x[:3]).inv().apply(to_tool(poses.turns, x[3:6]))
        return ((poses.signal - weight - x[6:9]) * weights).ravel()

    if 3 * len(poses.count) <= 9:
        return None
    starts = []
    for turn in Rotation.create_group("O"):  # with the turn held, all else is linear
        rotated = _in_axes(poses, turn.as_matrix())
        fit = weighing.solve_force(rotated, drift=False)
        if np.isfinite(fit).all():
            start = np.r_[turn.as_rotvec(), fit[:3], turn.inv().apply(fit[3:6])]
            starts.append((_misfit(rotated, fit), start))
    nearest = sorted(starts, key=lambda candidate: candidate[0])[:_REFINED_STARTS]
    refined = [least_squares(residual_of, start, max_nfev=40) for _, start in nearest]
    if not refined:
        return None
    best = min(refined, key=lambda candidate: candidate.cost)
    return Rotation.from_rotvec(best.x[:3]).as_euler("xyz"), 2.0 * float(best.cost)


def _in_axes(poses: weighing.Poses, turn: Array) -> weighing.Poses:
    """The wrench in axes that are rotated against the declared ones."""
    signal = poses.signal @ turn.T
    in_base = to_base(poses.turns, signal)
    return replace(poses, signal=signal, signal_t=poses.signal_t @ turn.T, in_base=in_base)


def _touch_notes(time: Array, poses: weighing.Poses, means: Array) -> list[dict[str, Any]]:
    """An interval whose force contradicts the prediction from the others."""
    from scipy.special import fdtri

    size = np.sum(means**2, axis=1)
    worst = int(np.argmax(size))
    remaining = np.delete(size, worst)
    if len(remaining) < 3 or not remaining.sum() > 0:
        return []
    ratio = float(size[worst] / remaining.mean())
    if ratio < float(fdtri(3, 3 * len(remaining), 1 - FALSE_ALARM_RATE / len(size))):
        return []
    ends = np.r_[poses.first, len(time)]
    begin = time[ends[worst]]
    end = time[ends[worst + 1] - 1]
    text = (
        f"from {begin:.4g} to {end:.4g} s the force is {np.sqrt(size[worst]):.2g} N off a tool's in free motion: was"
        " something touched, or a cable drawn? leave that stretch out (--start, --end)"
    )
    return [{"code": "not-free", "text": text}]


def _inertia(parameters: dict[str, weighing.Estimated]) -> list[dict[str, Any]]:
    if "inertia" not in parameters:
        return []
    inertia = parameters["inertia"]
    mass = parameters["mass"]
    if has_wrong_sign((float(inertia.value), float(inertia.std))):
        text = (
            f"in free motion the force follows the acceleration as of a mass of {inertia.value:.3g} kg: the tool's"
            " inertia is compensated with the wrong sign, or twice; correct that, or the surface's damping and lag are"
            " wrong"
        )
        return [{"code": "tool-inertia", "text": text}]
    if inertia.value - inertia.half > mass.value + mass.half:
        text = f"the force follows the acceleration as {inertia.value:.3g} kg, and {mass.value:.3g} kg hang"
        return [
            {
                "code": "tool-inertia",
                "text": f"{text}: is the weight compensated already, but not the inertia?",
            }
        ]
    return []


def _tare_notes(parameters: dict[str, weighing.Estimated]) -> list[dict[str, Any]]:
    size = float(np.linalg.norm(parameters["bias"].value))
    weight = float(np.linalg.norm(parameters["weight"].value))
    if size <= weight:
        return []
    text = f"the sensor's bias of {size:.3g} N is larger than the tool's weight of {weight:.3g} N: tare before contact"
    return [{"code": "untared", "text": text}]
