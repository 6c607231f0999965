"""A log through the on-line identifier, tick by tick, answered as the batch answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from foreign.logs import Log
from palpate.identifiers import ContactIdentifier


@dataclass(frozen=True)
class Streamed:
    """The end of a stream in the words of a batch answer."""

    model: str
    parameters: dict[str, Any]
    contacts: tuple[tuple[float, float], ...] = ()
    lag: None = None


@dataclass(frozen=True)
class Number:
    """One parameter of the stream's end."""

    value: float
    std: float
    ci95: tuple[float, float]
    unit: str
    verdict: str


def streamed(log: Log, missing: float, seed: int = 0) -> Streamed:
    """What the identifier says after the last tick.

    Args:
        log: with a low-pass in its recording.
        missing: share of the ticks whose readings are lost.
        seed: of which they are.
    """
    r = log.plan.recording
    order, cutoff = r.low_pass
    identifier = ContactIdentifier(f"butterworth{order}:{cutoff:g}", r.rate, r.whole_lag)
    lost = np.random.default_rng(seed).uniform(size=len(log.force)) < missing
    skip = getattr(identifier, "skip", None)
    for position, force, gone in zip(log.position.tolist(), log.force.tolist(), lost.tolist(), strict=True):
        if not gone:
            identifier.update(position, force)
        elif skip is not None:
            skip()
    estimate = identifier.estimate()
    units = {"K": "N/m", "B": "N s/m", "M": "kg"}
    verdicts = estimate.verdicts()
    found = {}
    for name, value, std in zip(estimate.names, estimate.theta.tolist(), estimate.std.tolist(), strict=True):
        if name in units:
            ci95 = value - 1.96 * std, value + 1.96 * std
            found[name] = Number(value, std, ci95, units[name], str(verdicts[name]))
    return Streamed("kelvin-voigt-mass", found)
