"""How a press over a wire went, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.wires.at_rest import AtRest
from palpate.wires.lateness import Lateness
from palpate.wires.order import Order

_BAND = 0.05
"""Of the force, within which a press counts as settled."""


@dataclass(frozen=True)
class Outcome:
    """How a press went.

    Args:
        ended: why, in words.
        ok: it pressed for as long as was asked.
        touched: the surface was met.
        force: mean over the last third of the hold [N]; None if it was not reached.
        settled: seconds from the touch until the force was within 5 % for good; None if it was not.
        stiffness: what the loop found of the surface, as the position feels it, and its std [N/m]; None if nothing.
        lateness: of the loop.
        rest: what was seen before.
        troubles: ticks of each trouble of the law, by its sentence.
    """

    ended: str
    ok: bool
    touched: bool
    force: float | None
    settled: float | None
    stiffness: tuple[float, float] | None
    lateness: Lateness
    rest: AtRest
    troubles: Mapping[str, int]

    def to_json(self) -> dict[str, Any]:
        """As plain JSON values."""
        return {
            "ended": self.ended,
            "ok": self.ok,
            "touched": self.touched,
            "force_N": self.force,
            "settled_s": self.settled,
            "stiffness_N_per_m": None if self.stiffness is None else list(self.stiffness),
            "lateness": self.lateness.to_json(),
            "bias_N": self.rest.bias.tolist(),
            "noise_N": self.rest.noise,
            "drift_N_per_s": self.rest.drift,
            "troubles": dict(self.troubles),
            "rate_Hz": self.rest.rate,
        }


def force_reached(times: Array, forces: Array) -> float | None:
    """Mean over the last third of the time since the touch [N], shapes (n,); None of nothing."""
    late = forces[times > 2.0 / 3.0 * times[-1]] if len(times) else forces
    return float(late.mean()) if len(late) else None


def settling_time(times: Array, forces: Array, order: Order) -> float | None:
    """From when on the force stays within 5 % of what is asked [s], shapes (n,); None if it does not.

    Of a mean over the loop's whole lag: noise of single readings is not the force. A force that is lowered now and then
    is judged up to the first time.
    """
    if not len(times):
        return None
    if order.task.probe:
        before = times < times[-1] / 3.0
        times, forces = times[before], forces[before]
    gains = order.loop.gains
    width = max(round(gains.theta / gains.arm.tick), 1)
    smooth = np.convolve(forces, np.full(width, 1.0 / width), "valid") if len(forces) > width else forces
    outside = np.flatnonzero(np.abs(smooth / order.task.force - 1.0) > _BAND)
    if not len(outside):
        return 0.0
    return float(times[outside[-1] + 1]) if outside[-1] < len(smooth) - 1 else None
