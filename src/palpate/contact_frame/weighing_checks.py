"""Checks of a log for weighing: wrong frame, contact, saturation, wrong compensation of the inertia."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.contact_frame import weighing
from palpate.contact_frame.free_motion import CHANCE, wrong_sign
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, signals_of
from palpate.identification.sample_clock import at_limit
from palpate.records import Record

_REFINED = 4
"""Of the cube's 24 turns as many are equally near to a turn at worst, where corners of their cells meet."""
_FINE = np.radians(2.0)
"""Within which a mean of rotations is as good as a rotation [rad]: it is shorter by a sixth of the square, 2e-4."""


def notes_against(
    record: Record, frame: ContactFrame, signals: BaseSignals, there: Mask, fit: weighing.PoseFit
) -> list[dict[str, Any]]:
    """Notes, as a record's meta has them.

    Args:
        record: of wrench and pose.
        frame: as declared.
        signals: of both.
        there: rows that hold a force, shape (n,).
        fit: of them.
    """
    notes = [
        *_saturation_notes(signals, there, fit.fitted),
        *_another_frame(record, frame, signals, there, fit.poses, fit.fitted),
        *_touch_notes(signals.time[there], fit.poses, fit.means),
        *_inertia(fit.parameters),
    ]
    if signals.guess:
        notes.append({"code": "frame-guess", "text": f"{signals.guess}; say --wrench-frame if it is not so"})
    if not any(note["code"] == "pose-frame" for note in notes):
        notes += _tare_notes(fit.parameters)
    return notes


def _saturation_notes(
    signals: BaseSignals, there: Mask, fitted: weighing.WeighingFit
) -> list[dict[str, Any]]:
    """Axes that rest at their extreme value while the weight turns in the sensor."""
    weight = np.einsum("nji,j->ni", signals.rotations[there], fitted.whole[:3])
    stuck = 0
    for axis in signals.recorded[there].T:
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
    there: Mask,
    poses: weighing.Poses,
    fitted: weighing.WeighingFit,
) -> list[dict[str, Any]]:
    """Whether the forces fit another reading of the poses, or of the axes, so much better that chance is out."""
    if _misfit(poses, fitted.whole) < _by_noise(signals.force[there], poses):
        return []
    time, turns = signals.time[there] - signals.time[there].mean(), signals.rotations[there]
    fine = weighing.poses_of(time, turns, signals.force[there], weighing.groups_of(turns, _FINE))
    own = _misfit(fine, weighing.solve_force(fine, drift=len(fitted.whole) > 6))
    readings = {
        "the pose is of the base in the tool: give its inverse": _invert(fine),
        **_in_other_axes(record, frame, fine),
    }
    found = [
        (_misfit(other, weighing.solve_force(other, drift=False)), text) for text, other in readings.items()
    ]
    turn = _best_rotation(fine)
    if turn is not None:
        rpy, misfit = turn
        if np.degrees(np.linalg.norm(rpy)) > 2.0:
            said = ",".join(f"{angle:.3g}" for angle in np.degrees(rpy))
            found.append((misfit, f"the wrench's axes are turned against those told: --sensor-rpy {said}"))
    rows = 3 * len(poses.count)
    best = min((misfit for misfit, _ in found), default=own)
    if not _better(own, best, rows):
        return []
    readings_left = [text for misfit, text in found if not _better(misfit, best, rows)]
    text = (
        f"the forces do not fit the poses as they were told ({np.sqrt(own):.3g} N are left), but do if"
        f" {', or '.join(readings_left)}"
    )
    return [{"code": "pose-frame", "text": text}]


def _better(own: float, other: float, rows: int) -> bool:
    """By Fisher's test of two mean squares of that many rows."""
    from scipy.special import fdtri

    dof = rows - 9
    return dof > 0 and own > max(other, 1e-12) * float(fdtri(dof, dof, 1 - CHANCE))


def noise_of(force: Array, first: Indices) -> float:
    """Standard deviation of a reading of an axis [N], by the steps between readings of one orientation."""
    steps = np.delete(np.diff(force, axis=0), first[1:] - 1, axis=0)
    return float(np.sqrt(np.mean(steps**2) / 2.0)) if len(steps) else 0.0


def _by_noise(force: Array, poses: weighing.Poses) -> float:
    """The largest mean square of the orientations' means that white noise of the readings leaves by chance [N^2]."""
    from scipy.special import chdtri

    rows = 3 * len(poses.count)
    share = float(chdtri(rows, CHANCE)) / rows
    return noise_of(force, poses.first) ** 2 * len(poses.count) / poses.count.sum() * share


def _misfit(poses: weighing.Poses, whole: Array) -> float:
    """Mean square of the residuals of the orientations' means [N^2]."""
    left = poses.signal - np.einsum("gji,j->gi", poses.turns, whole[:3]) - whole[3:6]
    if len(whole) > 6:
        left = left - poses.times[:, :1] * whole[6:]
    return float(np.average((left**2).mean(axis=1), weights=poses.count))


def _invert(poses: weighing.Poses) -> weighing.Poses:
    turns = poses.turns.transpose(0, 2, 1)
    in_base = np.einsum("gij,gj->gi", turns, poses.signal)
    return replace(poses, turns=turns, turns_t=poses.turns_t.transpose(0, 2, 1), in_base=in_base)


def _in_other_axes(record: Record, frame: ContactFrame, poses: weighing.Poses) -> dict[str, weighing.Poses]:
    """The wrench read in the base's axes if declared in the tool's, and the other way round."""
    found = {}
    for axes in ("base", "tool"):
        if axes == (frame.wrench_frame or "tool"):
            continue
        other = signals_of(record, replace(frame, wrench_frame=axes, sensor_rpy=None, tcp=(0.0, 0.0, 0.0)))
        rows = np.isfinite(other.force).all(axis=1)
        time = other.time[rows] - other.time[rows].mean()
        text = f"the wrench is in the {axes}'s axes: --wrench-frame {axes}"
        found[text] = weighing.poses_of(time, other.rotations[rows], other.force[rows], poses.first)
    return found


def _best_rotation(poses: weighing.Poses) -> tuple[Array, float] | None:
    """Roll, pitch and yaw [rad] of the best rotation of the wrench's axes, and the residual [N^2]."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    weights = np.sqrt(poses.count / poses.count.sum() / 3.0)[:, None]

    def residual_of(x: Array) -> Array:
        shown = Rotation.from_rotvec(x[:3]).inv().apply(np.einsum("gji,j->gi", poses.turns, x[3:6]))
        return ((poses.signal - shown - x[6:9]) * weights).ravel()

    if 3 * len(poses.count) <= 9:
        return None
    starts = []
    for turn in Rotation.create_group("O"):  # with the turn held, all else is linear
        other = _in_axes(poses, turn.as_matrix())
        fit = weighing.solve_force(other, drift=False)
        if np.isfinite(fit).all():
            start = np.r_[turn.as_rotvec(), fit[:3], turn.inv().apply(fit[3:6])]
            starts.append((_misfit(other, fit), start))
    nearest = sorted(starts, key=lambda one: one[0])[:_REFINED]
    found = [least_squares(residual_of, start, max_nfev=40) for _, start in nearest]
    if not found:
        return None
    best = min(found, key=lambda one: one.cost)
    return Rotation.from_rotvec(best.x[:3]).as_euler("xyz"), 2.0 * float(best.cost)


def _in_axes(poses: weighing.Poses, turn: Array) -> weighing.Poses:
    """The wrench in axes that are rotated against the declared ones."""
    signal = poses.signal @ turn.T
    in_base = np.einsum("gij,gj->gi", poses.turns, signal)
    return replace(poses, signal=signal, signal_t=poses.signal_t @ turn.T, in_base=in_base)


def _touch_notes(time: Array, poses: weighing.Poses, means: Array) -> list[dict[str, Any]]:
    """An interval whose force contradicts the prediction from the others."""
    from scipy.special import fdtri

    size = np.sum(means**2, axis=1)
    worst = int(np.argmax(size))
    others = np.delete(size, worst)
    if len(others) < 3 or not others.sum() > 0:
        return []
    ratio = float(size[worst] / others.mean())
    if ratio < float(fdtri(3, 3 * len(others), 1 - CHANCE / len(size))):
        return []
    ends = np.r_[poses.first, len(time)]
    begin, end = time[ends[worst]], time[ends[worst + 1] - 1]
    text = (
        f"from {begin:.4g} to {end:.4g} s the force is {np.sqrt(size[worst]):.2g} N off a tool's in free motion: was"
        " something touched, or a cable drawn? leave that stretch out (--start, --end)"
    )
    return [{"code": "not-free", "text": text}]


def _inertia(parameters: dict[str, weighing.Estimated]) -> list[dict[str, Any]]:
    if "inertia" not in parameters:
        return []
    found, mass = parameters["inertia"], parameters["mass"]
    if wrong_sign((float(found.value), float(found.std))):
        text = (
            f"in free motion the force follows the acceleration as of a mass of {found.value:.3g} kg: the tool's"
            " inertia is compensated with the wrong sign, or twice; correct that, or the surface's damping and lag are"
            " wrong"
        )
        return [{"code": "tool-inertia", "text": text}]
    if found.value - found.half > mass.value + mass.half:
        text = f"the force follows the acceleration as {found.value:.3g} kg, and {mass.value:.3g} kg hang"
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
