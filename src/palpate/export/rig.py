"""Pressing a probe on a surface in a simulator: brought to the touch, pressed to and fro, K and B read off again."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any, Protocol

import numpy as np

from palpate.arrays import Array

_TOUCHING = 1e-7
"""Gap that counts as the touch [m]; single-precision places of a few centimetres are as fine."""
_STEPS = 400
_FARTHEST = 0.1
"""Of one joint in one step on the way to the touch [rad or m]."""
_RAMP, _PERIODS = 1, 2
"""Periods of the force: until it is whole, and after that."""
_FINEST = 40
"""Time steps that a period has at least."""
_SHARE = 0.5
"""Amplitude of the force as a share of its mean: resonance at half the natural frequency, 4/3, lifts off nothing."""


_SINGULAR = 1e-6
"""Mobility, as a share of the largest, below which joints cannot move a probe that way."""


class Rig(Protocol):
    """A simulation in which two shapes can touch.

    Its joints are moved by hand to the touch, then it is stepped under a generalised force. Nothing else acts on it:
    no weight, no motors.
    """

    time_step: float

    def gap(self) -> tuple[float, Array]:
        """Distance [m], negative inside, and the velocity by the surface per generalised velocity, shape (3, n).

        The first row is along the normal, outward, the others along the surface.
        """
        ...

    def mass(self) -> Array:
        """Mass matrix, shape (n, n)."""
        ...

    def velocity(self) -> Array:
        """Generalised velocity, shape (n,)."""
        ...

    def move(self, change: Array) -> None:
        """Change the joints by hand, as far as their ranges allow."""
        ...

    def step(self, force: Array) -> tuple[float, float, float]:
        """One time step under a generalised force, shape (n,): penetration [m], its rate [m/s], contact force [N]."""
        ...


@dataclass(frozen=True)
class Pressed:
    """Result of a press in a simulator.

    Args:
        stiffness, damping: of the force over penetration and its rate, by least squares [N/m], [N s/m].
        depth, force: largest [m], [N].
        residual: largest deviation from K x + B v, as a share of the largest force.
        mass: effective mass of the probe at the contact [kg].
        time_step: [s].
        samples: in contact.
    """

    stiffness: float
    damping: float
    depth: float
    force: float
    residual: float
    mass: float
    time_step: float
    samples: int

    def errors(self, stiffness: float, damping: float) -> tuple[float, float]:
        """Of K, and of B, as shares; that of a B of zero is its force at the natural frequency as a share of K's."""
        of_damping = (
            abs(self.damping / damping - 1.0)
            if damping > 0.0
            else abs(self.damping) / sqrt(stiffness * self.mass)
        )
        return abs(self.stiffness / stiffness - 1.0), of_damping

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "K": self.stiffness,
            "B": self.damping,
            "largest_depth_m": self.depth,
            "largest_force_N": self.force,
            "residual": self.residual,
            "mass_kg": self.mass,
            "time_step_s": self.time_step,
            "samples": self.samples,
        }


def touch(rig: Rig) -> float | None:
    """Bring the probe to the surface along the shortest way, by the joint motion of least kinetic energy.

    Returns:
        The mass that the contact feels, 1 / (J M^-1 J^T) [kg]; None if the probe cannot be brought there.
    """
    for _ in range(_STEPS):
        gap, rates = rig.gap()
        way = np.linalg.solve(rig.mass(), rates[0])
        mobility = float(rates[0] @ way)
        if not (np.isfinite(mobility) and mobility > 0.0):
            return None
        if abs(gap) <= _TOUCHING:
            return 1.0 / mobility
        change = -gap / mobility * way
        rig.move(change * min(1.0, _FARTHEST / float(np.abs(change).max())))
    return None


def press(rig: Rig, stiffness: float, force: float, *, inward: bool = False) -> Pressed | None:
    """Press from the touch on with a force that oscillates about `force`, and fit K x + B v to the contact's force.

    The probe is led along the normal, as far as its joints can: where a probe slides, friction is pressed too.

    Args:
        rig: at the touch.
        stiffness: that is expected [N/m].
        force: mean [N].
        inward: fit the loadings alone.

    Returns:
        The result; None if there was no contact, or the simulation did not stay finite.
    """
    path = _path(rig)
    if path is None:
        return None
    _, mass, _ = path
    natural = sqrt(stiffness / mass)
    pulse = min(natural / 2, 2 * pi / (_FINEST * rig.time_step))
    period = 2 * pi / pulse
    rows, held = [], 0.0
    for k in range(int((_RAMP + _PERIODS) * period / rig.time_step)):
        time = k * rig.time_step
        grown = min(time / (_RAMP * period), 1.0)
        asked = force * grown * (1.0 + _SHARE * np.sin(pulse * time))
        path = _path(rig)
        if path is None:
            return None
        row = rig.step(_drive(rig, path, asked, held, natural))
        if not np.all(np.isfinite(row)):
            return None
        held = row[2]
        rows.append(row)
    table = np.array(rows)
    return _fit(table[table[:, 1] > 0.0] if inward else table, mass, rig.time_step)


def _drive(rig: Rig, path: tuple[Array, float, Array], asked: float, held: float, natural: float) -> Array:
    """Generalised force that presses along the path, and lets nothing else move."""
    way, mass, normal = path
    velocity = rig.velocity()
    speed = float(normal @ velocity)
    along = (held - asked) / mass - natural * speed
    aside = (velocity - way * speed) / (2 * rig.time_step)
    return rig.mass() @ (way * along - aside) - held * normal


def _path(rig: Rig) -> tuple[Array, float, Array] | None:
    """Joint motion per metre along the normal; its mass [kg]; the normal's row.

    Of least kinetic energy among the motions that slide least.
    """
    _, rates = rig.gap()
    inertia = rig.mass()
    moved = np.linalg.solve(inertia, rates.T)
    way = moved @ np.linalg.pinv(rates @ moved, rcond=_SINGULAR)[:, 0]
    speed = float(rates[0] @ way)
    if not (np.isfinite(speed) and speed > _SINGULAR):
        return None
    way = way / speed
    return way, float(way @ inertia @ way), rates[0]


def _fit(rows: Array, mass: float, time_step: float) -> Pressed | None:
    held = rows[(rows[:, 2] > 0.0) & (rows[:, 0] > 0.0)]
    if len(held) < _FINEST:
        return None
    (K, B), *_ = np.linalg.lstsq(held[:, :2], held[:, 2], rcond=None)
    off = np.abs(held[:, :2] @ (K, B) - held[:, 2]).max()
    largest = float(held[:, 2].max())
    return Pressed(
        float(K), float(B), float(held[:, 0].max()), largest, float(off) / largest, mass, time_step, len(held)
    )


def across(normal: Array) -> Array:
    """An orthogonal matrix whose first row is the normal, shape (3, 3): Householder's reflection of the first axis."""
    if not normal.any():
        return np.zeros((3, 3))
    way = normal - np.array([1.0, 0.0, 0.0])
    square = float(way @ way)
    return np.eye(3) - (2.0 / square) * np.outer(way, way) if square > 0.0 else np.eye(3)
