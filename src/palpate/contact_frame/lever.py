"""Does the force pass through the point that is said to touch? A check of lever arm, axes and torque."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Mask
from palpate.contact_frame.declared import ContactFrame
from palpate.contact_frame.signals_in_base import Signals
from palpate.contact_frame.vectors import FEWEST, read_rows

_LEAST = 0.3
"""Of the largest force: the line of a weaker one is three times as uncertain, for the same noise of the torque."""


def line_misses_tcp(signals: Signals, free: Mask, inside: Mask, frame: ContactFrame) -> float | None:
    """How far the contact force's line of action passes from the tool centre point [m]; the median over the contact.

    A force f at r gives the torque r x f about the point that the torque is about, so the line is at
    |f x (tau - r x f)| / |f|^2 from r. None without a torque, or where the log does not show its bias.

    Args:
        signals: force and torque in the tool's axes.
        free: rows in which nothing is touched, shape (n,).
        inside: rows in contact, shape (n,).
        frame: the lever arm.
    """
    if signals.torque is None:
        return None
    there = read_rows(signals.force) & read_rows(signals.torque)
    free, inside = free & there, inside & there
    if free.sum() < FEWEST or inside.sum() < FEWEST or not np.ptp(signals.torque[there]):
        return None
    force = signals.force[inside] - signals.force[free].mean(axis=0)
    torque = signals.torque[inside] - signals.torque[free].mean(axis=0)
    size = np.linalg.norm(force, axis=1)
    strong = size > _LEAST * size.max()
    lever = np.array(frame.tcp) - np.array(frame.wrench_at)
    left = torque[strong] - np.cross(lever, force[strong])
    return float(np.median(np.linalg.norm(np.cross(force[strong], left), axis=1) / size[strong] ** 2))
