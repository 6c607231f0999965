"""Controllers of the thesis on a simulated arm of torques: they approach by resolved acceleration, and then press."""

from typing import Any

import numpy as np

from palpate._vector import ZERO3, Vec3, Vec6
from palpate.bench.summary import APPROACH, CONTACT, LOST
from palpate.controllers import Hybrid, Impedance, ProportionalIntegral, ResolvedAcceleration
from palpate.controllers.proportional_integral import integral_gain
from palpate.errors import unknown
from palpate.press.sequence import Action, TipSample
from palpate.press.setting import Place
from palpate.press.simulated_arm import SimulatedArm
from palpate.signals.types import Task, alike, triple

CONTROLLERS = ("hybrid", "proportional-integral", "impedance")
_POSITION, _RATE = 400.0, 40.0
"""K_pp [1/s^2] and K_pv [1/s] of the directions that hold their place: 3 Hz, critically damped."""
_BANDWIDTH = 0.25
"""Of the proportional-integral controller [Hz]: a fifth of B/m, what a surface of 50 N s/m and a tip of 6 kg bear."""
_GIVING = 2000.0
"""Stiffness of the impedance [N/m]."""


class ByTorque:
    """A controller of `palpate.controllers` in six directions on the simulated arm: it approaches, and then presses.

    Args:
        arm: of torques.
        place: where it starts.
        controller: by name.
        speed: of the approach [m/s].
        switch: reading above which the controller takes over, eight deviations of the noise [N].
        force: that the impedance's target is placed for [N].
    """

    def __init__(
        self, arm: SimulatedArm, place: Place, controller: str, speed: float, switch: float, force: float
    ):
        self._arm, self._normal, self._speed, self._switch = arm, place.normal, speed, switch
        at = place.axes @ place.pose[:3, 3]
        self._at, self._gone, self._phase = triple(at), 0.0, APPROACH
        self._approach = ResolvedAcceleration(_six(_POSITION), _six(_RATE))
        self._controller = self._make(controller, place.place, force)

    def _make(self, name: str, surface: float, force: float) -> Any:
        tick = self._arm.loop.tick
        held, rate, none = _six(_POSITION), _six(_RATE), _six(0.0)
        if name == "hybrid":
            return Hybrid(held, rate, _six(1.0), _six(0.003))
        if name == "proportional-integral":
            return ProportionalIntegral(held, rate, none, _six(integral_gain(_BANDWIDTH)), tick)
        if name == "impedance":
            inner: Any = self._arm.loop.inner  # of torques, so that it has a mass
            damping = 1.4 * float(np.sqrt(_GIVING * inner.mass))
            target: Any = Vec6(Vec3(surface + force / _GIVING, self._at.y, self._at.z), ZERO3)
            return Impedance(_six(inner.mass), _six(damping), _six(_GIVING), target)
        raise unknown("controller", name, CONTROLLERS)

    def step(self, sample: TipSample, desired: float, since: float) -> Action:
        """One tick, as `PressDriver` describes it."""
        force = float(sample.force @ self._normal)
        if self._phase == CONTACT and force <= 0.0:
            self._phase = LOST
            self._at = self._at._replace(x=float(self._normal @ sample.position))
            self._gone = 0.0
        elif force > self._switch:
            self._phase = CONTACT
        nothing = _six(0.0)
        if self._phase == CONTACT:
            at: Any = Vec6(self._at, ZERO3)
            s: Any = Vec6(Vec3(1.0, 0.0, 0.0), ZERO3)
            self._arm.act(self._controller, Task(at, nothing, nothing, desired * s, s))
            return Action(CONTACT, 0.0, 0.0 * self._normal, 0.0)
        self._gone += self._arm.loop.tick * self._speed
        x: Any = Vec6(self._at + Vec3(self._gone, 0.0, 0.0), ZERO3)
        xd: Any = Vec6(Vec3(self._speed, 0.0, 0.0), ZERO3)
        self._arm.act(self._approach, Task(x, xd, nothing, nothing, nothing))
        return Action(self._phase, self._speed, self._speed * self._normal, 0.0)


def _six(value: float) -> Any:
    """The same number in six directions; the types of tasks and controllers name those of three."""
    return Vec6(alike(value), alike(value))
