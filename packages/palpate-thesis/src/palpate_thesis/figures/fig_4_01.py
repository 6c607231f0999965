"""Figure 4.1: the end-effector kept perpendicular to the surface, by its angle alone and by all six axes."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.report import style
from palpate.robots import SerialArm
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.force_control.panels import dots_panel, panels
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "4.1"


def _facets(rings: int = 4) -> Array:
    """Of a face of radius 1: in each ring at the root of its mean squared radius, shape (n, 3)."""
    count = 6 * np.arange(1, rings + 1) - 3
    squared = np.cumsum([0, *count]) / count.sum()
    radius = np.sqrt(np.repeat((squared[1:] + squared[:-1]) / 2.0, count))
    angle = np.concatenate([2 * np.pi * np.arange(n) / n for n in count])
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * radius])


FACETS = _facets()


class Pad(NamedTuple):
    """Elastic bed under a flat, round end-effector: springs and dampers side by side (Winkler).

    Args:
        stiffness, damping: of the whole face [N/m], [N s/m].
        radius: of the face [m].
        friction: Coulomb's, along the surface.
    """

    stiffness: float
    damping: float
    radius: float = 0.015
    friction: float = 0.3

    @property
    def places(self) -> Array:
        """Facets of equal area on the face, ring by ring, with its second moment of area, shape (n, 3) [m]."""
        return self.radius * FACETS

    def wrench(self, normal: Array, depth: Array, rate: Array, slide: Array) -> Array:
        """Force [N] above moment about the face's centre [N m] on the surface, in the tool's axes, shape (6,).

        Args:
            normal: into the surface, in the tool's axes, shape (3,).
            depth: of the facets in the surface [m], shape (n,).
            rate: of the depth [m/s], shape (n,).
            slide: velocity of the face's centre along the surface [m/s], shape (3,).
        """
        pressed = np.maximum(self.stiffness * depth + self.damping * rate, 0.0) * (depth > 0.0) / len(depth)
        rubbed = self.friction * slide / (np.linalg.norm(slide) + 1e-4)
        forces = pressed[:, None] * (normal + rubbed)
        return np.concatenate([forces.sum(axis=0), np.cross(self.places, forces).sum(axis=0)])


FOAM, RUBBER = Pad(5200.0, 200.0), Pad(34500.0, 480.0)
FORCE = 20.0
"""Desired force along the tool's axis [N]."""
RATE, STEPS = 480, 2
"""The sensor's own cycle [Hz], which is the controller's here, and steps of the surface between."""
SECONDS = 4.0
TILT = np.radians(5.0)
"""The surface is off the tool's axis by as much at most, about each of two axes [rad]."""
NOISE = (0.6, 0.02)
"""Standard deviation of a reading [N], [N m]."""
FULL = np.array([200.0] * 3 + [10.0] * 3)
BITS, CROSSTALK, LEVER = 12, 0.01, 0.02
"""Of the sensor: bits over twice the full scale; what the calibration matrix leaves of each axis in the others, as a
share; and the length that makes forces of moments [m]."""
BEHIND = 0.06
"""The sensor's origin behind the face [m]."""
SERVO = 0.010
"""Time constant of the arm's joints under commanded rates [s]."""
GAINS = (1e-3, 4.0)
"""Of the force [m/s per N] and of the moment [rad/s per N m]."""
WITHIN = 1.0
"""Largest angle between tool and normal that is called perpendicular [degrees]."""
GONE = 20.0
"""Angle from which on the tool has turned away [degrees]."""
PARAMETERS = {"foam": FOAM, "rubber": RUBBER}
SCHEMES = ("one axis", "moments alone", "six axes")
"""Of the sensor: the force along the tool, as in the thesis; with the moments as they are read; with these moved to the
face by the forces along it."""


def command(reading: Array, scheme: str) -> Array:
    """Velocity of the face [m/s] above its turning [rad/s] in the tool's axes, for a wrench read at the sensor."""
    force, moment = reading[:3], reading[3:]
    velocity = np.array([0.0, 0.0, GAINS[0] * (FORCE - force[2])])
    if scheme == "one axis":
        return np.concatenate([velocity, np.zeros(3)])
    if scheme == "six axes":
        moment = moment - np.cross([0.0, 0.0, BEHIND], force)
    return np.concatenate([velocity, -GAINS[1] * moment * [1.0, 1.0, 0.0]])


class TiltedPress(NamedTuple):
    """A press of the surface."""

    angle: Array  # between tool and normal, tick by tick [degrees]
    force: float  # error along the tool in the last second, absolute mean [N]

    @property
    def rms_angle(self) -> float:
        """Angle in the last second, root mean square [degrees]."""
        return float(np.sqrt(np.mean(self.angle[-RATE:] ** 2)))

    @property
    def perpendicular(self) -> bool:
        """Whether that is small."""
        return self.rms_angle <= WITHIN


def press(pad: Pad, scheme: str, seed: int, seconds: float = SECONDS) -> TiltedPress:
    """A six-joint arm presses a surface that is off its tool's axis; the seed is of tilt, noise and crosstalk."""
    rng = np.random.default_rng(seed)
    arm = SerialArm.named("ur5e")
    q, rates = np.array(arm.home), np.zeros(6)
    start = arm.forward_kinematics(q)
    tilt = rng.uniform(-TILT, TILT, 2)
    normal = start[:3, :3] @ np.array([np.tan(tilt[0]), np.tan(tilt[1]), 1.0])
    normal /= np.linalg.norm(normal)
    surface = start[:3, 3] + (pad.radius * np.tan(np.sqrt(2.0) * TILT) + 1e-4) * normal
    units = np.array([1.0] * 3 + [LEVER] * 3)
    leak = (rng.uniform(-CROSSTALK, CROSSTALK, (6, 6)) + np.eye(6)) * units[:, None] / units
    places = pad.places
    step, reading, before, angles, forces = 1.0 / (RATE * STEPS), np.zeros(6), None, [], []
    pose = start
    for _ in range(round(seconds * RATE)):
        turned = np.kron(np.eye(2), pose[:3, :3])
        wanted = np.linalg.solve(arm.jacobian(q), turned @ command(reading, scheme))
        for _ in range(STEPS):
            rates += step / SERVO * (wanted - rates)
            q = q + step * rates
            pose = arm.forward_kinematics(q)
            depth = (pose[:3, 3] + places @ pose[:3, :3].T - surface) @ normal
            rate = np.zeros(len(depth)) if before is None else (depth - before[0]) / step
            slide = np.zeros(3) if before is None else (pose[:3, 3] - before[1]) / step
            before = depth, pose[:3, 3]
        axes = pose[:3, :3]
        wrench = pad.wrench(axes.T @ normal, depth, rate, axes.T @ (slide - (slide @ normal) * normal))
        forces.append(wrench[2])
        wrench[3:] += np.cross([0.0, 0.0, BEHIND], wrench[:3])
        noisy = leak @ wrench + rng.normal(0.0, 1.0, 6) * np.repeat(NOISE, 3)
        bit = FULL / 2 ** (BITS - 1)
        reading = bit * np.round(np.clip(noisy, -FULL, FULL) / bit)
        angles.append(np.degrees(np.arccos(min(1.0, float(axes[:, 2] @ normal)))))
    return TiltedPress(np.array(angles), abs(float(np.mean(forces[-RATE:])) - FORCE))


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    found: dict[str, dict[str, list[TiltedPress]]]  # by surface and scheme


def run(runs: Runs) -> Data:
    """Each surface under each scheme, over all seeds."""
    cases = {key: [(*key, seed) for seed in runs.seeds] for key in product(PARAMETERS, SCHEMES)}
    done = runs.map_each(lambda case: press(PARAMETERS[case[0]], *case[1:]), cases)
    return Data({name: {scheme: done[name, scheme] for scheme in SCHEMES} for name in PARAMETERS})


def check(data: Data) -> Sequence[ThesisClaim]:
    """The angle held as in the thesis, and the sensor's other axes."""
    rows = {"perpendicular.angle": "one axis", "perpendicular.six-axes": "six axes"}
    return [_claim(data, name, scheme) for name, scheme in rows.items()]


def _claim(data: Data, name: str, scheme: str) -> ThesisClaim:
    return claim(
        name,
        all(often(one.perpendicular for one in found[scheme]) for found in data.found.values()),
        **{surface: found[scheme] for surface, found in data.found.items()},
        away=sum(one.rms_angle > GONE for one in data.found["foam"]["moments alone"]),
        within=WITHIN,
        tilt=np.degrees(TILT),
        crosstalk=CROSSTALK,
        bit=FULL[0] / 2 ** (BITS - 1),
        behind=1e3 * BEHIND,
        turned=FORCE * BEHIND,
        stiff=FOAM.stiffness * FOAM.radius**2 / 4.0,
    )


def plot(data: Data) -> Figure:
    """The angle over time on foam, and in the last second of all presses."""
    drawing, ((angle,), (dots,)) = panels([2.6, 2.2])
    time = np.arange(round(SECONDS * RATE)) / RATE
    for scheme in SCHEMES:
        angle.plot(time, data.found["foam"][scheme][0].angle, linewidth=1.1, label=scheme)
    angle.set(
        xlabel="time [s]", ylabel="angle off the normal [degrees]", xlim=(0.0, SECONDS), ylim=(0.0, 8.0)
    )
    style.legend(angle)
    shown = {f"{name}\n{s}": presses for name, found in data.found.items() for s, presses in found.items()}
    dots_panel(dots, shown, lambda one: min(one.rms_angle, GONE), lambda one: one.perpendicular, WITHIN)
    dots.set(
        ylabel="angle [degrees]",
        title="in the last second, a mark each press; dashed: the limit; at 20 it has turned away",
    )
    return drawing
