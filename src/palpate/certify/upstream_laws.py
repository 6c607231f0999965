"""Force controllers of other projects, as their source runs them: one axis of a tick, in exact fractions.

Written from the source at the commits of `SOURCES`; nothing is copied. A signal is a row of coefficients: one for each
state before the tick, and a last one for the reading of the force.
"""

from __future__ import annotations

from fractions import Fraction
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from palpate.certify.discrete_loop import AffineLoop, split_delay
from palpate.certify.torque_loop import TorqueSpringLoop

FZI_STEP = Fraction(1, 50)
"""Simulated time of a solver's step [s], whatever the rate of the controller."""
FZI_KEPT = Fraction(9, 10)
"""Fraction of the solver's velocity that is kept from step to step."""


class LawSource(NamedTuple):
    """Place of a law: repository, commit, and file."""

    repository: str
    commit: str
    file: str


SOURCES = {
    "ros2-admittance": LawSource(
        "ros-controls/ros2_controllers",
        "94e74de35f9d04f313aca8f29df66c3a76004aa7",
        "admittance_controller/include/admittance_controller/admittance_rule_impl.hpp",
    ),
    "fzi": LawSource(
        "fzi-forschungszentrum-informatik/cartesian_controllers",
        "f53f798029ea5e05993e8a5d1736c713379af0e2",
        "cartesian_controller_base/src/ForwardDynamicsSolver.cpp",
    ),
    "crisp": LawSource(
        "utiasDSL/crisp_controllers",
        "809354897a2997530f10aa2516801180aee43dee",
        "src/cartesian_controller.cpp",
    ),
    "franka": LawSource(
        "frankaemika/franka_ros",
        "c11f000c2737acc22ed8dfeff40555b2644a4294",
        "franka_example_controllers/src/cartesian_impedance_example_controller.cpp",
    ),
}


class Timing(NamedTuple):
    """When commands act.

    Args:
        rate: ticks a second.
        delay: from the command to the motion that it causes, with all that is late in the reading [s].
        interface: position or velocity, of the command.
        sensor: the arm is where the last command was, and the force alone is late; for a position interface.
    """

    rate: float
    delay: float
    interface: str = "position"
    sensor: bool = False

    def later(self) -> Timing:
        """The same with a delay longer by one tick."""
        return self._replace(delay=self.delay + 1.0 / self.rate)


class Admittance(NamedTuple):
    """One axis of the admittance rule of ros2_controllers.

    Args:
        mass: M [kg].
        stiffness: S [N/m].
        damping_ratio: of M and S, D = 2 ratio sqrt(M S).
        joint_damping: deceleration by the joint's velocity [1/s].
        filter_coefficient: weight of the newest reading.
    """

    mass: float
    stiffness: float
    damping_ratio: float
    joint_damping: float
    filter_coefficient: float

    @property
    def damping(self) -> float:
        """D [N s/m], as the rule computes it."""
        return self.damping_ratio * 2 * sqrt(self.mass * self.stiffness)

    def decay(self, rate: float) -> float:
        """h (D/M + joint_damping): the explicit step runs away in free motion from about 2."""
        return (self.damping / self.mass + self.joint_damping) / rate

    def loop(self, timing: Timing) -> AffineLoop:
        """One tick: smooth the reading, accelerate, integrate the velocity, then the position."""
        M, S, D, d, alpha = map(
            Fraction, (self.mass, self.stiffness, self.damping, self.joint_damping, self.filter_coefficient)
        )
        h = 1 / Fraction(timing.rate)
        (filtered, velocity), arm, force = law_signals(2, timing)
        filtered_next = (1 - alpha) * filtered + alpha * force
        acceleration = (filtered_next - D * velocity - S * arm.position) / M - d * velocity
        velocity_next = velocity + h * acceleration
        command = velocity_next if timing.interface == "velocity" else arm.commands[0] + h * velocity_next
        return arm.loop([filtered_next, velocity_next], command, timing)


class ForwardDynamics(NamedTuple):
    """One axis of FZI's force or compliance controller with its forward-dynamics solver.

    Args:
        p: proportional gain, times the error scale.
        d: derivative gain, times the error scale; the derivative is per simulated second.
        stiffness: of the compliance controller [N/m]; 0 for the force controller.
        iterations: steps of the solver in a tick; the force controller takes one whatever the file says.
    """

    p: float
    d: float
    stiffness: float = 0.0
    iterations: int = 1

    def loop(self, timing: Timing) -> AffineLoop:
        """One tick: the solver starts at the measured position with the velocity of the last tick.

        The first step compares with the pose at which the last tick ended; its virtual mass is 1 kg.
        """
        p, d, S = map(Fraction, (self.p, self.d, self.stiffness))
        (velocity, last_error, pose), arm, force = law_signals(3, timing)
        position = arm.position
        for _ in range(self.iterations):
            error = force - S * pose
            acceleration = p * error + d * (error - last_error) / FZI_STEP
            position = position + FZI_STEP * velocity
            velocity = FZI_KEPT * (velocity + FZI_STEP * acceleration)
            pose, last_error = position, error
        command = velocity if timing.interface == "velocity" else position
        return arm.loop([velocity, last_error, pose], command, timing)


class CartesianImpedance(NamedTuple):
    """One axis of a Cartesian impedance, f = -k x - d v, of CRISP or Franka's example.

    Args:
        stiffness: k [N/m].
        damping: d [N s/m].
        mass: of the arm at its tip [kg].
        operational: k and d are multiplied by that mass, as an arm's model gives it.
    """

    stiffness: float
    damping: float
    mass: float
    operational: bool = False

    def loop(self, timing: Timing) -> TorqueSpringLoop:
        """One tick: the force of the newest commands that have arrived, held."""
        scale = self.mass if self.operational else 1.0
        whole, part = split_delay(timing.delay, timing.rate)
        feedback = (scale * self.stiffness, scale * self.damping)
        return TorqueSpringLoop(feedback, self.mass, 1.0 / timing.rate, whole, float(part))


class ArmSignals(NamedTuple):
    """Signals of a position or velocity arm: the measured position, and commands of earlier ticks, newest first."""

    position: Any
    commands: list[Any]

    def loop(self, law_next: list[Any], command: Any, timing: Timing) -> AffineLoop:
        """Close the loop of a law's next states and its command.

        A position arm is where the command of the tick before the last whole ticks was; a velocity arm moves by the
        commands that have arrived, each for its fraction of the tick.
        """
        whole, part = split_delay(timing.delay, timing.rate)
        history = [command, *self.commands]
        if timing.interface == "velocity":
            travel = (1 - part) * history[whole] + part * history[whole + 1]
            moved = self.position + travel / Fraction(timing.rate)
            rows = [*law_next, *history[:-1], moved]
        else:
            rows = [*law_next, *history[:-1]]
        return AffineLoop(np.array(rows), len(rows) - 1)


def law_signals(law_states: int, timing: Timing) -> tuple[list[Any], ArmSignals, Any]:
    """States of the law, the arm's signals, and the reading of the force, as rows of coefficients."""
    whole, _ = split_delay(timing.delay, timing.rate)
    integrator = timing.interface == "velocity"
    n = law_states + whole + 1 + integrator
    rows = [np.array([Fraction(int(i == j)) for j in range(n + 1)]) for i in range(n + 1)]
    commands = rows[law_states : law_states + whole + 1]
    position = commands[0] if timing.sensor else rows[n - 1]
    return rows[:law_states], ArmSignals(position, commands), rows[n]
