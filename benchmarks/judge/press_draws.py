"""Arms, sensors, surfaces and errors of the sensor in free motion, as the judge of force laws draws them.

All numbers are the judge's own: it reads no file of palpate. Each constant names its source. Arms are within their
intervals, surfaces within the cap, and readings within ACCURACY of the force once the tip touches, noise and the
inertia of a tool beyond the sensor aside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

FULL_SPEED = 0.25  # m/s, ISO 10218-1: reduced speed, the limit of hand-guided and collaborative cells
ACCURACY = 4.0  # N, force sensor in the data sheet of the UR5e; here the largest error after the touch
BIAS = 1.0  # N, part of it that taring leaves: the data sheet of the FR3 prints 0.8 N
JITTER = 2e-4  # s, wake-up of a control thread on a host with ordinary scheduling, one tick in five
MISSED = 0.002  # probability that a tick is lost, and half as often two: a wire with other traffic
LAYERS = ((0.0, 500.0), (0.02, 1e5))  # m, N/m: tissue of 20 mm over bone, the case that was reported
SOFTEST = 300.0  # N/m, soft foam and tissue
POWERS = (1.5, 2.0)  # a sphere (Hertz) and a cone (Sneddon) pressed into an elastic half-space
SEGMENTS = 12  # of a power law; the tangent changes by about a third from one to the next
HARDENED = 10.0  # multiple of the desired force from which a power law goes on straight
TAU = (1e-4, 2e-3)  # s, damping over stiffness: steel on rubber to foam; a loss of 0.4 to 8 % at 6 Hz


@dataclass(frozen=True)
class Arm:
    """Arm along one direction, as identified; `draw` has one within the intervals."""

    kind: str  # position, torque or servo
    rate: float  # of the force loop [Hz]
    mass: float  # of the tip along the normal, without a tool [kg], within 10 %
    stiffness: float  # between command and tip [N/m]
    damping: float  # between command and tip of a position arm, against the ground of others [N s/m]
    delay: float  # from command to motion [s], between half of it and all of it
    bandwidth: float = 0.0  # of the motors of a position arm [rad/s]
    ratio: float = 1.0  # their damping ratio
    spread: float = 0.03  # relative half-width of all but mass and delay; 0 where software sets them
    tool: float = 0.0  # mass beyond the sensor, a part of `mass` once it is drawn [kg]

    def draw(self, rng: np.random.Generator) -> Arm:
        """Arm within the intervals, with a tool."""
        names = ("stiffness", "damping", "bandwidth", "ratio")
        near = {name: getattr(self, name) * (1 + self.spread * rng.uniform(-1, 1)) for name in names}
        tool = rng.uniform(0, MAX_TOOL)
        mass = self.mass * rng.uniform(0.9, 1.1) + tool
        return replace(self, mass=mass, delay=self.delay * rng.uniform(0.5, 1), tool=tool, **near)

    @property
    def theta(self) -> float:
        """Largest residual travel per unit of speed after the reading that ends it, in the whole interval [s].

        Lag of the tip behind a ramp, delay, group delay of the low-pass, one sample, one tick and its jitter. A servo
        is commanded by the inverse of its slow pole, so its fast pole remains.
        """
        if self.kind == "position":
            ramp = 2 * self.ratio / self.bandwidth * (1 + self.spread) / (1 - self.spread)
        else:
            ramp = self.damping / self.stiffness if self.kind == "torque" else self.mass / self.damping
        return ramp + self.delay + 2 / (2 * np.pi * LOW_PASS) + 1 / SAMPLING + 1 / self.rate + JITTER

    def pushed(self, cap: float) -> float:
        """Force per unit of speed by the travel within `theta`, K_eff theta on a surface of the cap [N s/m]."""
        return self.theta * cap * self.stiffness / (cap + self.stiffness)

    def swung(self, cap: float) -> float:
        """Force per unit of speed by the largest momentum of tip and tool, sqrt(K m) [N s/m]."""
        return float(np.sqrt(cap * (1.1 * self.mass + MAX_TOOL)))


MAX_TOOL = 0.5  # kg, a probe or a small gripper
SAMPLING, LOW_PASS = 480.0, 120.0  # Hz, assumed: low-pass at a quarter of the rate, on a clock of its own
NOISE, RESOLUTION = 0.1, 0.02  # N, assumed: standard deviation and step of a reading of a six-axis sensor
FULL_SCALE = 100.0  # N, assumed: between the 50 N of a UR5e and the 145 N of small six-axis sensors

# Masses: along the vertical at `home` from links, joints and rotors of 0.1 kg m^2 in the public descriptions
# (Universal_Robots_ROS2_Description, franka_description, drake's iiwa14). Position arm: no maker prints the inner
# loop; servoj's shortest look-ahead is 0.03 s (URScript manual), the lag 2 z/w of these motors. 5e4 N/m: measured
# stiffnesses of arms of this size are 2e4 to 1e5. Torque arms: 1 kHz (libfranka, FRI); stiffness and damping are
# set in software, for 0.6 of critical damping. Servo: joint gains 2000 and 500 N m/rad, a fifth of it as damping
# (MuJoCo menagerie, UR5e), reflected to the tip at `home`.
ARMS = {
    "ur5e": Arm("position", 500.0, 3.67, 5e4, 43.0, 0.010, bandwidth=2 * np.pi * 10, ratio=0.9),
    "fr3": Arm("torque", 1000.0, 3.87, 15000.0, 300.0, 0.001, spread=0.0),
    "iiwa14": Arm("torque", 1000.0, 6.56, 15000.0, 380.0, 0.001, spread=0.0),
    "servo": Arm("servo", 500.0, 3.67, 4950.0, 990.0, 0.008),
}


def arm_file(arm: Arm, title: str) -> str:
    """Arm file of `palpate tune` for the middle of the intervals: what its user would have identified."""
    position = arm.kind == "position"
    motors = f"bandwidth = {arm.bandwidth / (2 * np.pi)}" if position else ""
    return f"""title = "{title}"
rate = {arm.rate}
[inner]
kind = "{arm.kind}"
mass = {arm.mass + MAX_TOOL / 2}
stiffness = {arm.stiffness}
damping = {arm.ratio if position else arm.damping}
delay = {arm.delay}
{motors}
[sensor]
sampling = {SAMPLING}
noise = {NOISE}
low_pass = "butterworth3:{LOW_PASS:g}"
full_scale = {FULL_SCALE}
[limits]
speed = {FULL_SPEED}
stiffness = 1000000.0
"""


class Errors(NamedTuple):
    """Errors of the reading [N] by time and place, without noise."""

    bias: float = 0.0  # N
    cable: float = 0.0  # force per metre of a cable or hose on the tool [N/m]
    begin: float = 0.0  # place where it begins to pull [m]
    slips: float = 0.0  # place from which its force stays [m]
    ends: float = 1e3  # place where it lets go [m]
    ripple: float = 0.0  # amplitude of the force that changes with the pose [N]
    wave: float = 1.0  # its length [m]
    phase: float = 0.0  # its phase at the start [rad]
    drift: float = 0.0  # change in time [N/s]
    settles: float = 0.0  # time after which it stays [s]


class Draw(NamedTuple):
    """One press: arm, distance to the surface [m], its stiffness by depth, damping, sensor and errors.

    `layers` are pairs of depth [m] and incremental stiffness from there on [N/m]; damping is `tau` times the stiffness.
    """

    arm: Arm
    distance: float
    layers: tuple[tuple[float, float], ...]
    tau: float
    noise: float
    low_pass: float
    sampling: float
    errors: Errors
    seed: int

    def least_time(self, force: float, force_max: float, per_speed: float) -> float:
        """Shortest time to `force` of laws whose speed is at most (F_max - F)/`per_speed` [s].

        On stiffness K: (`per_speed`/K) ln(F_max/(F_max - F_d)); layer by layer.
        """
        time, reached = 0.0, 0.0
        for (depth, stiffness), (deeper, _) in zip(self.layers, [*self.layers[1:], (np.inf, 0)], strict=True):
            after = min(force, reached + stiffness * (deeper - depth))
            time += per_speed / stiffness * np.log((force_max - reached) / (force_max - after))
            reached = after
        return time


def power_law(power: float, tangent: float, force: float, cap: float) -> tuple[tuple[float, float], ...]:
    """Force c p^n in segments, with a given tangent at a force; straight from where that is at the cap."""
    depth = power * force / tangent  # at the force
    end = depth * min(cap / tangent, HARDENED ** (1 - 1 / power)) ** (1 / (power - 1))
    depths = np.concatenate([[0], np.geomspace(depth / 8, end, SEGMENTS)])
    forces = force * (depths / depth) ** power
    stiffness = [*(np.diff(forces) / np.diff(depths)).tolist(), power * forces[-1] / end]
    return tuple(zip(depths.tolist(), stiffness, strict=True))


def draw_surface(
    rng: np.random.Generator, case: str, force: float, cap: float
) -> tuple[tuple[float, float], ...]:
    """Surface of at most the stiffness `cap`: layers and power laws, or a single spring."""
    log = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))  # noqa: E731
    if case != "layers":
        return ((0.0, log(SOFTEST, cap)),)
    kind = rng.integers(4)
    if kind == 0:
        return tuple((depth, min(stiffness, cap)) for depth, stiffness in LAYERS)
    if kind == 1:
        return power_law(POWERS[rng.integers(len(POWERS))], log(SOFTEST, cap / 3), force, cap)
    soft = log(SOFTEST, 5000)  # N/m, tissue and foam
    # The base is met at up to 1.5 times the desired force: below it on the way, above it by an overshoot.
    return ((0.0, soft), (force / soft * rng.uniform(0.05, 1.5), log(max(1e4, soft), cap)))


def draw_errors(rng: np.random.Generator, case: str, distance: float) -> Errors:
    """Errors of the reading in free motion; none is above ACCURACY where the tip touches."""
    sign = 1 if rng.random() < 0.75 else -1  # more cables hold the tool back than push it
    bias, most = rng.uniform(-BIAS, BIAS), ACCURACY - BIAS
    if case == "cable":
        cable, begin = np.exp(rng.uniform(np.log(30), np.log(300))), rng.uniform(0, 0.5) * distance
        if rng.random() < 0.5:  # it drags along with a force that stays
            return Errors(bias, sign * cable, begin, begin + rng.uniform(1, most) / cable)
        ends = rng.uniform(begin, distance)  # it catches, with up to 15 N, and lets go before the surface
        return Errors(bias, sign * cable, begin, begin + 15 / cable, ends)
    if case == "pose":  # 1.5 N over 60 mm: external force of a torque arm by its model, as users report
        return Errors(bias, ripple=1.5, wave=rng.uniform(0.05, 0.07), phase=rng.uniform(0, 2 * np.pi))
    if case == "drift":  # a sensor that warms up
        rate = rng.uniform(0.5, 1.0) * rng.choice((-1, 1))
        return Errors(bias, drift=rate, settles=most / abs(rate))
    return Errors(bias if case == "layers" else 0.0)


def draw_press(arm: Arm, case: str, force: float, cap: float, seed: int) -> Draw:
    """Press number `seed` of a case, the same for every law and simulator."""
    rng = np.random.default_rng([seed, *case.encode()])
    near = case in {"clean", "layers"}
    distance = float(np.exp(rng.uniform(*np.log((0.003, 0.01) if near else (0.01, 0.06)))))
    layers = draw_surface(rng, case, force, cap)
    tau = float(np.exp(rng.uniform(*np.log(TAU))))
    # K + B/theta is within the cap, as `palpate tune --stiffness-cap` counts it.
    layers = tuple((depth, min(stiffness, cap / (1 + tau / arm.theta))) for depth, stiffness in layers)
    return Draw(
        arm=arm.draw(rng),
        distance=distance,
        layers=layers,
        tau=tau,
        noise=NOISE if case == "clean" else NOISE * rng.uniform(0.5, 1.5),
        low_pass=LOW_PASS * rng.uniform(0.97, 1.03),
        sampling=SAMPLING * rng.uniform(0.999, 1.001),
        errors=draw_errors(rng, case, distance),
        seed=seed,
    )
