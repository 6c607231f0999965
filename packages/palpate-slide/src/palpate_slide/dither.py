"""Stiffness along a path from a slide whose desired force is dithered: places of a line of a map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import MADE
from palpate.force.arm import Arm
from palpate.force.gains import Gains
from palpate.force.guard import FINE
from palpate.force.sliding.slide_state import AWAY, JERKS
from palpate.force.sliding.sliding_loop import Z_95
from palpate_slide.world import COLUMNS

SHARES = 0.01, 0.3
"""Least and largest share of F_d by which it may be dithered."""
PERIODS = 4
"""Of the dither in a window: one place."""
SLOWER = 12.0
"""Periods are so many theta long: the force follows most of a dither that slow."""
TREND = 3
"""Degree of the polynomial for all that is slower."""
BESIDE = 3, 5, 6
"""Whole numbers of periods in a window at which there is no dither: their spectrum is that of the noise."""
T_95 = 2.447
"""Student's factor of as many degrees of freedom, two for each of them."""


def dither_frequency(gains: Gains) -> float:
    """Frequency of the dither [Hz]."""
    return 1.0 / (SLOWER * gains.theta)


def check_share(share: float) -> None:
    """Refuses a share of F_d that is no dither.

    Raises:
        InputError: out of range.
    """
    if share != 0.0 and not SHARES[0] <= share <= SHARES[1]:
        raise InputError(
            f"--dither must be a share of the force from {SHARES[0]:g} to {SHARES[1]:g}, got {share:g}"
        )


@dataclass(frozen=True)
class PathStiffness:
    """Stiffness of the surface along a path.

    Args:
        places: middles of the windows, shape (n, 3) [m].
        stiffness: the surface's own, shape (n,) [N/m].
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
        """As `palpate map --table` reads it."""
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
    slides = np.flatnonzero(c["sliding"] == 1.0)
    size = round(PERIODS * arm.rate / frequency)
    starts = np.arange(slides[0] + size // PERIODS, slides[-1] - size + 2, size) if len(slides) > size else ()
    omega = 2.0 * np.pi * frequency
    sensor = complex(arm.low_pass.at(np.array([omega]))[0]) * np.exp(-0.5j * omega / arm.sensor.sampling)
    goes_on = np.isin(c["trouble"], (FINE, AWAY, JERKS))
    parts = [slice(start, start + size) for start in starts if goes_on[start : start + size].all()]
    found = [_window(c, part, sensor) for part in parts]
    own = [[*place, *_own(arm, K, half)] for place, K, half in found if half < 0.5 * K < np.inf]
    table = np.array(own).reshape(-1, 5)
    return PathStiffness(table[:, :3], table[:, 3], table[:, 4])


def _window(c: dict[str, Array], part: slice, sensor: complex) -> tuple[Array, float, float]:
    """Place of a window, stiffness as felt, and half-width of its 95 % interval."""
    p, n, f = (np.stack([c[f"{of}{axis}"][part] for axis in "xyz"], 1) for of in ("", "n", "f"))
    size = len(p)
    trend = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), TREND)
    # A normal that follows the dither would add friction to it.
    n = trend @ np.linalg.lstsq(trend, n, rcond=None)[0]
    n /= np.linalg.norm(n, axis=1)[:, None]
    depth = np.append(0.0, np.cumsum(np.einsum("ij,ij->i", np.diff(p, axis=0), n[1:])))
    force = np.einsum("ij,ij->i", f, n)
    angle = 2.0 * np.pi / size * np.arange(size)
    waves = [np.column_stack([np.cos(k * angle), np.sin(k * angle)]) for k in (PERIODS, *BESIDE)]
    fitted = np.linalg.lstsq(np.hstack([trend, *waves]), np.column_stack([force, depth]), rcond=None)[0]
    spectrum = fitted[trend.shape[1] :].reshape(-1, 2, 2)  # wave, cosine and sine, force and depth
    Y, Z = (spectrum[:, 0, i] - 1j * spectrum[:, 1, i] for i in (0, 1))
    Y = Y / sensor
    K = float((Y[0] / Z[0]).real)
    noise = float(np.sqrt(np.mean(np.abs(Y[1:] - K * Z[1:]) ** 2) / 2.0))
    tilt = float(np.mean(c["mu"][part] * c["cone"][part]))  # of the gain, by a normal that is off
    return p[size // 2], K, float(np.hypot(T_95 * noise / abs(Z[0]), Z_95 * tilt * K))


def _own(arm: Arm, K: float, half: float) -> tuple[float, float]:
    """The surface's own stiffness and half-width: a position arm's encoders see it through its compliance."""
    if arm.kind != "position":
        return K, half
    return arm.surface(K), half / (1.0 - K / arm.series) ** 2
