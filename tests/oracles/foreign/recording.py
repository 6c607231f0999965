"""What a laboratory's electronics make of a press: late, low-passed, noisy, rounded, held, clipped and stamped."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi, sin

import numpy as np
from numpy.typing import NDArray

from foreign.worlds import World

Array = NDArray[np.float64]

BEGIN = 0.025
"""Instant of the first row [s]: what the force is late by lies before it."""


@dataclass(frozen=True)
class Recording:
    """How a press is written down. The defaults are a clean log.

    Args:
        rate: rows per second.
        force_noise: standard deviation [N]; colour: its correlation time [s].
        position_noise: standard deviation [m].
        force_count, position_count: of the converters [N], [m]; 0 for none.
        lag: delay of the force channel besides its low-pass [s].
        low_pass: order and cut-off [Hz] of a Butterworth before the force is sampled.
        drift: what the force has drifted by at the end, along a bent line [N]; bias: what it reads at rest [N].
        spikes: share of the rows whose force is far off.
        range: force beyond which the sensor is at its end [N].
        payload: mass whose inertia is left in the force [kg]; below 0, compensated twice.
        series: stiffness between the position sensor and the surface [N/m].
        hold_force, hold_position: rows that share one reading.
        jitter: of the instants of the rows, in periods, stamped truly; stamp_noise: of the stamps alone, in periods.
        stamp_count: what stamps are rounded to [s].
        position_rate: rows get the reading of the position that is nearest in time, of so many a second; 0 for each
            its own.
        world: another cause of error.
    """

    rate: float = 1000.0
    force_noise: float = 0.0
    colour: float = 0.0
    position_noise: float = 0.0
    force_count: float = 0.0
    position_count: float = 0.0
    lag: float = 0.0
    low_pass: tuple[int, float] | None = None
    drift: float = 0.0
    bias: float = 0.0
    spikes: float = 0.0
    range: float = inf
    payload: float = 0.0
    series: float = inf
    hold_force: int = 1
    hold_position: int = 1
    jitter: float = 0.0
    stamp_noise: float = 0.0
    stamp_count: float = 0.0
    position_rate: float = 0.0
    world: World = field(default_factory=World, repr=False)

    @property
    def whole_lag(self) -> float:
        """How late a slow force is read [s], the low-pass included."""
        if self.low_pass is None:
            return self.lag
        order, cutoff = self.low_pass
        return self.lag + 1 / (2 * pi * cutoff * sin(pi / (2 * order)))

    def low_passed(self, signal: Array, dt: float) -> Array:
        """A dense signal behind the force's low-pass, at rest before its first sample, shape (n,)."""
        if self.low_pass is None:
            return signal
        from scipy.signal import butter, sosfilt

        sos = butter(self.low_pass[0], self.low_pass[1], fs=1 / dt, output="sos")
        return sosfilt(sos, signal - signal[0]) + signal[0]


def at_times(signal: Array, times: Array, dt: float) -> Array:
    """A dense signal read between its samples by a cubic through the four around, shape of `times`."""
    at = np.clip(times / dt, 0, len(signal) - 1)
    i = np.clip(at.astype(int), 1, len(signal) - 3)
    u = at - i
    a, b, c, d = signal[i - 1], signal[i], signal[i + 1], signal[i + 2]
    return (
        -a * u * (u - 1) * (u - 2) / 6
        + b * (u + 1) * (u - 1) * (u - 2) / 2
        - c * (u + 1) * u * (u - 2) / 2
        + d * (u + 1) * u * (u - 1) / 6
    )


def recorded(
    recording: Recording, x: Array, acceleration: Array, force: Array, dt: float, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """The rows of the log.

    Args:
        recording: how.
        x: depth of the probe [m], dense, shape (n,).
        acceleration: its second rate [m/s^2], shape (n,).
        force: at the surface [N], shape (n,).
        dt: step of the dense signals [s].
        rng: for the noise.

    Returns:
        Stamps [s], position [m] and force [N], shape (m,).
    """
    r = recording
    span = (len(x) - 4) * dt
    rows = int((span - 0.03) * r.rate)
    times = BEGIN + (np.arange(rows) + r.jitter * rng.uniform(-0.5, 0.5, rows)) / r.rate
    position, felt = r.world.seen(x + force / r.series, force, dt)
    felt = r.low_passed(felt + r.payload * acceleration, dt)
    read_at = _held(times, r.hold_force, rng)
    newton = at_times(felt, read_at - r.lag - r.world.late(read_at)[0], dt)
    newton = newton + r.bias + r.drift * _bend(times / span, rng)
    newton = newton + _held_values(_noise(r, rows, rng), read_at)
    hit = rng.uniform(size=rows) < r.spikes
    newton = np.where(hit, newton + rng.normal(size=rows) * 0.5 * np.ptp(newton), newton)
    newton = _rounded(np.clip(newton, -r.range, r.range), r.force_count)
    seen_at = _held(times, r.hold_position, rng)
    if r.position_rate:
        first = float(rng.uniform(0, 1 / r.position_rate))
        seen_at = first + np.round((times - first) * r.position_rate) / r.position_rate
    metre = at_times(position, seen_at - r.world.late(seen_at)[1], dt)
    metre = metre + _held_values(r.position_noise * rng.normal(size=rows), seen_at)
    if r.world.end < 1:
        metre = np.minimum(metre, metre.min() + r.world.end * np.ptp(metre))
    stamps = times - times[0] + r.stamp_noise * rng.uniform(-0.5, 0.5, rows) / r.rate
    return _rounded(stamps, r.stamp_count), _rounded(metre, r.position_count), newton


def _held(times: Array, count: int, rng: np.random.Generator) -> Array:
    """The instants at which what stands in the rows was read."""
    if count == 1:
        return times
    first = int(rng.integers(count))
    return times[np.maximum((np.arange(len(times)) + first) // count * count - first, 0)]


def _held_values(noise: Array, read_at: Array) -> Array:
    _, first, back = np.unique(read_at, return_index=True, return_inverse=True)
    return noise[first][back]


def _noise(r: Recording, rows: int, rng: np.random.Generator) -> Array:
    white = rng.normal(size=rows)
    if r.colour:
        from scipy.signal import lfilter

        keep = np.exp(-1 / (r.rate * r.colour))
        white = lfilter([np.sqrt(1 - keep**2)], [1, -keep], white)
    return r.force_noise * white


def _bend(share: Array, rng: np.random.Generator) -> Array:
    """From 0 to about 1 along a line that bends, as a sensor warms up."""
    bend = rng.uniform(0.3, 3)
    return (1 - np.exp(-bend * share)) / (1 - np.exp(-bend)) + 0.1 * np.sin(
        2 * pi * share + rng.uniform(0, 6)
    )


def _rounded(values: Array, count: float) -> Array:
    return np.round(values / count) * count if count else values
