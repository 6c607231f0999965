"""The sliding law in a user's own control loop: force, position and direction in, velocity out, a tick at a time."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law, part, reader
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.force_loop import PressingLoop, check_speed
from palpate.force.gains import Gains, load_gains
from palpate.force.guard import flatten
from palpate.force.sliding import slide_state as places
from palpate.force.sliding.slide_domain import crossing_speed, lead_of, numbers_of
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import SIZE, SLIDING_TROUBLES, Sliding, put_vector, vector_at
from palpate.force.sliding.tangent_filter import BASE, G1, G2, MU, STATES, STIFF, variance

CHI2_95 = sqrt(5.991)
"""Deviations within which two jointly normal numbers lie with 95 %."""
Z_95 = 1.96
"""Deviations within which a normal number lies with 95 %."""
DOWN = (0.0, 0.0, -1.0)
ENCODER_STD = 2e-6
"""Standard deviation of a measured position from tick to tick [m]: encoders of many arms resolve a micrometre."""
LAG_STD = 2e-4
"""Standard deviation of the lag between force and position [s]: a tenth of a sensor's period."""
numbers_in = reader(Sliding)


def sliding(gains: Gains, into: ArrayLike = DOWN) -> Sliding:
    """The law's numbers from gains that have a table `slide`.

    Args:
        gains: from `palpate tune --slide`.
        into: direction into the surface in the base's axes, shape (3,).

    Raises:
        InputError: gains without that table, a direction without length.
    """
    slide = numbers_of(gains)
    n = three("the direction into the surface", into)
    if not np.isfinite(n).all() or not np.linalg.norm(n) > 0.0:
        raise InputError(
            f"the direction into the surface needs three numbers that are not all 0, got {into!r}"
        )
    arm = gains.arm
    return Sliding(
        press=gains.cautious(), into=Vec3(*(n / np.linalg.norm(n)).tolist()), slope=slide.slope, mu_max=slide.mu_max,
        ratio=slide.ratio, turning=slide.radius**-3, curvature=1.0 / slide.radius, speed=slide.speed,
        acceleration=slide.acceleration, lead=lead_of(gains), late=min(0.5 * arm.rate / arm.sensor.sampling, 1.0),
        encoder=ENCODER_STD, doubt=LAG_STD, step=slide.step, spacing=slide.touches,
        crossing=crossing_speed(gains),
    )  # fmt: skip


@law
def flat_slide(numbers, s, work, desired, force, position, direction, missed, velocity):
    """`slide_step` on flat arrays: the velocity [m/s] and the state are changed in place."""
    v = slide_step(
        numbers_in(numbers), s, work, desired, vector_at(force, 0), vector_at(position, 0), vector_at(direction, 0),
        missed,
    )  # fmt: skip
    put_vector(velocity, 0, v)


_slide = kernel(flat_slide)


@part
class SlideEstimate(NamedTuple):
    """The surface as a slide knows it.

    Args:
        normal: into the surface; before contact the direction that was given.
        cone: half-angle of the cone about it that holds the true one with 95 % [rad].
        friction: its coefficient; 0 before a slide.
        friction_std: its standard deviation.
        stiffness: as the measured position feels it [N/m]; 0 before a slide.
        stiffness_std: its standard deviation [N/m].
    """

    normal: Vec3
    cone: float
    friction: float
    friction_std: float
    stiffness: float
    stiffness_std: float


@law
def slide_estimate(s):
    """The surface as it is known."""
    normal = vector_at(s, places.NORMAL)
    if s[places.PHASE] != places.SLIDE:
        return SlideEstimate(normal, CHI2_95 * s[places.SLOPE], 0.0, 0.0, 0.0, 0.0)
    a = variance(s, G1, G1)
    b = variance(s, G1, G2)
    c = variance(s, G2, G2)
    larger = 0.5 * (a + c + sqrt((a - c) ** 2 + 4.0 * b * b))
    friction = sqrt(max(variance(s, MU, MU), 0.0))
    stiff = sqrt(max(variance(s, STIFF, STIFF), 0.0))
    cone = CHI2_95 * sqrt(max(larger, 0.0)) / s[STIFF]
    return SlideEstimate(normal, cone, s[MU], friction, s[BASE] * s[STIFF], s[BASE] * stiff)


class Uncertain(float):
    """A number that is not negative, with its uncertainty.

    Args:
        value: the estimate.
        std: its standard deviation.
    """

    std: float

    def __new__(cls, value: float, std: float) -> Uncertain:
        number = super().__new__(cls, value)
        number.std = std
        return number

    @property
    def ci95(self) -> tuple[float, float]:
        """The 95 % interval."""
        return max(float(self) - Z_95 * self.std, 0.0), float(self) + Z_95 * self.std


class SlidingLoop(PressingLoop):
    """Holds a force along an unknown curved surface while the tip moves; from free motion on.

    In the user's own loop, once a tick::

        loop = SlidingLoop.load("gains.toml", into=(0, 0, -1))
        while True:
            x_command += tick * loop.update(force, position, direction)

    The tip looks for the surface along `into`, no faster than the approach of the gains, presses until the force is
    held, and then slides. `trouble` names what is wrong, as of `ForceLoop`, and steps, stick-slip, a force outside the
    friction cone, and lost contact.

    Args:
        gains: from `palpate tune --slide`.
        into: direction into the surface in the base's axes, shape (3,); its error is `slope` of the gains.

    Raises:
        InputError: gains without numbers for a slide, a direction without length.
    """

    def __init__(self, gains: Gains, into: ArrayLike = DOWN):
        self.gains = gains
        self.law = sliding(gains, into)
        self._desired = gains.force
        self._numbers = flatten(self.law)
        self._state = np.zeros(SIZE)
        self._work = np.zeros(STATES)
        self._velocity = np.zeros(3)
        self.reset()
        self._bind()

    @classmethod
    def load(cls, path: str | Path, into: ArrayLike = DOWN) -> SlidingLoop:
        """Load a loop from the file that `palpate tune --slide` wrote.

        Raises:
            InputError: a file that is none, gains without numbers for a slide.
        """
        return cls(load_gains(Path(path)), into)

    def reset(self) -> None:
        """Return to free motion and forget the surface."""
        self.law.start(self._state)

    def limit_speed(self, speed: float) -> None:
        """Limit the speed of the command [m/s], where that is below the arm's own limit.

        Raises:
            InputError: it is below the approach, or no finite number.
        """
        press = self.law.press
        limit = check_speed(speed, self.gains)
        self.law = self.law._replace(press=press._replace(speed=min(press.speed, limit)))
        self._numbers = flatten(self.law)

    def update(
        self, force: ArrayLike, position: ArrayLike, direction: ArrayLike, missed: float = 0.0
    ) -> Array:
        """The velocity of the commanded position for this tick [m/s], shape (3,), in the base's axes.

        Args:
            force: on the surface [N], shape (3,).
            position: of the tip by the arm's encoders [m], shape (3,).
            direction: in which to slide, shape (3,): a unit vector, or a shorter one for a slower slide. Its part along
                the normal counts for nothing.
            missed: ticks that were lost since the last call.

        Raises:
            InputError: an argument of another shape, or of what is no number; the state is unchanged.
        """
        self._one(
            self._numbers, self._state, self._work, self._desired, three("force", force),
            three("position", position), three("direction", direction), cast_number("missed", missed), self._velocity,
        )  # fmt: skip
        return self._velocity.copy()

    def _bind(self) -> None:
        example = (self._numbers, self._state.copy(), self._work, 1.0, *np.zeros((3, 3)), 0.0, self._velocity)
        self._one = machine_code(_slide, *example)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_one"}

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()

    @property
    def sliding(self) -> bool:
        """True if the force was held and the tip slides."""
        return bool(self._state[places.PHASE] == places.SLIDE)

    @property
    def normal(self) -> Array:
        """Estimated normal, into the surface, shape (3,); before contact the direction that was given."""
        return self._state[places.NORMAL : places.NORMAL + 3].copy()

    @property
    def normal_cone95(self) -> float:
        """Half-angle of the cone about `normal` that holds the true one with 95 % [rad]."""
        return float(slide_estimate(self._state).cone)

    @property
    def friction(self) -> Uncertain | None:
        """Coefficient of friction; None before a slide."""
        if not self.sliding:
            return None
        now = slide_estimate(self._state)
        return Uncertain(float(now.friction), float(now.friction_std))

    @property
    def stiffness(self) -> Uncertain | None:
        """Stiffness as the measured position feels it [N/m]; None before a slide."""
        if not self.sliding:
            return None
        now = slide_estimate(self._state)
        return Uncertain(float(now.stiffness), float(now.stiffness_std))

    @property
    def state(self) -> Array:
        """The law's state as flat numbers, shape (SIZE,), changed in place; as the C export has it."""
        return self._state

    @property
    def bound(self) -> float:
        """K_u of the press, by which the gain goes [N/m]; 0 before it."""
        return float(self._state[places.BOUND])

    @property
    def trouble(self) -> str:
        """Fault of the last tick, in words; empty if there was none."""
        return SLIDING_TROUBLES[float(self._state[places.TROUBLE])]


def three(name: str, values: ArrayLike) -> Array:
    """Three numbers of a vector in the base's axes, or a refusal by its name."""
    return cast_array(name, values, (3,))
