"""A tool that was weighed, against what the sensor shows of it in the air."""

from __future__ import annotations

import math

import numpy as np

from palpate.contact_frame import Payload
from palpate.contact_frame.free_motion import wrong_sign, wrong_sign_of
from palpate.wires.at_rest import AtRest
from palpate.wires.turns import turned

_SURE = 3.0
"""Standard deviations of what was weighed, beyond which a difference is none of it."""


def notes_on(tool: Payload, rest: AtRest) -> list[str]:
    """Notes for the user before the arm moves.

    Args:
        tool: from `palpate payload`.
        rest: what the arm shows at rest.
    """
    shown = unlike(tool, rest) or "the sensor shows the tool as it was weighed"
    if tool.inertia_followed is None or not wrong_sign(tool.inertia_followed):
        return [shown]
    return [shown, f"when it was weighed: {wrong_sign_of(tool.inertia_followed)}"]


def unlike(tool: Payload, rest: AtRest) -> str | None:
    """How the sensor's reading at rest differs from what the tool's weighing makes expect; None if it does not.

    The force of a wire is what the tool exerts, that of a payload is as its log had it: either sign is tried.

    Args:
        tool: from `palpate payload`.
        rest: what the arm shows at rest.
    """
    expected = np.array(tool.weight) + np.array(turned(rest.last.quaternion, tool.bias))
    sure = _SURE * math.hypot(tool.weight_std, tool.bias_std, tool.noise)
    apart = min(float(np.abs(rest.bias - sign * expected).max()) for sign in (1.0, -1.0))
    if apart <= sure:
        return None
    return (
        f"the sensor shows {_told(rest.bias)} N in the air, and the tool as it was weighed makes {_told(expected)} N,"
        f" {apart:.2g} N apart in one axis: the sensor was zeroed since or drifts, the tool is another, or wrench and"
        " pose are of other frames. The tare takes it off as long as the tool does not turn"
    )


def _told(force: np.ndarray) -> str:
    return ", ".join(f"{value:.3g}" for value in force)
