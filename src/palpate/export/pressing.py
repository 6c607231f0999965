"""Pressing a probe on a surface in a simulator: brought to the touch, pressed to and fro, K and B fitted."""

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any, NamedTuple, Protocol

import numpy as np

from palpate.arrays import Array

TOUCH_GAP = 1e-7
"""Gap that counts as the touch [m]; single-precision places of a few centimetres are as fine."""
MIN_DIRECTED_GAP = 1e-6
"""Gap from which on its direction is used [m]."""
MAX_MOVES = 400
"""Steps on the way to the touch."""
MAX_MOVE = 0.1
"""Largest motion of one joint in one step on the way to the touch [rad or m]."""
RAMP_PERIODS, FULL_PERIODS = 1, 2
"""Periods of the force while it grows, and after that."""
MIN_STEPS = 40
"""Time steps of a period at least, and samples in contact for a fit."""
AMPLITUDE = 0.5
"""Amplitude of the force as a fraction of its mean: at half the natural frequency resonance makes it 2/3, so that
the probe stays in contact."""
MIN_MOBILITY = 1e-6
"""Fraction of the largest mobility below which joints cannot move a probe in a direction."""


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
class RigPress:
    """Result of a press in a simulator.

    Args:
        stiffness, damping: of the force over penetration and its rate, by least squares [N/m], [N s/m].
        depth, force: largest [m], [N].
        residual: largest deviation from K x + B v, as a fraction of the largest force.
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
        """Relative errors of K and of B; that of a B of zero is its force at the natural frequency over that of K."""
        if damping > 0.0:
            damping_error = abs(self.damping / damping - 1.0)
        else:
            damping_error = abs(self.damping) / sqrt(stiffness * self.mass)
        return abs(self.stiffness / stiffness - 1.0), damping_error

    def to_json(self) -> dict[str, Any]:
        """The press as plain values."""
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
    for _ in range(MAX_MOVES):
        gap, rates = rig.gap()
        motion = np.linalg.solve(rig.mass(), rates[0])
        mobility = float(rates[0] @ motion)
        if not (np.isfinite(mobility) and mobility > 0.0):
            return None
        if abs(gap) <= TOUCH_GAP:
            return 1.0 / mobility
        change = -gap / mobility * motion
        rig.move(change * min(1.0, MAX_MOVE / float(np.abs(change).max())))
    return None


def press(rig: Rig, stiffness: float, force: float) -> RigPress | None:
    """Press from the touch on with a force that oscillates about `force`, and fit K x + B v to the contact's force.

    The probe is led along the normal, as far as its joints can: where a probe slides, friction is pressed too.

    Args:
        rig: at the touch.
        stiffness: expected [N/m].
        force: mean [N].

    Returns:
        The result; None if there was no contact, or the simulation did not stay finite.
    """
    path = _path(rig)
    if path is None:
        return None
    mass = path.mass
    natural = sqrt(stiffness / mass)
    pulse = min(natural / 2, 2 * pi / (MIN_STEPS * rig.time_step))
    period = 2 * pi / pulse
    rows, contact_force = [], 0.0
    for k in range(int((RAMP_PERIODS + FULL_PERIODS) * period / rig.time_step)):
        time = k * rig.time_step
        ramp = min(time / (RAMP_PERIODS * period), 1.0)
        desired = force * ramp * (1.0 + AMPLITUDE * np.sin(pulse * time))
        path = _path(rig)
        if path is None:
            return None
        row = rig.step(_drive(rig, path, desired, contact_force, natural))
        if not np.all(np.isfinite(row)):
            return None
        contact_force = row[2]
        rows.append(row)
    return _fit(np.array(rows), mass, rig.time_step)


class PressPath(NamedTuple):
    """Motion of the probe along the normal.

    Args:
        motion: of the joints per metre, shape (n,).
        mass: that moves with it [kg].
        normal: velocity along the normal per generalised velocity, shape (n,).
    """

    motion: Array
    mass: float
    normal: Array


def _path(rig: Rig) -> PressPath | None:
    """The joint motion of least kinetic energy among those that slide least; None if there is none."""
    _, rates = rig.gap()
    inertia = rig.mass()
    mobility = np.linalg.solve(inertia, rates.T)
    motion = mobility @ np.linalg.pinv(rates @ mobility, rcond=MIN_MOBILITY)[:, 0]
    speed = float(rates[0] @ motion)
    if not (np.isfinite(speed) and speed > MIN_MOBILITY):
        return None
    motion = motion / speed
    return PressPath(motion, float(motion @ inertia @ motion), rates[0])


def _drive(rig: Rig, path: PressPath, desired: float, contact_force: float, natural: float) -> Array:
    """Generalised force that presses along the path, and lets nothing else move."""
    velocity = rig.velocity()
    speed = float(path.normal @ velocity)
    along = (contact_force - desired) / path.mass - natural * speed
    deviation = (velocity - path.motion * speed) / (2 * rig.time_step)
    return rig.mass() @ (path.motion * along - deviation) - contact_force * path.normal


def _fit(rows: Array, mass: float, time_step: float) -> RigPress | None:
    contact = rows[(rows[:, 2] > 0.0) & (rows[:, 0] > 0.0)]
    if len(contact) < MIN_STEPS:
        return None
    (K, B), *_ = np.linalg.lstsq(contact[:, :2], contact[:, 2], rcond=None)
    residual = np.abs(contact[:, :2] @ (K, B) - contact[:, 2]).max()
    largest = float(contact[:, 2].max())
    return RigPress(
        stiffness=float(K),
        damping=float(B),
        depth=float(contact[:, 0].max()),
        force=largest,
        residual=float(residual) / largest,
        mass=mass,
        time_step=time_step,
        samples=len(contact),
    )


def normal_axes(normal: Array) -> Array:
    """An orthogonal matrix whose first row is the normal, shape (3, 3): Householder's reflection of the first axis."""
    if not normal.any():
        return np.zeros((3, 3))
    difference = normal - np.array([1.0, 0.0, 0.0])
    square = float(difference @ difference)
    if square == 0.0:
        return np.eye(3)
    return np.eye(3) - (2.0 / square) * np.outer(difference, difference)
