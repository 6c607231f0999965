"""Common parts of the simulated arms that stand in for real ones: an arm of one direction, its messages, its pace."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from palpate._vector import ZERO3
from palpate.arrays import Array
from palpate.force.arm import Arm, ServoLoop, load_arm
from palpate.force.simulated_press import surface, world_of
from palpate.force.touching import BodyState, Surface, World, moved
from palpate.robots import SerialArm
from palpate.wires.realtime import realtime_priority

START = 0.3
"""Height of the surface in the base [m]."""
FRICTION = 0.3
"""Of the surface."""
_TURN = 1e-3
"""Turning of the tool up to which it is none [rad/s]."""
REST = (0.0, 0.0, 0.0)
"""Velocity of an arm at rest [m/s]."""
_DOWN = np.diag([1.0, -1.0, -1.0])
"""Axes of the tool in columns: it points down, turned by half a turn about x."""
_NEAR = 1e-7
"""Of a place, at which joints are left as they are [m], [rad]."""
_BEHIND = 1.0
"""Behind real time by which this process must have been stopped [s]: so much is not made up for in a hurry."""


class _Layers:
    """A surface under a softer layer, each the tangent of the whole where the tip is.

    Args:
        under: the surface.
        stiffness: of the layer [N/m].
        thickness: of the layer [m]: the deflection from which on the surface itself is felt.
    """

    def __init__(self, under: Surface, stiffness: float, thickness: float):
        self._soft, self._force = surface(stiffness, 0.0), stiffness * thickness
        self._hard = under._replace(damping=0.0, place=thickness * (1.0 - stiffness / under.stiffness))

    def surface_at(self, body: Any) -> Surface:
        """The layer, or what is under it, by the force of a step ago."""
        return self._hard if body.force > self._force else self._soft


class ToolAxisArm:
    """An arm that moves along its tool's axis, -z of the base, towards a plane, and along that; a servo follows late.

    Friction is Coulomb's, behind a spring as stiff as the plane.

    Args:
        arm: how it moves and senses.
        touched: the surface.
        gap: between tool and surface at the start [m].
        bias: of the force sensor, in the base [N].
        seed: of the sensor's noise.
        layer: a softer layer on the surface: its stiffness [N/m] and its thickness [m]; None without one.
    """

    def __init__(
        self,
        arm: Arm,
        touched: Surface,
        gap: float,
        bias: tuple[float, float, float],
        seed: int,
        layer: tuple[float, float] | None = None,
    ):
        self.arm, self.surface = arm, touched
        self._layers = None if layer is None else _Layers(touched, *layer)
        self.world: World = world_of(arm, noise=arm.sensor.noise)
        self.bias = bias
        self._rng = np.random.default_rng(seed)
        self.body: Any = BodyState(-gap, 0.0, 0.0, 0.0, ZERO3, 0.0, 0.0, 0.0)
        self.command, self.time = -gap, 0.0
        self.at, self.aside, self.bent = np.array([0.4, 0.0]), np.array([0.4, 0.0]), np.zeros(2)
        self._follows = 1.0
        if isinstance(arm.inner, ServoLoop):
            self._follows = 1.0 - float(np.exp(-arm.tick / arm.inner.lag))
        self._by_torque = self.world.torque > 0.0 and self.world.yields == 0.0
        self._line = [0.0 if self._by_torque else -gap] * max(self.world.delay, 1)

    def velocity_to(self, place: Any) -> Array:
        """Velocity of the command that leads to a place within a tick, shape (3,) [m/s]."""
        here = np.array([*self.aside, START - self.command])
        velocity: Array = (np.asarray(place, dtype=float) - here) / self.world.tick
        return velocity

    def tick(self, velocity: Any = REST) -> None:
        """Go on by one tick of the arm's own clock with this commanded velocity in the base, shape (3,) [m/s]."""
        world = self.world
        speed, aside = -float(velocity[2]), np.asarray(velocity[:2], dtype=float)
        aside = aside * min(1.0, world.speed / max(float(np.hypot(*aside)), 1e-12))
        self.aside += world.tick * aside
        way = self._follows * (self.aside - self.at)
        self.at += way
        bent = self.bent + way
        most = FRICTION * abs(self.body.reading) / self.surface.stiffness
        self.bent = bent * min(1.0, most / max(np.hypot(*bent), 1e-12))
        self.command += world.tick * min(max(speed, -world.speed), world.speed)
        into = self.command
        if self._by_torque:
            into = world.stiffness * (self.command - self.body.x) - world.second * self.body.v
        if self._layers is not None:
            self.surface = self._layers.surface_at(self.body)
        held = self._line[0] if world.delay > 0 else into
        self._line = [*self._line[1:], into]
        noise, h = self._rng.standard_normal(8), world.tick / world.steps
        for j in range(world.steps):
            self.body = moved(world, self.surface, self.body, held, self.time + j * h, h, noise, 0, 0.0)
        self.time += world.tick

    def reading(self) -> tuple[float, ...]:
        """Force, torque, position, quaternion: the tool points down."""
        force = self.bias + np.array([*self.surface.stiffness * self.bent, -self.body.reading])
        return (*force, 0.0, 0.0, 0.0, *self.at, START - self.body.x, 1.0, 0.0, 0.0, 0.0)


class Joints:
    """Joints of a known arm whose tool points down at a place, by inverse kinematics.

    Args:
        name: of the arm.
        place: of its tip in its base [m], shape (3,).
    """

    def __init__(self, name: str, place: Any):
        self.arm = SerialArm.named(name)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = _DOWN, place
        self.q = self.arm.inverse_kinematics(pose, near=self.arm.home)

    def follow(self, place: Any) -> Any:
        """Joint positions for a place near the last one, by a step of Newton's method [rad], shape (n,)."""
        pose = self.arm.forward_kinematics(self.q)
        turn = 0.5 * np.cross(pose[:3, :3].T, _DOWN.T).sum(axis=0)
        error = np.concatenate([place - pose[:3, 3], turn])
        if np.abs(error).max() > _NEAR:
            self.q = self.q + self.rates(error)
        return self.q

    def rates(self, twist: Any) -> Any:
        """Of the joints for a velocity of the tool, shape (6,), and for a small way likewise, shape (n,)."""
        return np.linalg.pinv(self.arm.jacobian(self.q)) @ twist


def turns(twist: Any) -> bool:
    """Whether a velocity of the tool, linear above turning, shape (6,), turns it: no arm here simulates that."""
    return bool(np.abs(np.asarray(twist[3:])).max() > _TURN)


def words_of(module: str, about: str | None) -> argparse.ArgumentParser:
    """The words that each of them takes."""
    words = argparse.ArgumentParser(prog=f"python tests/rehearsal/{module}.py", description=about)
    words.add_argument(
        "--arm", default="ur5e", help="ur5e, fr3, panda, iiwa14 or a TOML file of palpate tune"
    )
    words.add_argument("--stiffness", type=float, default=5000.0, help="of the surface, N/m")
    words.add_argument("--damping", type=float, default=20.0, help="of the surface, N s/m")
    words.add_argument(
        "--layer",
        type=float,
        nargs=2,
        metavar=("N/m", "m"),
        help="stiffness and thickness of a softer layer on it",
    )
    words.add_argument("--gap", type=float, default=0.002, help="between tool and surface, m")
    words.add_argument("--seconds", type=float, default=600.0, help="after which it ends")
    return words


def loopback(words: argparse.ArgumentParser, address: str) -> str:
    """The address, if it is one of the loopback."""
    if not address.startswith("127."):
        words.error(f"--address must be one of the loopback, 127.*, got {address}")
    return address


def arm_of(told: argparse.Namespace, bias: tuple[float, float, float], seed: int = 0) -> ToolAxisArm:
    """The arm that was asked for; the bias is of its sensor [N]."""
    touched = surface(told.stiffness, told.damping)
    return ToolAxisArm(load_arm(told.arm), touched, told.gap, bias, seed, told.layer)


def ready(line: str) -> None:
    """Say where it listens."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def ticks(arm: ToolAxisArm, seconds: float, wait: Callable[[float], None] = time.sleep) -> Iterator[None]:
    """Each tick when it is due, at real time, until the seconds of the arm are over.

    With real-time priority, where the system gives it: a controller is not late because the loop's computer is busy.

    Args:
        arm: whose clock it is.
        seconds: of the arm's time.
        wait: called before each tick with the seconds that are left until it is due.
    """
    with realtime_priority(True):
        begun = time.monotonic()
        while arm.time < seconds:
            left = begun + arm.time - time.monotonic()
            wait(max(left, 0.0))
            if left < -_BEHIND:
                begun -= left
            yield
