"""The cautious law in a user's own control loop: force and position in, speed out, a tick at a time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from palpate._jit import kernel, law, part
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate._vector import Vec3
from palpate.errors import InputError
from palpate.files import write_text
from palpate.force.contact_evidence import FREE_MOTION
from palpate.force.gains import Gains, load_gains
from palpate.force.guard import (
    BOUND,
    DRIFT,
    GUARD,
    LEAST,
    PHASE,
    REST,
    STATE,
    STD,
    TROUBLE,
    TROUBLES,
    VALUE,
    VARIANCE,
    flatten,
    guard_in,
    law_in,
    put_guard,
    put_state,
    safe_step,
    state_in,
)
from palpate.force.stage import LEARNING, LOCKED
from palpate.records import Readable

if TYPE_CHECKING:
    from palpate.force.certificate import Certificate


PHASES = {FREE_MOTION: "free motion", LEARNING: "learning", LOCKED: "locked"}


@law
def flat_step(numbers, state, desired, force, position, missed):
    """`safe_step` on flat arrays: the speed [m/s]; the state changes in place."""
    speed, after, guard = safe_step(
        law_in(numbers), state_in(state[:STATE]), guard_in(state[STATE:]), desired, force, position, missed
    )
    put_state(state[:STATE], after)
    put_guard(state[STATE:], guard)
    return speed


_step = kernel(flat_step)


@part
class SurfaceEstimate(NamedTuple):
    """Estimate of the surface.

    Args:
        stiffness: K as the measured position feels it [N/m].
        stiffness_std: its standard deviation [N/m].
        damping: B [N s/m].
        damping_std: its standard deviation [N s/m].
        bound: K_u, from which the gain follows [N/m].
    """

    stiffness: float
    stiffness_std: float
    damping: float
    damping_std: float
    bound: float


@law
def surface_estimate(cap, theta, found, std, bound):
    """The estimate in SI units, of numbers in caps."""
    return SurfaceEstimate(cap * found.x, cap * std.x, cap * theta * found.y, cap * theta * std.y, bound)


def check_speed(speed: float, gains: Gains) -> float:
    """A speed that a loop may be limited to [m/s].

    Raises:
        InputError: it is below the approach of the gains, or no finite number.
    """
    value = cast_number("the speed", speed)
    if not gains.approach <= value < np.inf:
        raise InputError(f"the speed must be at least the approach of {gains.approach:g} m/s, got {value:g}")
    return value


class PressingLoop(Readable):
    """A loop of some gains with a desired force."""

    gains: Gains
    _desired: float

    @property
    def desired(self) -> float:
        """Desired force F_d [N]."""
        return self._desired

    @desired.setter
    def desired(self, force: float) -> None:
        value = cast_number("the desired force", force)
        least = LEAST * self.gains.arm.sensor.noise
        most = self.gains.force_limit
        if not least <= value < most:
            raise InputError(
                f"the desired force must be from {least:g} N (8 standard deviations of the noise) to below the force "
                f"limit of {most:g} N, got {value:g} N"
            )
        if self.gains.speed_at(value) < self.gains.approach:
            raise InputError(
                f"a desired force of {value:g} N leaves no speed that keeps F_max = {self.gains.force_max:g} N; tune "
                "with a higher --force-max"
            )
        if value != self._desired:
            self._desired = value
            self._limit_speed()

    def _limit_speed(self) -> None:
        """Adapt the speed limit to the desired force; a loop without F_max has nothing to adapt."""


class ForceLoop(PressingLoop):
    """Presses with the force asked for, on any surface within the gains' cap, from free motion on.

    In the user's own loop, once a tick::

        loop = ForceLoop.load("gains.toml")
        while True:
            x_command += tick * loop.update(force, position)

    What it does where something is wrong is the same each time, and `trouble` names it: a reading that is no number,
    or has not changed for longer than the loop's lag: the tip is held. Readings missing for longer than the lag:
    all but the sensor's noise is forgotten, as in free motion. A saturated sensor, or a force above its limit: the tip
    withdraws at least at the speed of the approach. A force that pulls: the tip is held. Contact lost: back to the
    speed of the approach.

    Args:
        gains: from `palpate tune`.
        certificate: of these gains, if there is one.

    Raises:
        InputError: a certificate of another arm, rate or law.
    """

    def __init__(self, gains: Gains, certificate: Certificate | None = None):
        if certificate is not None:
            certificate.check_of(gains)
        self.gains = gains
        self.certificate = certificate
        self._desired = gains.force
        self._limit = np.inf
        self._limit_speed()
        self._state = np.zeros(STATE + GUARD)
        self.reset()
        self._bind()

    @classmethod
    def load(cls, path: str | Path, certificate: str | Path | None = None) -> ForceLoop:
        """Load a loop from the files that `palpate tune` and `palpate certify` wrote.

        Raises:
            InputError: a file that is none, or a certificate of other gains.
        """
        from palpate.force.certificate import Certificate

        proof = None if certificate is None else Certificate.load(Path(certificate))
        return cls(load_gains(Path(path)), proof)

    def save(self, path: str | Path) -> None:
        """Write the gains, the file whole or not at all."""
        write_text(Path(path), self.gains.to_toml())

    def reset(self) -> None:
        """Return to free motion and forget the surface."""
        self._state[:] = 0.0
        self._state[:STATE] = flatten(self.gains.cautious().start())

    def limit_speed(self, speed: float) -> None:
        """Limit the speed of the command [m/s], where that is below the arm's own limit.

        Raises:
            InputError: it is below the approach, or no finite number.
        """
        self._limit = check_speed(speed, self.gains)
        self._limit_speed()

    def _limit_speed(self) -> None:
        speed = min(self.gains.speed_at(self._desired), self._limit)
        self._numbers = flatten(self.gains.cautious()._replace(speed=speed))

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        """The speed of the commanded position for this tick [m/s].

        Args:
            force: on the surface, positive where it presses [N].
            position: of the tip along the normal as the arm's encoders have it, growing into the surface [m].
            missed: ticks that were lost since the last call.

        Raises:
            InputError: an argument that is no number of any type; the state is unchanged.
        """
        return self._one(
            self._numbers, self._state, self._desired, cast_number("force", force),
            cast_number("position", position), cast_number("missed", missed),
        )  # fmt: skip

    @property
    def estimate(self) -> SurfaceEstimate | None:
        """Estimate of the surface; None in free motion and until there is one."""
        s = self._state
        cap = self.gains.seen_cap
        theta = self.gains.theta
        if s[PHASE] == FREE_MOTION or s[STD] == 0.0:
            return None
        value, std = (Vec3(*s[at : at + 3].tolist()) for at in (VALUE, STD))
        return surface_estimate(cap, theta, value, std, float(s[BOUND]))

    @property
    def phase(self) -> str:
        """`free motion`, `learning` or `locked`."""
        return PHASES[float(self._state[PHASE])]

    @property
    def trouble(self) -> str:
        """Fault of the last tick, in words; empty if there was none."""
        return TROUBLES[float(self._state[TROUBLE])]

    @property
    def noise(self) -> float:
        """Standard deviation of a force reading, as measured in free motion [N]."""
        return float(np.sqrt(self._state[VARIANCE]))

    @property
    def bias(self) -> float:
        """Force of the sensor in free motion, which is taken out of the readings [N]."""
        return float(self._state[REST])

    @property
    def drift(self) -> float:
        """Change of that bias over the last second of free motion [N/s]."""
        return float(self._state[DRIFT])

    @property
    def state(self) -> tuple[float, ...]:
        """Everything that it remembers, as plain numbers; to be given back by assignment."""
        return tuple(self._state.tolist())

    @state.setter
    def state(self, numbers: Any) -> None:
        given = cast_array("a state", numbers, self._state.shape)
        if not np.isfinite(given).all() or float(given[PHASE]) not in PHASES:
            raise InputError(
                f"a state is {len(self._state)} finite numbers from ForceLoop.state; give those back"
            )
        self._state[:] = given

    def _bind(self) -> None:
        """The compiled step without the look-up by type that half of a short call's time goes into."""
        self._one = machine_code(_step, self._numbers, self._state.copy(), 1.0, 0.0, 0.0, 0.0)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_one"}

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()
