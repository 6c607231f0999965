"""One press as least squares could have seen it: with perfect signals, and with each of their faults switched on."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.bench.sequence import CONTACT
from palpate.records import Record
from palpate.signals.filters import Biquad, butterworth2, butterworth3

CAUSES = {
    "offset": "displacement from the 5 N point",
    "lag": "the sensor's lag",
    "filter": "120 Hz on the force",
    "acceleration": "35 Hz on the acceleration",
    "counts": "encoder counts",
    "noise": "noise of the force",
}
"""Signal faults between the surface and the thesis' estimator, in the order of the waterfall."""
BEFORE, PRESS = 1.5, 4.0
TICK = 1e-3
START, COVARIANCE = (0.0, 0.0, 2e5), 1e10


@dataclass(frozen=True)
class Window:
    """A press with what came before it, so that filters have settled; true and measured."""

    x: Array  # true [m]
    counts: Array  # as the encoders have it [m]
    force: Array  # true [N]
    sampled: Array  # [N]
    x0: float  # measured x at the change-over [m]
    wall: float  # [m]
    first: int  # sample of the change-over
    sensor: tuple[float, float]  # cut-off and sampling of the force sensor [Hz]
    cutoffs: tuple[float, float]  # of force and acceleration [Hz]
    matched: Array  # M, B, K of the matched front-end at the end of the window


def window(record: Record) -> Window:
    """The first press of a run."""
    at = int(np.argmax(record["phase"] == CONTACT))
    first = min(at, round(BEFORE / TICK))
    rows = slice(at - first, at + round(PRESS / TICK))
    e = record.meta["experiment"]
    # A row's force is that of the physics step before its tick; at 500 N s/m those 50 us would be 25 g.
    step = 1.0 / (e["run"]["rate"] * e["run"]["steps"])
    return Window(
        x=record["x"][rows],
        counts=record["x_measured"][rows],
        force=late(record["force"][rows], -step),
        sampled=record["force_sampled"][rows],
        x0=float(record["x_measured"][at]),
        wall=float(e["wall"]["x"]),
        first=first,
        sensor=(float(e["force_sensor"]["cutoff"]), float(e["force_sensor"]["sampling"])),
        cutoffs=(float(e["filters"]["force"]), float(e["filters"]["motion"])),
        matched=np.array([record[f"{key}_matched"][rows][-1] for key in "MBK"]),
    )


def estimate(press: Window, causes: Collection[str], lag: float = 0.0) -> Array:
    """(M, B, K) by least squares over the press, with these causes on and the force late by another `lag` [s]."""
    x, v, a = _motion(press, causes)
    force = late(_force(press, causes), lag)
    phi = np.column_stack([a, v, x])[press.first :]
    scale = np.sqrt((phi**2).sum(axis=0))
    unit = phi / scale
    prior = np.diag(1.0 / (COVARIANCE * scale**2))
    right = prior @ (np.array(START) * scale) + unit.T @ force[press.first :]
    return np.asarray(np.linalg.solve(prior + unit.T @ unit, right) / scale)


def _motion(press: Window, causes: Collection[str]) -> tuple[Array, Array, Array]:
    position = press.counts if "counts" in causes else press.x
    if "counts" in causes:
        v = np.diff(position, prepend=position[0]) / TICK
        a = np.diff(v, prepend=0.0) / TICK
    else:
        v = np.gradient(position, TICK)
        a = np.gradient(v, TICK)
    if "acceleration" in causes:
        a = passed(butterworth2(press.cutoffs[1], 1.0 / TICK), a)
    return position - (press.x0 if "offset" in causes else press.wall), v, a


def _force(press: Window, causes: Collection[str]) -> Array:
    sensed = through_sensor(press.force, *press.sensor)
    force = sensed if "lag" in causes else press.force
    if "noise" in causes:
        force = force + (press.sampled - sensed)
    return passed(butterworth2(press.cutoffs[0], 1.0 / TICK), force) if "filter" in causes else force


def through_sensor(force: Array, cutoff: float = 120.0, sampling: float = 480.0) -> Array:
    """The force as the sensor gives it without noise: its filter, one cycle of computing, half a cycle of holding."""
    analog = butterworth3(cutoff, 1.0 / TICK)
    return late(passed(analog.second, passed(analog.first, force)), 1.5 / sampling)


def passed(section: Biquad, signal: Array) -> Array:
    """A signal through a filter that has seen its first value for ever."""
    from scipy.signal import lfilter, lfilter_zi

    b, a = (section.b0, section.b1, section.b2), (1.0, section.a1, section.a2)
    return np.asarray(lfilter(b, a, signal, zi=lfilter_zi(b, a) * signal[0])[0])


def late(signal: Array, seconds: float) -> Array:
    """A signal so many seconds late; linear between samples."""
    k = np.arange(len(signal), dtype=float)
    return signal if seconds == 0.0 else np.interp(k - seconds / TICK, k, signal)


def delayed_fit(M: float, B: float, K: float, lag: float) -> tuple[float, float]:
    """M and B estimated from a force that lags by `lag`, to second order: x(t - T) = x - T v + T^2/2 a."""
    return M - B * lag + K * lag**2 / 2.0, B - K * lag
