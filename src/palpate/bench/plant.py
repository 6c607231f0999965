"""The plant between two ticks: the arm, one elastic mode of it, its friction and the surface.

The mode is the deflection of the tip along x, between the pose of the joints and the actual one.
"""

import math
from typing import NamedTuple

from palpate._jit import part
from palpate._vector import Vec3, solve
from palpate.environments.stick_slip import StickSlip, StickSlipState
from palpate.environments.surface import Surface
from palpate.environments.surface_state import SurfaceState, contact_force, follow, opposing
from palpate.friction import LuGre
from palpate.robots.arm3 import Arm3


@part
class ElasticState(NamedTuple):
    bend: float  # of the tip beyond where the joints put it [m]
    rate: float  # [m/s]


@part
class ElasticMode(NamedTuple):
    """A modal mass on a spring and a damper that the contact force drives: d'' + 2 zeta w d' + w^2 d = -mobility f.

    The joints' encoders do not see it. In modal coordinates the rigid arm feels the contact force as before; that
    torques excite the mode too is left out.

    Args:
        mobility: one over the modal mass [1/kg]; 0 makes a rigid arm.
        frequency: w, undamped [rad/s].
        damping: zeta.
    """

    mobility: float
    frequency: float
    damping: float

    def start(self):
        return ElasticState(0.0, 0.0)

    def acceleration(self, state):
        """Acceleration by spring and damper [m/s^2]."""
        return -self.frequency * (2.0 * self.damping * state.rate + self.frequency * state.bend)

    def step(self, state, acceleration, dt):
        """The state after dt [s]; semi-implicit Euler, as the arm's."""
        rate = state.rate + dt * acceleration
        return ElasticState(state.bend + dt * rate, rate)

    def after_impulse(self, state, impulse):
        """The state after an impulse [N s] of the surface."""
        return ElasticState(state.bend, state.rate - self.mobility * impulse)


RIGID = ElasticMode(0.0, 0.0, 0.0)


def elastic_mode(stiffness: float, frequency: float, damping: float) -> ElasticMode:
    """The mode that gives way by 1/stiffness [m/N] at rest and swings at a frequency [Hz] with a damping ratio."""
    w = 2.0 * math.pi * frequency
    return ElasticMode(w * w / stiffness, w, float(damping))


@part
class PlantState(NamedTuple):
    q: Vec3  # joint angles [rad]
    qd: Vec3  # joint rates [rad/s]
    bristles: Vec3  # of the joints' friction [rad]
    surface: SurfaceState
    side: StickSlipState  # friction along the surface
    bent: ElasticState  # of the arm along x


@part
class SurfaceTouch(NamedTuple):
    """Force of the tip on the surface during a step."""

    normal: float  # into the surface [N], never negative
    tangential: float  # along y [N]
    penetration: float  # of the tip [m], negative in free motion
    friction: Vec3  # torque lost in the joints [N m]
    inertial: float = 0.0  # force that what lies beyond the force sensor takes to be moved [N]
    rate: float = 0.0  # of the tip along x [m/s]


@part
class Plant(NamedTuple):
    """A planar arm before a wall at x = `wall` that it can press in the direction of +x.

    Args:
        arm: with its rotors (`Arm3.with_rotors`).
        friction: of the joints.
        surface: along its normal.
        side: friction along it.
        wall: x of the undeformed surface [m].
        mode: in which the arm gives way along x, between its joints and its tip.
        beyond: mass between force sensor and tip, part of the arm's own [kg].
    """

    arm: Arm3
    friction: LuGre
    surface: Surface
    side: StickSlip
    wall: float
    mode: ElasticMode = RIGID
    beyond: float = 0.0

    def start_at(self, q):
        """At rest in free motion, at the joint angles q."""
        return PlantState(
            q,
            0.0 * q,
            self.friction.start(),
            self.surface.start(),
            self.side.start(),
            self.mode.start(),
        )

    def advance(self, state, torque, dt):
        """The state after dt [s] under constant torque [N m], and what was felt; semi-implicit Euler, first order.

        The surface's mass moves with the tip while they touch, so the contact force is solved together with the
        acceleration: it is the one that leaves both with the same acceleration. Rates are those half a step before
        the angles; the force is that of p and of the rate and acceleration that p has at that moment, so that
        f = K p + B p' + M p'' holds in central differences of p (what is left, a part in a million at 50 us, is
        the centripetal acceleration, taken at the rates of half a step before).
        """
        model = self.arm.model(state.q, state.qd)
        normal, along = model.J.r1, model.J.r2
        bent = state.bent
        p = self.arm.pose(state.q).x + bent.bend - self.wall
        friction, bristles = self.friction.step(state.bristles, state.qd, dt)
        drive = torque - model.h - friction
        per_normal = solve(model.M, normal)
        tip_mass = 1.0 / (normal @ per_normal + self.mode.mobility)
        springs_back = self.mode.acceleration(bent)
        surface, side, force, slide = state.surface, state.side, 0.0, 0.0
        if surface.contact == 1.0:
            # The normal force before friction along the surface: its share in f is second order.
            elastic, opposed = opposing(
                self.surface, surface, p, normal @ state.qd + bent.rate - 0.5 * dt * model.Jdqd.x, dt
            )
            a = normal @ solve(model.M, drive) + model.Jdqd.x + springs_back
            force = contact_force(elastic, opposed, tip_mass, a)
            slide, side = self.side.slide(side, along @ state.qd, force, dt)
            drive += along * slide
            a = normal @ solve(model.M, drive) + model.Jdqd.x + springs_back
            force = contact_force(elastic, opposed, tip_mass, a)
        qdd = solve(model.M, drive) - per_normal * max(force, 0.0)
        qd = state.qd + dt * qdd
        q = state.q + dt * qd
        bent = self.mode.step(bent, springs_back - self.mode.mobility * max(force, 0.0), dt)
        p = self.arm.pose(q).x + bent.bend - self.wall
        v = normal @ qd + bent.rate
        if force < 0.0:
            side = self.side.start()
        surface, impulse = follow(self.surface, surface, force, p, v, tip_mass, dt)
        qd -= per_normal * impulse
        bent = self.mode.after_impulse(bent, impulse)
        after = normal @ qd + bent.rate
        inertial = self.beyond * ((after - normal @ state.qd - state.bent.rate) / dt + model.Jdqd.x)
        felt = SurfaceTouch(max(force, 0.0) + impulse / dt, -slide, p, friction, inertial, after)
        return PlantState(q, qd, bristles, surface, side, bent), felt
