"""Why the neural identifier answers as it does: a note for each part of the thesis' claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.identifiers.neural_settings import SETTINGS
from palpate.thesis.neural_identifier.network import Answer, Choice

TIME = (0.3, 0.9)
"""Limits of "about 0.6 s": half of it more or less [s]."""


@dataclass(frozen=True)
class Grounds:
    """Data of a claim's verdict and note.

    Args:
        surface: "foam" or "rubber".
        nominal: every start on the press of every noise seed.
        swept: variations of the network's unstated parameters.
        varied: friction, pose, surface.
        perfect: what K would come out as, over f/x, if the network knew the surface without error.
        starts: how many there are for each noise seed in `nominal`, in order.
    """

    surface: str
    nominal: Sequence[Answer]
    swept: Mapping[Choice, Sequence[Answer]]
    varied: Mapping[str, Sequence[Answer]]
    perfect: float
    starts: int


def why(suffix: str, grounds: Grounds) -> str:
    """Why a part of a claim came out as it did, in numbers of this measurement."""
    notes = {"K": _why_stiffness, "B": _why_damping, "M": _why_mass, "error": _why_error}
    return notes[suffix](grounds) if suffix in notes else _why_time(suffix, grounds)


def _why_time(suffix: str, grounds: Grounds) -> str:
    gone = float(np.median([a.error_gone for a in grounds.nominal]))
    text = (
        "The network's speed of learning is proportional to the square of its output amplitude, which the thesis does "
        f"not state; with the chosen one ({Choice().amplitude:g} N) the error of the output is gone after {gone:.2g} "
        "s."
    )
    if suffix == "time-K":
        return text
    times = [getattr(a, f"settled_{suffix[-1]}") for a in grounds.nominal]
    early, late = sum(t < TIME[0] for t in times), sum(t > TIME[1] for t in times)
    return (
        f"{text} {suffix[-1]}_e is early in {early} and late in {late} of {len(times)} runs. Its settling only means "
        "that learning has stopped: in steady contact no sample contains the force of a moving tip."
    )


def _why_stiffness(grounds: Grounds) -> str:
    x = SETTINGS[grounds.surface].values[0]
    fixed = [float(np.median([a.over for a in s])) for c, s in grounds.swept.items() if not c.thresholds]
    at_zero = float(np.median([a.at_zero for a in grounds.nominal]))
    return (
        "Displacement counts from the 5 N point, so that even a network without error would give "
        f"{grounds.perfect:.2f} times f/x at the probe of {1e3 * x:g} mm. This network increases the error: a "
        "learning threshold absorbs part of the force as a constant. Without penetration the network gives "
        f"{at_zero:.3g} N, and the probe divides that by its displacement. With thresholds fixed at zero the medians "
        f"go from {min(fixed):.2f} to {max(fixed):.2f}: the least for a large amplitude and small weights, where the "
        f"network is linear through zero and gives f/x at any probe. {_by_surface(grounds)}The surface's stiffness "
        "was chosen for the thesis' f/x."
    )


def _by_surface(grounds: Grounds) -> str:
    """K on other laws of the surface."""
    laws = [name for name in ("stiffening", "relaxing") if name in grounds.varied]
    parts = [f"{np.median([a.over for a in grounds.varied[name]]):.2f} on a {name} one" for name in laws]
    return f"The median is {' and '.join(parts)}. " if parts else ""


def _why_damping(grounds: Grounds) -> str:
    values = [a.B for a in grounds.nominal]
    return (
        f"B_e goes from {min(values):.3g} to {max(values):.3g} N s/m. {_by_start(values, grounds)} The tip moves for "
        "a tenth of a second or less, and any of 21 weights and thresholds can remove its error there: one push does "
        "not determine the shares of displacement, velocity and thresholds in the force."
    )


def _why_mass(grounds: Grounds) -> str:
    values = np.array([a.M for a in grounds.nominal])
    by_start = values.reshape(-1, grounds.starts)
    firm = int(np.sum(np.all(by_start > 0, axis=0) | np.all(by_start < 0, axis=0)))
    return (
        f"M_e is positive in {int(np.sum(values > 0))} of {values.size} runs; for {firm} of {grounds.starts} starts "
        f"its sign is the same with every noise seed. {_by_start(values, grounds)} It is no property of the surface, "
        "and a positive value means no more than a negative one."
    )


def _by_start(values: Sequence[float] | Array, grounds: Grounds) -> str:
    part = share_of_starts(values, grounds.starts)
    return f"Initial weights make {'over 99%' if part > 0.99 else f'{part:.0%}'} of its variance, noise the rest."


def share_of_starts(values: Sequence[float] | Array, starts: int) -> float:
    """Which part of the variance lies between starts; the rest lies between noise seeds of one start."""
    by_start = np.reshape(np.asarray(values, dtype=float), (-1, starts))
    total = float(np.var(by_start))
    return float(np.var(by_start.mean(axis=0))) / total if total > 0.0 else 0.0


def _why_error(grounds: Grounds) -> str:
    times = {c.amplitude: some for c, some in grounds.swept.items() if c == Choice(c.amplitude)}
    told_ = ", ".join(f"{np.median([x.error_gone for x in s]):.2g} s at {a:g} N" for a, s in times.items())
    return (
        "The error does become almost zero. The time follows from the output amplitude and the initial weights, which "
        f"the thesis does not state: {told_} (weights and thresholds as chosen). The loop gain of learning is "
        "proportional to the square of the amplitude, and an amplitude close to the force uses only the flat end of "
        "the sigmoid."
    )
