"""When contact is made, lost or kept; how near the motors are to their limits; where the tip is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.bench.metrics.summary import losses
from palpate.bench.metrics.window import Look, Metric, Value
from palpate.bench.sequence import LOST

JOINTS = (1, 2, 3)


def time_to_loss(look: Look) -> Value:
    """From the first contact to its first loss, or to where numbers are none [s]; None if it is kept."""
    if not look.touched:
        return None
    lost = np.flatnonzero((look.record["phase"] == LOST) & (look.since > 0.0))
    if len(lost):
        return float(look.since[lost[0]])
    return float(look.since[-1]) if look.ended else None


def _kept(look: Look) -> Value:
    """As `time_to_loss`, or to the end of the run."""
    if not look.touched:
        return 0.0
    lost = time_to_loss(look)
    return float(look.since[-1]) if lost is None else lost


def _saturated(*joints: int) -> Callable[[Look], Value]:
    def of(look: Look) -> Value:
        if not len(look.error):
            return None
        return max(float(np.mean(look[f"saturated{joint}"])) for joint in joints)

    return of


def _off(column: str, scale: float) -> Callable[[Look], Value]:
    def of(look: Look) -> Value:
        if not len(look.error):
            return None
        return scale * float(np.mean(look[column] - look[f"{column}_desired"]))

    return of


CONTACT_METRICS = (
    Metric("contact_at", "s", "time of the first contact", lambda look: look.summary["contact_at_s"]),
    Metric(
        "contacts_lost",
        "1",
        "number of losses of contact",
        lambda look: float(losses(look.record)),
        better="least",
    ),
    Metric("time_to_loss", "s", "from the first contact to its first loss; none if it is kept", time_to_loss),
    Metric(
        "time_in_contact",
        "s",
        "from the first contact to its first loss, or to the end",
        _kept,
        better="most",
    ),
    Metric(
        "saturation",
        "1",
        "share of the time that a motor is at its limit, the worst one",
        _saturated(*JOINTS),
        better="least",
    ),
    *(
        Metric(f"saturation{j}", "1", f"share of the time that motor {j} is at its limit", _saturated(j))
        for j in JOINTS
    ),
    Metric("y_error", "m", "mean of the tip's y less the desired one", _off("y", 1.0), signed=True),
    Metric("phi_error", "rad", "mean of the tip's angle less the desired one", _off("phi", 1.0), signed=True),
    Metric(
        "hidden_weights",
        "1",
        "norm of a neural controller's weights into the first hidden layer, at the end",
        lambda look: float(look.record["adapted1"][-1]) if look.touched else None,
    ),
)
"""Metrics of contact, motors and pose."""
