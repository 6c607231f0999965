"""Stiffness along a path from a slide whose desired force is dithered: places of a line of a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import MADE
from palpate.force.arm import Arm
from palpate.force.gains import Gains
from palpate.force.guard import FINE
from palpate.force.sliding.slide_state import AWAY, JERKS
from palpate.force.sliding.sliding_loop import Z_95
from palpate.slide.world import COLUMNS

DITHER_RANGE = 0.01, 0.3
"""Smallest and largest amplitude of the dither, as a fraction of F_d."""
PERIODS = 4
"""Periods of the dither in a window, which gives one place."""
PERIOD_IN_LAGS = 12.0
"""Period of the dither in lags theta of the loop: the force then follows most of the dither."""
TREND_DEGREE = 3
"""Degree of the polynomial for everything slower than the dither."""
NOISE_PERIODS = 3, 5, 6
"""Periods in a window at which there is no dither: the spectrum there is that of the noise."""
T_95 = 2.447
"""Student's factor for six degrees of freedom, two for each of `NOISE_PERIODS`."""


def dither_frequency(gains: Gains) -> float:
    """Frequency of the dither [Hz]."""
    return 1.0 / (PERIOD_IN_LAGS * gains.theta)


def check_dither(fraction: float) -> None:
    """Refuse an amplitude of the dither out of range.

    Raises:
        InputError: it is out of range.
    """
    if fraction != 0.0 and not DITHER_RANGE[0] <= fraction <= DITHER_RANGE[1]:
        raise InputError(
            f"--dither must be a share of the force from {DITHER_RANGE[0]:g} to {DITHER_RANGE[1]:g}, got {fraction:g}"
        )


@dataclass(frozen=True)
class PathStiffness:
    """Stiffness of the surface along a path.

    Args:
        places: middles of the windows, shape (n, 3) [m].
        stiffness: of the surface without the arm, shape (n,) [N/m].
        half: half-width of its 95 % interval, shape (n,) [N/m].
    """

    places: Array
    stiffness: Array
    half: Array

    def to_json(self) -> list[dict[str, float]]:
        """Plain values, a place each."""
        rows = np.column_stack([self.places, self.stiffness, self.half]).tolist()
        return [dict(zip(("x", "y", "z", "stiffness", "half"), row, strict=True)) for row in rows]

    def to_csv(self) -> str:
        """A table for `palpate map --table`."""
        rows = [",".join(f"{value:.6g}" for value in row.values()) for row in self.to_json()]
        return "\n".join([f"{MADE} slide.", "x_m,y_m,z_m,stiffness,half", *rows, ""])


def stiffness_along(rows: Array, arm: Arm, frequency: float) -> PathStiffness:
    """Stiffness in windows along a dithered slide, from force, position and estimated normal alone.

    In each window the force along the normal and the motion along it are a polynomial, the dither, and noise. The
    surface's own heights are in the polynomial, or else in the noise, whose spectrum beside the dither is the
    uncertainty.

    Args:
        rows: as of `world.simulate`, shape (n, 21).
        arm: whose sensor's low-pass and age are taken out, and whose compliance.
        frequency: of the dither [Hz].
    """
    c = dict(zip(COLUMNS, rows.T, strict=True))
    size = round(PERIODS * arm.rate / frequency)
    omega = 2.0 * np.pi * frequency
    sensor = complex(arm.low_pass.at(np.array([omega]))[0]) * np.exp(-0.5j * omega / arm.sensor.sampling)
    places = []
    for window in _windows(c, size):
        place, K, half = _stiffness_felt(c, window, sensor)
        if half < 0.5 * K < np.inf:
            places.append([*place, *_without_arm(arm, K, half)])
    table = np.array(places).reshape(-1, 5)
    return PathStiffness(table[:, :3], table[:, 3], table[:, 4])


def _windows(c: dict[str, Array], size: int) -> list[slice]:
    """Windows of `size` ticks in which the tip slides without trouble."""
    slides = np.flatnonzero(c["sliding"] == 1.0)
    if len(slides) <= size:
        return []
    fine = np.isin(c["trouble"], (FINE, AWAY, JERKS))
    starts = range(slides[0] + size // PERIODS, slides[-1] - size + 2, size)
    return [slice(start, start + size) for start in starts if fine[start : start + size].all()]


def _stiffness_felt(c: dict[str, Array], window: slice, sensor: complex) -> tuple[Array, float, float]:
    """Place of a window, stiffness as felt, and half-width of its 95 % interval."""
    position, normal, force = (
        np.stack([c[f"{prefix}{axis}"][window] for axis in "xyz"], 1) for prefix in ("", "n", "f")
    )
    size = len(position)
    trend = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), TREND_DEGREE)
    # A normal that follows the dither would add friction to it.
    normal = trend @ np.linalg.lstsq(trend, normal, rcond=None)[0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    steps = np.einsum("ij,ij->i", np.diff(position, axis=0), normal[1:])
    depth: Array = np.append(0.0, np.cumsum(steps))
    normal_force = np.einsum("ij,ij->i", force, normal)
    Y, Z = _spectra(trend, normal_force, depth)
    Y = Y / sensor
    K = float((Y[0] / Z[0]).real)
    noise = float(np.sqrt(np.mean(np.abs(Y[1:] - K * Z[1:]) ** 2) / 2.0))
    tilt = float(np.mean(c["mu"][window] * c["cone"][window]))  # relative error by a wrong normal
    half = float(np.hypot(T_95 * noise / abs(Z[0]), Z_95 * tilt * K))
    return position[size // 2], K, half


def _spectra(trend: Any, force: Any, depth: Any) -> tuple[Any, Any]:
    """Complex amplitudes of force and depth beside a trend: at the dither, then at `NOISE_PERIODS`."""
    size = len(force)
    angle = 2.0 * np.pi / size * np.arange(size)
    waves = [np.column_stack([np.cos(k * angle), np.sin(k * angle)]) for k in (PERIODS, *NOISE_PERIODS)]
    signals = np.column_stack([force, depth])
    fitted = np.linalg.lstsq(np.hstack([trend, *waves]), signals, rcond=None)[0]
    spectrum = fitted[trend.shape[1] :].reshape(-1, 2, 2)  # wave, cosine and sine, force and depth
    amplitudes = spectrum[:, 0] - 1j * spectrum[:, 1]
    return amplitudes[:, 0], amplitudes[:, 1]


def _without_arm(arm: Arm, K: float, half: float) -> tuple[float, float]:
    """Stiffness of the surface and half-width, without the compliance of a position arm."""
    if arm.kind != "position":
        return K, half
    return arm.surface(K), half / (1.0 - K / arm.series) ** 2
