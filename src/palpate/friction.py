"""Friction of joints: the plant's own (`LuGre`) and the model a controller compensates with (`Coulomb`).

Velocities and torques are numbers, `Vec3` (one component a joint) or NumPy arrays; parameters are `Vec3` or
numbers to match.
"""

from typing import NamedTuple

from palpate._jit import part
from palpate._vector import Vec3, clip, exp, sign
from palpate.errors import InputError


@part
class LuGre(NamedTuple):
    """Dry friction with presliding, stiction and the Stribeck effect (Canudas de Wit et al., TAC 40, 1995).

    The surfaces touch through bristles whose mean deflection is z [rad]:

        g(v) = coulomb + (static - coulomb) exp(-(v / stribeck)^2)
        z'   = v - sigma0 |v| z / g(v)
        torque = sigma0 z + s1(v) z' + sigma2 v,    s1(v) = sigma1 / (1 + sigma1 |v| / (4 g(v)))

    Two things differ from the paper. The bristle takes an implicit step, stable however stiff the bristle,
    fast the motion or long the step, with |sigma0 z| never above `static`. And the damping fades with speed:
    the model is passive only while sigma1 |v| <= 4 g(v), which a constant sigma1 breaks at high speed; s1
    never does. Every step then gives back at most what the bristle has stored, at any dt.

    The thesis gives no friction. The defaults are chosen for its three joints: Coulomb levels that leave the
    hybrid controller the force error that it reports, stiction 1.2 times that, 0.2 mrad of presliding to the
    Coulomb level, half of critical damping of the bristle against the joint's inertia with the others free
    (0.90, 0.095, 0.0026 kg m^2 where the listing starts), and no viscous part (its section 4.3 neglects it).
    Without friction: all three sigmas zero.

    Args:
        sigma0: stiffness of the bristles [N m/rad].
        sigma1: their damping at rest [N m s/rad].
        sigma2: viscous friction [N m s/rad].
        coulomb: torque of steady sliding, without the viscous part [N m].
        static: torque at which it breaks away from rest [N m].
        stribeck: speed at which the one has largely become the other [rad/s].
        asymmetry: by which share both levels are higher forward and lower backward; one for all joints.
    """

    sigma0: Vec3 = Vec3(15000.0, 1250.0, 150.0)
    sigma1: Vec3 = Vec3(120.0, 11.0, 0.65)
    sigma2: Vec3 = Vec3(0.0, 0.0, 0.0)
    coulomb: Vec3 = Vec3(3.0, 0.25, 0.03)
    static: Vec3 = Vec3(3.6, 0.3, 0.036)
    stribeck: Vec3 = Vec3(0.01, 0.01, 0.01)
    asymmetry: float = 0.0

    def start(self):
        """The bristles at rest [rad]."""
        return 0.0 * self.coulomb

    def step(self, z, v, dt):
        """One step of dt [s] at v [rad/s]: the torque against the motion [N m], and the new z."""
        slip = abs(v) / self.level(v)
        new = (z + dt * v) / (1.0 + dt * self.sigma0 * slip)
        damping = self.sigma1 / (1.0 + 0.25 * self.sigma1 * slip)
        return self.sigma0 * new + (1.0 / dt) * damping * (new - z) + self.sigma2 * v, new

    def level(self, v):
        """g(v), the dry friction of steady sliding [N m]."""
        r = v / self.stribeck
        dry = self.coulomb + (self.static - self.coulomb) * exp(-(r * r))
        return dry * (1.0 + self.asymmetry * sign(v))

    def steady(self, v):
        """Torque of steady sliding at v [N m]."""
        return self.level(v) * sign(v) + self.sigma2 * v

    def stored_energy(self, z):
        """Energy in the bristles [J], joint by joint."""
        return 0.5 * self.sigma0 * z * z

    def validate(self):
        """Itself; an InputError where a value is out of its range."""
        for name in ("coulomb", "static", "stribeck"):
            _require(name, getattr(self, name), "positive", lambda v: v > 0.0)
        for name in ("sigma0", "sigma1", "sigma2"):
            _require(name, getattr(self, name), "zero or positive", lambda v: v >= 0.0)
        _require("static - coulomb", self.static - self.coulomb, "zero or positive", lambda v: v >= 0.0)
        _require("asymmetry", self.asymmetry, "between -1 and 1", lambda v: -1.0 < v < 1.0)
        return self


@part
class Coulomb(NamedTuple):
    """Dry friction as a controller models it: its level, with a straight line through zero (4.8).

    It has no memory, so it is safe to add to a command; but it knows neither stiction nor presliding, and
    inside the blend it compensates too little.

    Args:
        level: torque of sliding [N m].
        blend: speed from which the level is reached [rad/s]; the thesis' listing has 0.002, less than one
            velocity quantum of its encoders.
    """

    level: Vec3 = Vec3(3.0, 0.25, 0.03)
    blend: Vec3 = Vec3(0.002, 0.002, 0.002)

    def torque(self, v):
        """Torque that friction takes at the velocity v [N m], for a controller to add."""
        return self.level * clip(v / self.blend, 1.0)


def _require(name, value, what, holds):
    if not all(holds(v) for v in (value if isinstance(value, tuple) else (value,))):
        raise InputError(f"{name} of the friction must be {what}, got {value}")
